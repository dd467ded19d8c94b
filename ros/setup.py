"""The ROS 2 package: the executable ``live`` and its launch file."""

from setuptools import setup

setup(
    name="tactid_ros",
    version="0.1.0",
    packages=["tactid_ros"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/tactid_ros"]),
        ("share/tactid_ros", ["package.xml"]),
        ("share/tactid_ros/launch", ["launch/live.launch.py"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    entry_points={"console_scripts": ["live = tactid_ros.live:main"]},
)
