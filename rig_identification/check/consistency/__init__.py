"""Faults that channels show against each other and against the description, one kind a file."""
