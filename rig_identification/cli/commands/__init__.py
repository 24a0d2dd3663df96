"""One file a command: its docstring is its help, ``configure`` takes its arguments, ``run`` does it."""
