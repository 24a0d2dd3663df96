"""Left-out physics, one effect a file: each adds its forces to r and its inertia to K of dynamics.py."""
