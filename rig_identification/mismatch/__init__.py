"""Mismatch: where the ideal model fails, which physics or sensor error does it, and the fit with it."""
