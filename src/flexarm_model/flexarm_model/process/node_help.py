"""``ros2 run PACKAGE NODE --help``: what a node does, its topics and parameters; nothing is started.

The text is the docstring of the node's module, which lists its topics.
"""

from __future__ import annotations

from flexarm_model.process.node_source import Source, node_parameters
from flexarm_model.settings.parameter_text import allowed_text, table_lines, value_text

USAGE = """\
usage: ros2 run {package} {node} [--ros-args -p NAME:=VALUE -r FROM:=TO --params-file FILE ...]

{text}

Parameters, all read when the node starts: --ros-args -p NAME:=VALUE, or --ros-args --params-file FILE
"""


def node_help(module: str) -> str:
    """Return the help of the node in a module, without importing it."""
    source = Source(module)
    rows = [
        (name, value_text(item.default), item.metadata["unit"], allowed_text(item.default, item.metadata),
         item.metadata["text"])
        for name, item in node_parameters(source).items()
    ]  # fmt: skip
    package, _, node = module.rpartition(".")
    head = USAGE.format(package=package.partition(".")[0], node=node, text=source.text)
    return head + "\n".join(f"  {line}" for line in table_lines(rows)) + "\n"
