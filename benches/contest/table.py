"""The outcomes as Markdown."""

from __future__ import annotations

import os
import platform
from datetime import datetime, timezone
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from contest.task import HYPOTHESES, MIN_CLUSTER_SIZE, MIN_NEIGHBORS, MIN_SAMPLES

if TYPE_CHECKING:
    from contest.match import Outcome

TITLES = {
    "radius": f"Radius filter, {MIN_NEIGHBORS} neighbours needed",
    "hdbscan": f"HDBSCAN, min_samples {MIN_SAMPLES}, min_cluster_size {MIN_CLUSTER_SIZE}",
    "voxel": "Voxel downsampling, edge of two point spacings",
    "plane": f"Plane fit, {HYPOTHESES} hypotheses",
    "pipeline": "Whole pipeline, array in, volume out",
}
HEAD = (
    "| points | program | best of | seconds | times divespot | peak MB | answer |",
    "|--:|---|--:|--:|--:|--:|---|",
)
PACKAGES = (
    "divespot",
    "open3d",
    "open3d-cpu",
    "hdbscan",
    "fast_hdbscan",
    "scipy",
    "scikit-learn",
    "numpy",
)


def section(outcomes: list[Outcome]) -> list[str]:
    """Return the lines of one kernel's table."""
    ours = {o.count: o.best_s for o in outcomes if o.title == "divespot"}
    rows = [row(outcome, ours[outcome.count]) for outcome in outcomes]
    return [f"## {TITLES[outcomes[0].kernel]}", "", *HEAD, *rows, ""]


def row(outcome: Outcome, ours_s: float | None) -> str:
    """Return one program's line."""
    start = f"| {outcome.count:,} | {outcome.title} |"
    if outcome.best_s is None:
        return f"{start} | | | | {outcome.remark} |"
    ratio = f"{outcome.best_s / ours_s:.3g}" if ours_s else ""
    figures = f"{len(outcome.seconds)} | {outcome.best_s:.4g} | {ratio} | {outcome.peak_mb:,.0f}"
    return f"{start} {figures} | {outcome.remark} |"


def machine() -> list[str]:
    """Describe what this runs on."""
    cores, load = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    memory_gb = int(first("/proc/meminfo", "MemTotal").split()[0]) / 2**20
    system = f"{platform.system()} {platform.machine()}"
    return [
        f"- {first('/proc/cpuinfo', 'model name')}, {cores} cores, {memory_gb:.0f} GB, {system}",
        f"- {datetime.now(timezone.utc):%Y-%m-%d}; load before the run {load:.1f}",
        f"- Python {platform.python_version()}; {', '.join(versions())}",
    ]


def first(path: str, key: str) -> str:
    """Return the value of the first line ``key: value``."""
    lines = Path(path).read_text().splitlines()
    return next((line.split(":")[1].strip() for line in lines if line.startswith(key)), "unknown")


def versions() -> list[str]:
    """Return the programs and their versions."""
    installed = {d.metadata["Name"].lower(): d.version for d in metadata.distributions()}
    return [f"{name} {installed[name]}" for name in PACKAGES if name in installed]
