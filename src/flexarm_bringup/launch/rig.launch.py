"""Model, estimator, controller and simulated rig: the graph of flexarm_bringup.graph as a launch file.

ros2 launch flexarm_bringup rig.launch.py manipulator:=single_link preset:=light_hub bag:=/data/run1
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable, Shutdown
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node

from flexarm_bringup.graph import rig_graph
from launch import LaunchDescription

ARGUMENTS = {
    "manipulator": ("single_link", "name of a manipulator that comes along, or a YAML file"),
    "preset": ("geared", "preset of that file"),
    "lockstep": ("false", "true: nodes wait for each other; false: real time"),
    "bag": ("", "folder to record into; empty: do not record"),
}
DEFAULTS = {"OMP_NUM_THREADS": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    environment = [
        SetEnvironmentVariable(name, EnvironmentVariable(name, default_value=value))
        for name, value in DEFAULTS.items()
    ]
    return LaunchDescription([*arguments, *environment, OpaqueFunction(function=nodes)])


def nodes(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    given["lockstep"] = given["lockstep"].lower() == "true"
    return [
        Node(
            package=process.package,
            executable=process.executable,
            name=process.name,
            parameters=[dict(process.parameters)],
            remappings=list(process.remaps.items()),
            output="screen",
            on_exit=Shutdown(reason=f"{process.name} ended") if process.essential else None,
        )
        for process in rig_graph(**given)
    ]
