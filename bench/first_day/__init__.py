"""The first day of a rig: set-up faults put into clean sessions, and how the examination names them."""
