"""Concealed sessions by an engine of its own: what the estimator is examined with, never built from."""
