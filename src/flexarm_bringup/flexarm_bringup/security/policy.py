"""Policies in the format of sros2 (version 0.2.0): one enclave per node, with what it uses and no more.

``ros2 security create_permission`` turns them into signed permissions of DDS-Security.
Source: design.ros2.org, "ROS 2 Access Control Policies".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from flexarm_bringup.processes.graph import enclave_of
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
    """

    name: str
    publish: tuple[str, ...]
    subscribe: tuple[str, ...]
    reply: tuple[str, ...]
    request: tuple[str, ...]

    @property
    def enclave(self) -> str:
        """Path of its enclave."""
        return enclave_of(self.name)


def policy(nodes: Sequence[NodeAccess]) -> str:
    """Return the policy of some nodes as XML."""
    root = ElementTree.Element("policy", version=VERSION)
    enclaves = ElementTree.SubElement(root, "enclaves")
    for node in nodes:
        enclave = ElementTree.SubElement(enclaves, "enclave", path=node.enclave)
        profiles = ElementTree.SubElement(enclave, "profiles")
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
