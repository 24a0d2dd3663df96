"""A folder of sessions: which of them are done, each of the others identified in a process, one table."""
