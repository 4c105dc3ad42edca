"""Model, estimator, controller, guard and simulated rig: the graph of the supervisor as a launch file.

ros2 launch flexarm_bringup rig.launch.py manipulator:=single_link preset:=light_hub bag:=/data/run1

With driver:=drive_states the simulated rig is left out: a driver of a real one speaks (docs/drives.md).

By the clock a crash of an essential node stops the motion, and the node comes back; nothing moves before the
guard is armed again. In lockstep, with respawn:=false, and when it would crash again, it ends the run. Where
security is asked for, the nodes and who stops the motion run in enclaves of their own (docs/security.md).
"""

import atexit
import os
import time
from difflib import get_close_matches
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node

from flexarm_bringup.processes.composition import composed, renamed, write_parameters
from flexarm_bringup.processes.doubles import refuse_doubles
from flexarm_bringup.processes.graph import with_drift, with_driver, with_markers
from flexarm_bringup.processes.second_driver_node import refuse_second_driver
from flexarm_bringup.processes.secured import check_graph_security
from flexarm_bringup.processes.stopper_node import StopperNode
from flexarm_bringup.processes.supervisor import ON_PURPOSE, RESPAWNS, WITHIN
from flexarm_bringup.processes.surroundings import defaults
from flexarm_bringup.tasks.node_settings import arm_graph, drift_settings
from flexarm_model.process.kept import begin
from flexarm_model.process.parent import MARK as PARENT
from launch import LaunchDescription

ARGUMENTS = {
    "manipulator": ("single_link", "name of a manipulator that comes along, or a YAML file"),
    "preset": ("", "preset of that file; empty: the first that the arm's moves are for"),
    "driver": ("", "own driver: topic of its drives, drive_states or joint_states; empty: simulated rig"),
    "lockstep": ("false", "true: nodes wait for each other; false: real time"),
    "bag": ("", "folder to record into; empty: do not record"),
    "composed": ("false", "true: estimator and controller in one process"),
    "markers": ("false", "true: also show the arm to RViz and Foxglove"),
    "drift": ("false", "true: also watch whether the modes still run where they should"),
    "respawn": ("true", "by the clock, start crashed nodes again"),
}
CHOICES = ("lockstep", "composed", "markers", "drift", "respawn")
YES, NO = ("true", "1", "yes", "on"), ("false", "0", "no", "off")  # as YAML and launch's conditions take them
RESPAWN_DELAY = 0.1  # s; all may end in it instead


def generate_launch_description():
    """Return arguments, environment and what makes the nodes."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    environment = [
        SetEnvironmentVariable(name, EnvironmentVariable(name, default_value=value))
        for name, value in defaults().items()
    ]
    environment.append(SetEnvironmentVariable(PARENT, str(os.getpid())))  # nodes end with us, also if killed
    environment += [SetEnvironmentVariable(*item) for item in begin(own_folder()).items()]
    return LaunchDescription([*arguments, *environment, OpaqueFunction(function=nodes)])


def nodes(context):
    """Return a node for every process of the graph."""
    said = [LogInfo(msg=text) for text in strangers(context.launch_configurations)]
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    chosen = {name: is_true(name, given.pop(name)) for name in CHOICES}
    given["lockstep"] = chosen["lockstep"]
    may_return = chosen["respawn"] and not chosen["lockstep"]
    arm = given.pop("manipulator")
    preset = given.pop("preset") or None
    driver = given.pop("driver")
    graph = arm_graph(arm, preset, **given)
    graph = with_driver(graph, driver) if driver else graph
    graph = composed(graph) if chosen["composed"] else graph
    graph = with_markers(graph) if chosen["markers"] else graph
    graph = with_drift(graph, drift_settings(arm, preset)) if chosen["drift"] else graph
    check_graph_security(graph)
    atexit.register(refuse_doubles(graph).close)  # held until launch itself ends
    refuse_second_driver(graph)
    stop = StopperNode().stop
    return [*said, *(node(process, may_return, stop) for process in graph)]


def own_folder():
    """Return a new folder that goes when launch ends; a node that comes back reads it again."""
    folder = Path(mkdtemp(prefix="flexarm_launch_"))
    atexit.register(rmtree, folder, ignore_errors=True)
    return folder


def strangers(given):
    """Return what is to be said of arguments that are none of ours; raises ValueError for a slip of the pen.

    A launch file that includes this one may have its own, so a name like none of ours is only told.
    """
    there_are = f"the rig has {', '.join(ARGUMENTS)}"
    said = []
    for name in sorted(set(given) - set(ARGUMENTS)):
        meant = get_close_matches(name, ARGUMENTS, n=1)
        if meant and meant[0] not in name.split("_"):  # camera_driver is no driver misspelt
            raise ValueError(f"{name}:={given[name]}: no such argument; expected {meant[0]}? {there_are}")
        said.append(f"{name}:={given[name]}: no argument of the rig, and does nothing here; {there_are}")
    return said


def is_true(name, text):
    """Return what an argument says; raises ValueError for what is neither true nor false."""
    if text.lower() not in YES + NO:
        raise ValueError(f"{name}:={text}: expected true or false")
    return text.lower() in YES


def node(process, may_return, stop):
    """Return one process as launch starts it."""
    returns = process.respawn and may_return
    return Node(
        package=process.package,
        executable=process.executable,
        **told(process),
        output="screen",
        respawn=returns,
        respawn_max_retries=-1 if process.essential else RESPAWNS,  # on_exit counts those of late
        respawn_delay=RESPAWN_DELAY,
        on_exit=on_exit(process, returns, stop) if process.essential else None,
    )


def told(process):
    """Return name, parameters and remaps; of several nodes in one process each keeps its own."""
    if process.members:
        path = write_parameters(process, own_folder())
        return {"exec_name": process.name, "parameters": [str(path)], "remappings": renamed(process)}
    named = {"name": process.name, "parameters": [dict(process.parameters)]}
    return {**named, "remappings": list(process.remaps.items())}


def on_exit(process, returns, stop):
    """Return what follows when a process ends before all do: a stop of the motion, or the end of all (1)."""
    crashes = []

    def follow(context):
        """Stop the motion, or end everything."""
        if context.is_shutdown:
            return
        code = context.locals.event.returncode
        now = time.monotonic()
        crashes.append(now)
        of_late = sum(now - at < WITHIN for at in crashes)
        if not returns or code in ON_PURPOSE or of_late > RESPAWNS:
            raise RuntimeError(f"{process.name} ended with {code}")  # the action Shutdown would end with 0
        stop()

    return OpaqueFunction(function=follow)
