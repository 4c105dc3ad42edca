"""One acceptance bound and its verdict."""

from __future__ import annotations

from dataclasses import dataclass

OK, MISSED, NOT_JUDGED = "ok", "MISSED", "not judged"


@dataclass(frozen=True)
class Check:
    """One acceptance bound: what was wanted, what was found, and whether that will do.

    ``excuse`` says what else is to blame where it will not: then it is no verdict. Empty where nothing is.
    """

    name: str
    wanted: str
    found: str
    passed: bool
    excuse: str = ""

    @classmethod
    def at_most(cls, name: str, found: float, bound: float, unit: str) -> Check:
        """Return a bound from above."""
        return cls(name, f"at most {bound:g} {unit}", f"{found:.3g} {unit}", found <= bound)

    @property
    def verdict(self) -> str:
        """OK, MISSED or NOT_JUDGED."""
        return OK if self.passed else NOT_JUDGED if self.excuse else MISSED
