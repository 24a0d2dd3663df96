"""ROS 2 nodes: convert, call the core, publish. The start of every node is in ``process.py``."""
