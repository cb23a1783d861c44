"""Whether a rival's answer is divespot's, in a few words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contest.task import ANCHOR, MIN_NEIGHBORS

if TYPE_CHECKING:
    from contest.clouds import Cloud
    from contest.match import Outcome


def remark(outcomes: list[Outcome], cloud: Cloud) -> None:
    """Set the remark of each outcome that has an answer."""
    ours = outcomes[0].answer
    if ours is None:
        return
    for outcome in outcomes:
        if outcome.kernel == "pipeline" and outcome.answer is not None:
            outcome.remark = volume(outcome.answer, cloud)
        elif outcome.answer is not None and not outcome.title.startswith("divespot"):
            outcome.remark = COMPARE[outcome.kernel](ours, outcome.answer, cloud)


def masks(ours: np.ndarray, theirs: np.ndarray, _: Cloud) -> str:
    """Compare the points kept; a rival may answer with counts of neighbours."""
    counted = theirs.dtype != bool
    differing = int((ours != (theirs >= MIN_NEIGHBORS if counted else theirs)).sum())
    said = "same mask" if differing == 0 else f"{differing} points differ"
    return f"{said}; {theirs.mean():.1f} neighbours on average" if counted else said


def labels(ours: np.ndarray, theirs: np.ndarray, _: Cloud) -> str:
    """Compare clusters up to their numbers."""
    pairs, counts = np.unique(np.stack([ours, theirs]), axis=1, return_counts=True)
    # A cluster's counterpart is the rival's cluster with most of its points; noise's is noise.
    agreed = counts[(pairs == -1).all(axis=0)].sum()
    for cluster in range(ours.max() + 1):
        agreed += counts[(pairs[0] == cluster) & (pairs[1] >= 0)].max(initial=0)
    sizes = f"{ours.max() + 1} and {theirs.max() + 1}"
    if agreed == len(ours) and ours.max() == theirs.max():
        return f"same {ours.max() + 1} clusters"
    return f"{sizes} clusters; {agreed / len(ours):.3%} of the points agree"


def voxels(ours: np.ndarray, theirs: np.ndarray, cloud: Cloud) -> str:
    """Compare the means in cubes of the same grid."""
    if len(ours) != len(theirs):
        return f"{len(ours):,} and {len(theirs):,} voxels"
    corner = np.load(cloud.path).min(axis=0) - ANCHOR * cloud.scales.voxel_m
    apart_m = np.abs(by_cube(ours, corner, cloud) - by_cube(theirs, corner, cloud)).max()
    return f"same {len(ours):,} voxels; means at most {apart_m:.1e} m apart"


def by_cube(means: np.ndarray, corner: np.ndarray, cloud: Cloud) -> np.ndarray:
    """Sort means by the cube that each lies in."""
    return means[np.lexsort(np.floor((means - corner) / cloud.scales.voxel_m).T)]


def planes(ours: Any, theirs: Any, cloud: Cloud) -> str:  # noqa: ANN401 - four numbers each
    """Compare planes ``a, b, c, d``: the angle, and how far apart they are at the points."""
    a, b = np.array(ours), np.array(theirs)
    b *= np.sign(a[:3] @ b[:3])
    angle_deg = np.degrees(np.arcsin(min(1.0, np.linalg.norm(np.cross(a[:3], b[:3])))))
    apart_m = abs(np.append(np.load(cloud.path).mean(axis=0), 1.0) @ (a - b))
    return f"{angle_deg:.3f}° and {1000.0 * apart_m:.2f} mm apart"


def volume(answer_m3: float, cloud: Cloud) -> str:
    """Compare a volume with the truth."""
    error = answer_m3 / cloud.volume_m3 - 1.0
    return f"{answer_m3:.4f} m³, {error:+.2%} of the truth"


COMPARE = {"radius": masks, "hdbscan": labels, "voxel": voxels, "plane": planes}
