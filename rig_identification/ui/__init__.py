"""The page on this machine: the tasks of a lab in a browser, over the functions of ``api``."""
