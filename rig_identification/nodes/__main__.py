"""``python -m rig_identification.nodes NAME [--ros-args ...]``: a node where no executable is on the path."""

import sys

from rig_identification.nodes.process import run

if __name__ == "__main__":
    name = sys.argv.pop(1)
    sys.exit(run(name))
