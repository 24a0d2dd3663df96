"""Faults of stamps and clocks, one kind a file: told by stamps, receive times and the order of messages."""
