"""What the folder of an enclave must hold before a node may run in it.

A key may lie in a device: instead of ``key.pem`` there is ``key.p11`` with its address (PKCS#11).
Source: rmw_dds_common 3.1, security.cpp.
"""

from __future__ import annotations

from pathlib import Path

KEYS = ("identity_ca.cert", "cert", "key", "permissions_ca.cert")
FILES = (*(f"{name}.pem" for name in KEYS), "governance.p7s", "permissions.p7s")


def missing_keys(enclave: Path) -> tuple[str, ...]:
    """Return which of ``FILES`` the folder of an enclave lacks; all of them where there is none."""
    return tuple(name for name in FILES if not ((enclave / name).is_file() or _has_address(enclave / name)))


def _has_address(file: Path) -> bool:
    """Tell whether the address of a key in a device stands in for its file."""
    address = file.with_suffix(".p11")
    is_key = file.suffix == ".pem"
    return is_key and address.is_file() and address.read_bytes().startswith(b"pkcs11:")
