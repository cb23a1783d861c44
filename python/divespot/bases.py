"""Base surfaces: the ground around each pile, or one surface for all piles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.base_name import PLAIN, BaseName
from divespot.directions import upward
from divespot.dot import dot
from divespot.errors import DivespotError
from divespot.ground_level import peak_m
from divespot.settings import given
from divespot.up import STEEPEST_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.earlier import Seen
    from divespot.frame import Frame
    from divespot.grid import HeightMap
    from divespot.ground_level import GroundLevel
    from divespot.settings import Settings

#: A warning is given if a given surface has no data below more than this share of the measured
#: area.
UNSEEN_SHARE = 0.01


@dataclass(frozen=True)
class Bases:
    """The ground, the base that is used, and those to compare; None means a local base."""

    ground: GroundLevel
    chosen: _native.RawBase | None
    compared: dict[str, _native.RawBase | None]

    def raw(self) -> list[_native.RawBase | None]:
        """Return all bases as the kernel takes them, the one that is used first."""
        return [self.chosen, *self.compared.values()]


@dataclass(frozen=True)
class _Maker:
    """The data from which a base is made."""

    grid: HeightMap
    ground: GroundLevel
    frame: Frame
    earlier: Seen | None
    settings: Settings

    def make(self, text: str) -> _native.RawBase | None:
        name = BaseName.parse(text)
        if name is None or name.kind == "local":
            return None
        if name.kind == "surface":
            return self._surface(name.path)
        if name.kind == "height":
            return self._level_to_up(text, name.height)
        return self._plane(self._level_m(text, name), (0.0, 0.0))

    def _level_m(self, text: str, name: BaseName) -> float:
        """Return the height, in the level frame, of a base parallel to the ground."""
        if name.kind == "camera-height":
            normal, offset_m = self.frame.pose.plane.normal, self.frame.pose.plane.offset_m
            sensor_m = -float(dot(normal, self.frame.origin_m)) - offset_m
            return self._checked(text, sensor_m - name.height * self.frame.metres)
        return 0.0 if name.kind == "plane" else peak_m(self.grid, name.kind, self.settings)

    def _level_to_up(self, text: str, height: float) -> _native.RawBase:
        """Return the plane ``up @ p == height``, with `p` in the scan's own frame and unit."""
        rotation = self.frame.pose.rotation
        up = upward(rotation[2], self.settings.up)
        x, y, z = dot(rotation, up).tolist()
        if z < math.cos(math.radians(STEEPEST_DEG)):
            raise DivespotError(
                f"base is {text!r}: the ground lies {math.degrees(math.acos(z)):.0f}° from level "
                f"to up, at most {STEEPEST_DEG:.0f}° is needed"
            )
        above_m = height * self.frame.metres - float(dot(up, self.frame.origin_m))
        level_m = above_m / z - self.frame.pose.plane.offset_m
        middle = [0.5 * float(v.min() + v.max()) for v in self.grid.centers_m()]
        self._checked(text, level_m - (x * middle[0] + y * middle[1]) / z)
        return self._plane(level_m, (-x / z, -y / z), given_height=True)

    def _checked(self, text: str, level_m: float) -> float:
        """Return a height, unless its distance from the ground exceeds the size of the scan."""
        off_m = level_m - self.ground.height_m
        size_m = self.grid.cell_m * math.hypot(*self.grid.heights_m.shape)
        if abs(off_m) > size_m:
            side = "above" if off_m > 0.0 else "below"
            raise DivespotError(
                f"base is {text!r}: that is {abs(off_m):.3g} m {side} the ground of a scan of "
                f"{size_m:.3g} m, a height in the scan's own frame and unit is needed"
            )
        return level_m

    def _plane(
        self, level_m: float, tilt: tuple[float, float], *, given_height: bool = False
    ) -> _native.RawBase:
        noise = self.ground.noise_m
        return _native.plane_base(level_m, tilt, noise, noise, given_height)

    def _surface(self, path: str) -> _native.RawBase:
        grid, earlier = self.grid, self.earlier
        if earlier is None:
            raise DivespotError(
                f"base surface={path}: was not read: a survey to take it from is needed"
            )
        try:
            return _native.surface_base(
                earlier.grid.heights_m, grid.origin_m, grid.cell_m, self.ground.noise_m
            )
        except DivespotError as error:
            raise DivespotError(f"base surface={path}: {error}") from None


def find_bases(
    grid: HeightMap,
    ground: GroundLevel,
    frame: Frame,
    earlier: Seen | None,
    settings: Settings,
) -> Bases:
    """Find the base that was asked for, and those to compare with it.

    ``plane`` is the ground's plane as fitted; ``peak`` and ``midpeak`` are parallel to it, at the
    height of the histogram's peak and of the midpoint of its peaks (paper, "When the ground becomes
    uneven"). ``camera-height=H`` lies `H` below the scan's origin, where the sensor is, along the
    ground's normal (paper, Evaluation). ``height=H`` is the plane ``up @ p == H``, whatever the
    ground's tilt; up is the setting's direction, or, for auto, the scan's axis nearest to the
    ground's normal. ``surface=FILE`` is a scan of the empty floor or a saved base. `H` and the file
    are in the scan's own frame and unit.

    Raises
    ------
    DivespotError
        The file cannot be read or does not overlap the scan, or a height is far from the scan.

    """
    make = _Maker(grid, ground, frame, earlier, settings).make
    chosen = make(settings.base)
    if not settings.compare_bases:
        return Bases(ground, chosen, {})
    return Bases(ground, chosen, {**{name: make(name) for name in PLAIN}, settings.base: chosen})


def whole_base(
    grid: HeightMap,
    bases: Bases,
    below_m: NDArray[np.float64],
    settings: Settings,
) -> NDArray[np.float64]:
    """Return the base of the whole scene, NaN where it is unknown.

    A local base is the one found below each object, `below_m`, and elsewhere the ground as it was
    seen.
    """
    if bases.chosen is not None:
        return bases.chosen.over(grid.heights_m.shape, grid.origin_m, grid.cell_m)
    off = np.abs(grid.heights_m - bases.ground.surface_m)
    seen = np.where(off <= given(settings.margin_m), grid.heights_m, np.nan)
    return np.where(np.isnan(below_m), seen, below_m)


def unknown(whole_m: NDArray[np.float64], below_m: NDArray[np.float64]) -> list[str]:
    """Return a warning if the base is unknown below much of the measured area."""
    share = np.isnan(whole_m[~np.isnan(below_m)])
    if not len(share) or share.mean() <= UNSEEN_SHARE:
        return []
    what = f"the base has no data below {share.mean():.0%} of the measured area"
    return [f"{what}: it was interpolated there"]
