"""Arrays inside a result may be shared, so nobody may write to them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


def lock_arrays(holder: Any) -> None:
    """Make every array of a dataclass read-only; an array that the caller may still own is copied."""
    for field in fields(holder):
        value = getattr(holder, field.name)
        if isinstance(value, np.ndarray) and value.flags.writeable:
            own = value.copy(order="K")  # laid out as it was
            own.flags.writeable = False
            object.__setattr__(holder, field.name, own)
