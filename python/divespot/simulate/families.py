"""Randomly drawn scenes, by kind."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate.below import BELOW
from divespot.simulate.densities import DENSITIES
from divespot.simulate.levels import LEVELS
from divespot.simulate.over import BODY, OVER
from divespot.simulate.varied import VARIED
from divespot.simulate.vessels import VESSELS
from divespot.simulate.walls import CUT, WALLS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from divespot.simulate.shapes import Maker

OF_KIND: Mapping[str, Mapping[str, Maker]] = MappingProxyType(
    {
        "varied": VARIED,
        "over": OVER,
        "body": BODY,
        "below": BELOW,
        "walls": WALLS,
        "cut": CUT,
        "levels": LEVELS,
        "scan": DENSITIES,
        "vessel": VESSELS,
    }
)
"""Functions that make the scenes of each kind, by name."""
FAMILIES: Mapping[str, Maker] = MappingProxyType(
    {name: maker for makers in OF_KIND.values() for name, maker in makers.items()}
)
"""Functions that make each scene of any kind, by name."""
