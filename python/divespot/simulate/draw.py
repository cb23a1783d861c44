"""Random streams: one per role, all from one seed."""

from __future__ import annotations

from zlib import crc32

import numpy as np

from divespot.errors import DivespotError


def stream(seed: int, role: str, *numbers: int) -> np.random.Generator:
    """Return the generator of one role.

    Roles do not share draws, so that changing one part of a scene leaves the others unchanged.
    """
    if seed < 0:
        raise DivespotError(f"seed is {seed}: a whole number of 0 or more is needed")
    return np.random.default_rng([seed, crc32(role.encode()), *numbers])
