"""What a user should know of how frames were put together, a sentence each."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from divespot import _native
    from divespot.frames.placing import Placed, View

#: Frames that are named in a warning; of more, their number is said.
NAMED = 5


def warnings_of(view: View, joint: _native.RawJoint, placed: Placed) -> tuple[str, ...]:
    """Say all that there is to say of frames that were fused."""
    said = list(lost(view, placed))
    said += slid(view, placed)
    if len(view.source) > 1 and not joint.has_floor:
        said.append("no floor is in view: heights of frames were matched to each other only")
    return tuple(said)


def lost(view: View, placed: Placed) -> tuple[str, ...]:
    """Name the frames that were left out, with the reason."""
    said = []
    for why, count in Counter(why for _, why in placed.lost).items():
        numbers = [number for number, reason in placed.lost if reason == why]
        named = ", ".join(view.source.names[number] for number in numbers[:NAMED])
        more = f" and {count - NAMED} more" if count > NAMED else ""
        said.append(f"{named}{more}: left out: {why}")
    return tuple(said)


def slid(view: View, placed: Placed) -> list[str]:
    """Return a warning where nothing tells how far the camera moved along some direction."""
    named = "; ".join(
        f"{view.source.names[number]} along ({x:.2f}, {y:.2f}, {z:.2f})"
        for number, (x, y, z) in placed.slid[:NAMED]
    )
    more = f" and {len(placed.slid) - NAMED} more" if len(placed.slid) > NAMED else ""
    said = (
        f"nothing that is seen tells how far the camera moved, as over a bare floor: {named}{more}"
        ": it was taken as expected; something that stands out, or poses, are needed"
    )
    return [said] if placed.slid else []


def stood(frames: int, left_out: float) -> str:
    """Say what was made of a camera that did not move."""
    return (
        f"the camera stood still: {frames} frames were averaged, {left_out:.1%} of their pixels "
        "left out as moving or stray; noise falls with the root of their number, the camera's own "
        "bias does not"
    )
