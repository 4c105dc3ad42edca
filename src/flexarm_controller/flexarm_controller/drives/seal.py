"""The seal on what the guard sends to the drives: they obey the one guard that holds their secret.

The drives give a new secret to the guard that attaches. A mark made with it stands in ``header.frame_id`` of
``applied_effort``, as ``"driving 3 9f0c..."``: whether the brakes are to be open, how many ``guard_status``
the guard has sent so far (in lockstep nobody goes on before they have arrived), and a keyed hash of both, of
the stamp and of the torques. Who has only heard earlier messages cannot make one, and an earlier one is
refused by its stamp. It keeps mistakes out, a second guard or a script that publishes on the topic; against
somebody who listens to the answers of services there is DDS Security.
"""

from __future__ import annotations

import hashlib
import hmac
import struct
from collections.abc import Sequence
from dataclasses import dataclass

DRIVING, STANDING = "driving", "standing"
SECRET_BYTES, SEAL_BYTES = 16, 12


@dataclass(frozen=True)
class Mark:
    """What a sealed message says beside its torques: open brakes, ``guard_status`` sent so far [1]."""

    is_driving: bool
    statuses: int


class Seal:
    """Writes and reads marks with one secret."""

    def __init__(self, secret: str) -> None:
        """Take the secret that the drives gave out."""
        self._key = secret.encode()[:64]  # the most that BLAKE2b takes
        self.fingerprint = hashlib.blake2b(self._key, digest_size=4).hexdigest()

    def write(self, mark: Mark, stamp_ns: int, effort: Sequence[float]) -> str:
        """Return the text that seals torques [N m] or [N] which act from a stamp [ns] on."""
        said = f"{DRIVING if mark.is_driving else STANDING} {mark.statuses}"
        return f"{said} {self._hash(said, stamp_ns, effort)}"

    def read(self, text: str, stamp_ns: int, effort: Sequence[float]) -> Mark | None:
        """Return what a mark says; None when it was not written with this secret for this content."""
        said, _, seal = text.rpartition(" ")
        if not hmac.compare_digest(seal.encode(), self._hash(said, stamp_ns, effort).encode()):
            return None
        word, _, statuses = said.partition(" ")
        return Mark(word == DRIVING, int(statuses))

    def _hash(self, said: str, stamp_ns: int, effort: Sequence[float]) -> str:
        content = said.encode() + struct.pack(f"<q{len(effort)}d", stamp_ns, *effort)
        return hashlib.blake2b(content, digest_size=SEAL_BYTES, key=self._key).hexdigest()
