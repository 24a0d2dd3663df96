"""Logs of other makes (CSV, MAT, ROS 1, phones, ...) to recordings of the contract."""
