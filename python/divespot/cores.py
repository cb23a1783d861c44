"""The number of cores available."""

from __future__ import annotations

import os


def cores() -> int:
    """Return the number of cores that this process may use."""
    may_use = getattr(os, "sched_getaffinity", None)  # not on every system
    return len(may_use(0)) if may_use else os.cpu_count() or 1
