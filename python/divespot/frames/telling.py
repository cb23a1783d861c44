"""Warnings about fused frames, one sentence each."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from divespot import _native
    from divespot.frames.placing import Placed
    from divespot.frames.views import Views

#: Most frames that a warning names; others are counted.
NAMED = 5
#: Nearest and farthest range of depth cameras, in metres.
CAMERA_M = (0.15, 10.0)


def warnings_of(view: Views, joint: _native.RawJoint, placed: Placed) -> tuple[str, ...]:
    """Return all warnings about fused frames."""
    said = [*view.doubts, *lost(view, placed), *apart(view, placed)]
    said += slid(view, joint, placed)
    said += far(view, joint)
    if len(view.source) > 1 and not joint.has_floor:
        said.append("no floor is in view: heights of frames were matched to each other only")
    return tuple(said)


def lost(view: Views, placed: Placed) -> tuple[str, ...]:
    """Return a warning that names the frames that were left out, for each reason."""
    said = []
    for why, count in Counter(why for _, why in placed.lost).items():
        numbers = [number for number, reason in placed.lost if reason == why]
        named = ", ".join(view.source.names[number] for number in numbers[:NAMED])
        more = f" and {count - NAMED} more" if count > NAMED else ""
        said.append(f"{named}{more}: left out: {why}")
    return tuple(said)


def apart(view: Views, placed: Placed) -> list[str]:
    """Return a warning about frames that overlap little with earlier ones."""
    named = ", ".join(
        f"{view.source.names[number]} ({overlap:.0%})" for number, overlap in placed.apart[:NAMED]
    )
    more = f" and {len(placed.apart) - NAMED} more" if len(placed.apart) > NAMED else ""
    said = (
        f"{named}{more}: overlaps earlier frames so little that its pose may be wrong: an overlap "
        "of 70 % or more is needed"
    )
    return [said] if placed.apart else []


def slid(view: Views, joint: _native.RawJoint, placed: Placed) -> list[str]:
    """Return a warning if the scene does not show how far the camera moved in some direction.

    That is, neither when a frame was registered nor in the joint solution.
    """
    found = [(number, way) for number, way in placed.slid if joint.slides[number]]
    named = "; ".join(
        f"{view.source.names[number]} along ({x:.2f}, {y:.2f}, {z:.2f})"
        for number, (x, y, z) in found[:NAMED]
    )
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    said = (
        f"nothing in view shows how far the camera moved, as over a bare floor: {named}{more}"
        ": the expected motion was kept; something that stands out, or poses, are needed"
    )
    return [said] if found else []


def far(view: Views, joint: _native.RawJoint) -> list[str]:
    """Return a warning if depth of an assumed unit is outside the range of cameras."""
    low_m, high_m = CAMERA_M
    is_known = view.source.is_clouds or view.source.step_m is not None
    said = (
        f"the frames show surfaces {joint.range_m:.3g} m away: depth_scale, metres per unit of "
        "depth, may be wrong"
    )
    return [] if is_known or low_m <= joint.range_m <= high_m else [said]


def stood(frames: int, left_out: float) -> str:
    """Return a note on frames of a camera that did not move."""
    return (
        f"the camera stood still: {frames} frames were averaged, {left_out:.1%} of their pixels "
        "left out as moving or outliers; noise falls with the root of their number, the camera's "
        "own bias does not"
    )
