"""How many cores there are to work on."""

from __future__ import annotations

import os


def cores() -> int:
    """Return how many cores this process may use."""
    may_use = getattr(os, "sched_getaffinity", None)  # not every system tells
    return len(may_use(0)) if may_use else os.cpu_count() or 1
