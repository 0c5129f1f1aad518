"""Installs the node as ROS packages are."""

from pathlib import Path

from setuptools import setup

NAME = "fervor_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *(
            (f"share/{NAME}/{folder}", [str(file) for file in Path(folder).iterdir()])
            for folder in ("launch", "config")
        ),
    ],
    # fervor itself comes from PyPI: no rosdep key stands for it.
    install_requires=["setuptools", "fervor"],
    zip_safe=False,
    maintainer="fervor developers",
    maintainer_email="fervor@example.org",
    description="Live emotional intensity of tracked people (REP-155) from a fervor service.",
    license="Apache-2.0",
    entry_points={"console_scripts": ["fervor_node = fervor_ros.main:main"]},
)
