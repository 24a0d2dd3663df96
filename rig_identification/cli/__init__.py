"""The front door: arguments, progress, exit status."""
