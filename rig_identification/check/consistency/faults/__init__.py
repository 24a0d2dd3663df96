"""Hypotheses about a session's set-up, one kind a file: each yields what its change would be and its words."""
