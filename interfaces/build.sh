#!/usr/bin/env bash
# Builds rig_identification_interfaces for the Python that runs it, and installs it into a folder:
#   interfaces/build.sh PREFIX [PYTHON]
# It needs cmake, a C++ compiler, Python's headers and pip install '.[interfaces]' (docs/how-to/typed-interface.md).
set -euo pipefail

prefix="$(realpath -m "${1:?give the folder to install into}")"
python="$(command -v "${2:-python3}")"
source="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/rig_identification_interfaces"
build="$(mktemp -d)"
trap 'rm -rf "$build"' EXIT

ros="$("$python" -c 'import sys; print(sys.prefix)')" # the wheels lie in the environment's own folder
export AMENT_PREFIX_PATH="$ros${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}"
export PATH="$(dirname "$python"):$PATH"

cmake -S "$source" -B "$build" -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_PREFIX_PATH="$ros" \
    -DPython3_EXECUTABLE="$python" -DCMAKE_CXX_FLAGS=-w -DCMAKE_C_FLAGS=-w >"$build/log" || { cat "$build/log"; exit 1; }
cmake --build "$build" --parallel "$(nproc)" >>"$build/log" || { cat "$build/log"; exit 1; }
cmake --install "$build" >>"$build/log"

packages="$("$python" -c 'import sys; print(f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages")')"
cat <<TEXT
export PYTHONPATH=$prefix/$packages\${PYTHONPATH:+:\$PYTHONPATH}
export LD_LIBRARY_PATH=$prefix/lib\${LD_LIBRARY_PATH:+:\$LD_LIBRARY_PATH}
export AMENT_PREFIX_PATH=$prefix\${AMENT_PREFIX_PATH:+:\$AMENT_PREFIX_PATH}
TEXT
