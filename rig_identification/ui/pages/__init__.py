"""The tasks of the page, one a file: what it shows, and what its form asks the functions of ``api``."""
