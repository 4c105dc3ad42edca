"""The running graph under the name that tests know."""

from flexarm_bringup.running_graph_node import Ear as Ear
from flexarm_bringup.running_graph_node import running as running
