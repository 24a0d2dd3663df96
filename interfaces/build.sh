#!/usr/bin/env bash
# Builds rig_identification_interfaces for a Python that has ROS 2 from the package index, and installs it:
#   interfaces/build.sh PREFIX [PYTHON]
# It needs cmake, a C++ compiler, the headers of Python and pip install ".[interfaces]".
# It prints what to export.
set -euo pipefail

prefix="$(realpath -m "${1:?give the folder to install into}")"
python="$(command -v "${2:-python3}")"
sources="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT

ros="$("$python" -c 'import sys; print(sys.prefix)')" # the wheels lie in the environment's own folder
export AMENT_PREFIX_PATH="$ros${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}"
PATH="$(dirname "$python"):$PATH"

build() {
    local log="$folder/$1.log"
    {
        cmake -S "$sources/$1" -B "$folder/$1" -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_PREFIX_PATH="$ros" \
            -DPython3_EXECUTABLE="$python" &&
            cmake --build "$folder/$1" --parallel "$(nproc)" && cmake --install "$folder/$1"
    } >"$log" 2>&1 || {
        cat "$log" >&2
        exit 1
    }
}

build rig_identification_interfaces
# The package index has no tf2_msgs; a full ROS 2 has.
"$python" -c 'from tf2_msgs.msg import TFMessage' 2>/dev/null || build tf2_msgs

packages="$("$python" -c 'import sys; print("lib/python%d.%d/site-packages" % sys.version_info[:2])')"
cat <<TEXT
export PYTHONPATH=$prefix/$packages\${PYTHONPATH:+:\$PYTHONPATH}
export LD_LIBRARY_PATH=$prefix/lib\${LD_LIBRARY_PATH:+:\$LD_LIBRARY_PATH}
export AMENT_PREFIX_PATH=$prefix\${AMENT_PREFIX_PATH:+:\$AMENT_PREFIX_PATH}
TEXT
