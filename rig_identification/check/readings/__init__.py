"""Faults that one channel's readings show by themselves, one kind a file."""
