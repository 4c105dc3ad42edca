"""Whether anybody is in a ROS domain of this machine, by its sockets."""

import socket
from pathlib import Path

import pytest

from flexarm_bringup.processes.domain_ports import FIRST, PER_DOMAIN, may_be_used

HEAD = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"


def table(folder: Path, *ports: int) -> list[Path]:
    """Write a table of sockets as Linux does."""
    path = folder / "udp"
    rows = (
        f"  {n}: 00000000:{port:04X} 00000000:0000 07 0:0 00:0 0 0 0 1 2\n" for n, port in enumerate(ports)
    )
    path.write_text(HEAD + "".join(rows), encoding="ascii")
    return [path]


@pytest.mark.parametrize(("port", "is_used"), [(7649, False), (7650, True), (7899, True), (7900, False)])
def test_a_domain_has_its_own_ports(port: int, is_used: bool, tmp_path: Path) -> None:
    assert may_be_used(1, table(tmp_path, 53, port)) == is_used


def test_a_machine_that_does_not_tell_may_have_somebody(tmp_path: Path) -> None:
    assert may_be_used(1, [tmp_path / "none"])


def test_a_socket_of_this_machine_is_seen() -> None:
    domain = 201
    for port in range(FIRST + PER_DOMAIN * domain, FIRST + PER_DOMAIN * (domain + 1)):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
            held.bind(("127.0.0.1", port))
            assert may_be_used(domain)
            return
