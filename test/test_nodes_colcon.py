"""After ``colcon build`` every executable runs as ``ros2 run rig_identification NAME`` would start it."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from node_processes import PATIENCE, ROOT, Graph, without_information

COLCON = shutil.which("colcon", path=sysconfig.get_path("scripts") + os.pathsep + os.environ.get("PATH", ""))
NAMES = (
    "load_cells", "imu", "inclinometer", "tracker", "preprocessor", "identifier", "rig_simulator", "recorder",
    "replay",
)  # fmt: skip


@pytest.mark.skipif(COLCON is None, reason="colcon is not installed: pip install colcon-common-extensions")
def test_every_executable_runs_from_the_install_folder(tmp_path: Path) -> None:
    assert COLCON is not None
    source = tmp_path / "src" / "rig_identification"
    ignored = shutil.ignore_patterns(
        ".*", "__pycache__", "build", "install", "log", "*.egg-info", "test", "bench"
    )
    shutil.copytree(ROOT, source, ignore=ignored)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    scripts = Path(sysconfig.get_path("scripts"))
    environment["PATH"] = f"{scripts}{os.pathsep}{environment['PATH']}"
    built = subprocess.run([COLCON, "build"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    library = tmp_path / "install" / "rig_identification" / "lib" / "rig_identification"
    (packages,) = (tmp_path / "install" / "rig_identification" / "lib").glob("python3*/site-packages")
    graph = Graph(tmp_path)
    environment |= {
        "PYTHONPATH": str(packages), "ROS_DOMAIN_ID": str(graph.domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_LOG_DIR": str(tmp_path / "log"),
    }  # fmt: skip
    for name in NAMES:
        assert f"{sys.prefix}" in (library / name).read_text().splitlines()[0]
        command = [str(library / name), "--ros-args", "--params-file", str(graph.rig_file)]
        process = subprocess.Popen(
            command,
            cwd=tmp_path,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        time.sleep(0.2)
        end = time.monotonic() + 20.0 * PATIENCE
        while process.poll() is None and "librcl" not in Path(f"/proc/{process.pid}/maps").read_text():
            assert time.monotonic() < end, f"{name} does not come up"
            time.sleep(0.02)
        if name != "replay":
            process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60.0 * PATIENCE)
        expected = (2, "replay: parameter session: is empty; give the folder of a session\n")
        assert (name, process.returncode, without_information(output)) == (
            name,
            *(expected if name == "replay" else (0, "")),
        )


@pytest.mark.long
@pytest.mark.skipif(COLCON is None, reason="colcon is not installed: pip install colcon-common-extensions")
def test_both_packages_build_in_one_workspace(tmp_path: Path) -> None:
    """The command of docs/how-to/typed-interface.md, against the wheels; what it builds is imported."""
    pytest.importorskip("ament_package", reason="pip install '.[interfaces]'")
    for tool in ("cmake", "c++"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    assert COLCON is not None
    page = (ROOT / "docs" / "how-to" / "typed-interface.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^colcon (build .*)$", page, re.MULTILINE)
    ignored = shutil.ignore_patterns(
        ".*", "__pycache__", "build", "install", "log", "*.egg-info", "test", "bench"
    )
    shutil.copytree(ROOT, tmp_path / "src" / "rig_identification", ignore=ignored)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    path = f"{Path(sysconfig.get_path('scripts'))}{os.pathsep}{environment['PATH']}"
    environment |= {"PATH": path, "AMENT_PREFIX_PATH": sys.prefix, "CMAKE_PREFIX_PATH": sys.prefix}
    command = [COLCON, *line.split(), "--cmake-args", f"-DPython3_EXECUTABLE={sys.executable}"]
    built = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    assert "2 packages finished" in built.stdout
    code = (
        "from rig_identification_interfaces.action import IdentifyInertia as I; print(I.Goal(session='car'))"
    )
    script = f'source install/setup.bash && exec "{sys.executable}" -c "{code}"'
    told = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert "session='car'" in told.stdout, told.stderr
