"""ament_python package: `pip install .` and `colcon build` both read this file."""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = "rig_identification"
ROOT = Path(__file__).resolve().parent  # `colcon build --symlink-install` runs a link to this file
VERSION = re.search(r'__version__ = "(.+)"', (ROOT / NAME / "__init__.py").read_text())[1]

# The ROS wheels exist for this platform alone; elsewhere rclpy comes with a Jazzy installation.
ROS_WHEELS = '; platform_system == "Linux" and platform_machine == "x86_64"'


def shared(folder: str, *patterns: str) -> tuple[str, list[str]]:
    """Files of a root folder that go to ``share/rig_identification/<folder>``."""
    files = sorted(str(p.relative_to(ROOT)) for pattern in patterns for p in (ROOT / folder).glob(pattern))
    return f"share/{NAME}/{folder}", files


# One name a ROS node: the executable, and its module in rig_identification/nodes.
NODES = [
    f"{name} = rig_identification.nodes.process:{name}"
    for name in (
        "load_cells",
        "imu",
        "inclinometer",
        "tracker",
        "preprocessor",
        "identifier",
        "rig_simulator",
        "recorder",
        "replay",
    )
]

setup(
    name=NAME,
    version=VERSION,
    description="Mass, centre of mass and inertia of a body on a cable rig, and what the model left out",
    long_description=(ROOT / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="rig_identification maintainers",
    maintainer="rig_identification maintainers",
    license="Apache-2.0",
    python_requires=">=3.10",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["py.typed"],
        f"{NAME}.report": ["templates/*", "vendored/*/*"],
        f"{NAME}.thesis": ["tables/*"],
        f"{NAME}.ui": ["templates/*", "static/*"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        shared("config", "*.yaml", "*.json", "*.rviz"),
        shared("launch", "*.launch.py"),
    ],
    zip_safe=False,
    install_requires=[
        'backports.zstd>=1.0; python_version < "3.14"',
        "jinja2>=3.1",
        "lz4>=4.3",
        "numba>=0.59",
        "numpy>=1.24",
        "ruamel.yaml>=0.18",
        "rich>=13.0",
        "rosbags>=0.11,<0.12",
        "scipy>=1.11",
    ],
    extras_require={
        "ros": [
            f"ros-jazzy-rclpy[fastrtps]{ROS_WHEELS}",
            f"ros-jazzy-common-interfaces{ROS_WHEELS}",
            "pyserial>=3.5",
        ],
        # What cmake needs for interfaces/ against the wheels, which do not name one another.
        "interfaces": [
            f"ros-jazzy-{name}{ROS_WHEELS}"
            for name in (
                "ament-cmake",
                "ament-cmake-gmock",
                "ament-cmake-gtest",
                "ament-cmake-include-directories",
                "ament-cmake-pytest",
                "ament-cmake-ros",
                "ament-package",
                "python-cmake-module",
                "rosidl-core-generators",
                "rosidl-default-generators",
            )
        ],
        "pandas": ["pandas>=2.0"],
        "mat": ["pymatreader>=1.0"],
        "mdf": ["asammdf>=8.0"],
        "tdms": ["npTDMS>=1.7"],
        "ulog": ["pyulog>=1.0"],
        "test": [
            f"colcon-common-extensions>=0.3{ROS_WHEELS}",
            "fpdf2>=2.7.9",
            "hypothesis>=6.90",
            "jsonschema>=4.18",
            "npTDMS>=1.7",
            "pandas>=2.0",
            "pymatreader>=1.0",
            "pytest>=8.0",
            "pytest-xdist>=3.6",
            "pyulog>=1.0",
            "ruff>=0.17,<0.18",
            "starlette>=0.40",
            "uvicorn>=0.30",
        ],
        "ui": ["starlette>=0.40", "uvicorn>=0.30"],
        "pdf": ["fpdf2>=2.7.9"],
        "completion": ["shtab>=1.6"],
        "browser": ["playwright>=1.40"],
        "docs": ["mkdocs-material>=9.5", "mkdocstrings[python]>=0.27"],
        "notebook": ["ipykernel>=6.20", "matplotlib>=3.6", "nbclient>=0.8", "nbformat>=5.7", "pandas>=2.0"],
        "dev": ["exudyn>=1.8", "mujoco>=3.1", "mypy>=1.10"],
    },
    entry_points={"console_scripts": ["rig-identification = rig_identification.cli.main:main", *NODES]},
)
