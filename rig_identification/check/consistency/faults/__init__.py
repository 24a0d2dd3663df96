"""Hypotheses about a session's set-up, one kind a file: what each would change, and its words."""
