"""Policies in the format of sros2 (version 0.2.0): one enclave per node, with what it uses and no more.

The tools of the command line share enclaves: one for those that listen, one for those that command.

``ros2 security create_permission`` turns them into signed permissions of DDS-Security.
Source: design.ros2.org, "ROS 2 Access Control Policies".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from flexarm_bringup.topics import NAMESPACE

VERSION = "0.2.0"


@dataclass(frozen=True)
class NodeAccess:
    """What a node uses; absolute names.

    Attributes:
        name: Of the node, in the namespace of flexarm.
        publish: Topics.
        subscribe: Topics.
        reply: Services that it offers.
        request: Services that it calls.
        shared: Enclave that it shares with others; empty: its own.
    """

    name: str
    publish: tuple[str, ...]
    subscribe: tuple[str, ...]
    reply: tuple[str, ...]
    request: tuple[str, ...]
    shared: str = ""

    @property
    def enclave(self) -> str:
        """Path of its enclave."""
        return self.shared or f"{NAMESPACE}/{self.name}"


def policy(nodes: Sequence[NodeAccess]) -> str:
    """Return the policy of some nodes as XML."""
    root = ElementTree.Element("policy", version=VERSION)
    enclaves = ElementTree.SubElement(root, "enclaves")
    profiles_of: dict[str, ElementTree.Element] = {}
    for node in nodes:
        if node.enclave not in profiles_of:
            enclave = ElementTree.SubElement(enclaves, "enclave", path=node.enclave)
            profiles_of[node.enclave] = ElementTree.SubElement(enclave, "profiles")
        profiles = profiles_of[node.enclave]
        profile = ElementTree.SubElement(profiles, "profile", ns=NAMESPACE, node=node.name)
        _allow(profile, "service", "reply", node.reply)
        _allow(profile, "service", "request", node.request)
        _allow(profile, "topic", "publish", node.publish)
        _allow(profile, "topic", "subscribe", node.subscribe)
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def _allow(profile: ElementTree.Element, kind: str, right: str, names: Sequence[str]) -> None:
    if not names:
        return
    group = ElementTree.SubElement(profile, f"{kind}s", {right: "ALLOW"})
    for name in sorted(set(names)):
        ElementTree.SubElement(group, kind).text = name
