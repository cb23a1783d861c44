"""The settings: their meaning, defaults and accepted values."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from divespot._arguments import MOST_THREADS, require_kind
from divespot._options import (
    Checked,
    base,
    box,
    choice,
    count,
    described,
    direction,
    flag,
    length,
    listed,
    outlines,
    positive,
    record,
    text,
)
from divespot.errors import DivespotError
from divespot.io.units import UNITS
from divespot.materials import MATERIALS
from divespot.stages import Stages

if TYPE_CHECKING:
    import os

    from typing_extensions import Unpack

    from divespot._typed import Changes, PaperChanges


@described
@dataclass(frozen=True, kw_only=True)
class Settings(Checked):
    """The settings of `divespot.measure`; the command line has an option for each.

    Settings that are None are derived from the scan's own point spacing. `Settings()` is the
    measuring instrument; `Settings.paper()` is the paper's method to the letter.
    """

    unit: str = choice(
        "unit of the scan's coordinates; auto: as the file states, else m", "auto", *UNITS
    )
    crs: str | None = text(
        "reference system of the scan if its file states none: EPSG:CODE or WKT (extra crs)",
        None,
        metavar="SYSTEM",
    )
    columns: str | None = listed(
        "columns of a text table with x, y and z: numbers from 1, or names, as 3,2,4",
        *("three numbers or names, as 3,2,4,", r"[^,]+,[^,]+,[^,]+"),
    )
    classes: str | None = listed(
        "point classes of a LAS file to keep, as 2,6; none: all except noise",
        *("numbers from 0 to 255, as 2,6,", r" *\d{1,3} *(, *\d{1,3} *)*"),
    )
    returns: Literal["all", "first", "last"] = choice(
        "returns of a LAS file to keep", "all", "first", "last"
    )
    crop: tuple[float, ...] | None = box(
        "keep only the points in this box: x0,y0,z0,x1,y1,z1 in the scan's frame and unit", "xyz"
    )
    up: str | tuple[float, float, float] = direction(
        "approximate direction of up in the scan's frame; auto: found from the scan"
    )
    max_tilt_deg: float = positive(
        "largest angle between the given up and the normal of the ground's plane, in degrees",
        *(45.0, 90.0),
    )
    radius_m: float | None = length(
        "radius within which a point needs neighbours, in metres, or it is dropped as an outlier; "
        "0: no filter"
    )
    level: bool = flag(
        "turn the scan so that the ground's plane is level; off: z is up, as in the scan",
        default=True,
    )
    cell_m: float | None = positive("edge of a cell of the height map, in metres")
    margin_m: float | None = positive(
        "height above the ground from which cells count as an object, in metres"
    )
    outline: str | os.PathLike[str] | Mapping[str, Any] | None = outlines(  # noqa: RUF009 - a field
        "measure inside the polygons of this file (GeoJSON, GeoPackage, Shapefile, KML, DXF), in "
        "the scan's frame and unit or another reference system, instead of searching for piles"
    )
    inside: tuple[float, ...] | None = box(
        "measure inside this rectangle, x0,y0,x1,y1 in the scan's frame and unit, instead of "
        "searching for piles",
        "xy",
    )
    base: str = base(
        "base surface: local (predicted from the ground around each pile), plane (fitted to the "
        "ground), peak or midpeak (of the height histogram, as in the paper), height=H (along up "
        "in the scan's frame and unit), camera-height=H (of the scan's origin above the ground, "
        "as in the paper), surface=FILE (an earlier scan, or a saved base)"
    )
    compare_bases: bool = flag("also give each pile's volume above every base that needs no input")
    repeat: bool = flag(
        "measure again with another seed, rounded coordinates, 1 % fewer points and every point "
        "twice, and report how much each volume changes"
    )
    density_kg_m3: float | None = positive("bulk density in kg/m3, for the mass")
    density_u_kg_m3: float | None = length(
        "standard uncertainty of the bulk density in kg/m3; none: the material's, else 0"
    )
    material: str | None = choice(
        "take bulk density and its uncertainty from this material, unless they are given (see "
        "`divespot materials`)",
        *MATERIALS,
        default=None,
    )
    seed: int = count("seed of all random draws", 0, 0, most=2**64 - 1)
    threads: int = count(
        "number of threads, which does not change the result; 0: all", 0, 0, most=MOST_THREADS
    )
    stages: Stages = record(  # noqa: RUF009 - a field
        "parameters of the method's stages, named as in the paper", Stages
    )

    def __post_init__(self) -> None:
        """Check every value, and that not both outline and inside are given."""
        super().__post_init__()
        if self.outline is not None and self.inside is not None:
            raise DivespotError("outline and inside were both given: one of them is needed")

    @property
    def is_outlined(self) -> bool:
        """Whether areas are given, by an outline or a rectangle, instead of searched for."""
        return self.outline is not None or self.inside is not None

    @property
    def has_earlier(self) -> bool:
        """Whether the base is a given surface, such as an earlier scan."""
        return self.base.startswith("surface=")

    @classmethod
    def paper(cls, **changes: Unpack[PaperChanges]) -> Settings:
        """Return the paper's method: one pile, cut above one ground height, without a toe.

        Parameters
        ----------
        **changes
            Settings, and parameters of the `Stages`, by name.

        Examples
        --------
        >>> from divespot import Settings
        >>> Settings.paper(window=3).stages.window
        3

        """
        paper = Stages(
            scene_cluster=True,
            voxel_m=None,
            surface="cells",
            ground_form="level",
            select="largest",
            toe_m=0.0,
        )
        return cls(base="peak", stages=paper).tuned(**changes)

    def changed(self, **changes: Unpack[Changes]) -> Settings:
        """Return these settings with some of them changed.

        Raises
        ------
        DivespotError
            A name is not a setting, or a value is out of range.

        Examples
        --------
        >>> from divespot import Settings
        >>> Settings(cell_m=0.1).changed(seed=3) == Settings(cell_m=0.1, seed=3)
        True

        """
        for name in changes:
            if name not in NAMES:
                known = f"unknown setting {name!r}: one of {', '.join(NAMES)} is needed"
                raise DivespotError(elsewhere(name) or known)
        return dataclasses.replace(self, **changes)

    def tuned(self, **changes: Unpack[PaperChanges]) -> Settings:
        """Return these settings with some of them, or of their stages' parameters, changed.

        Raises
        ------
        DivespotError
            A name is neither, or a value is out of range.

        """
        own: dict[str, Any] = dict(changes)
        inner = {name: own.pop(name) for name in changes if name in STAGE_NAMES}
        if inner:
            own["stages"] = dataclasses.replace(own.get("stages", self.stages), **inner)
        return self.changed(**own)

    def completed(self, **derived: Unpack[PaperChanges]) -> Settings:
        """Return these settings with derived values in place of None."""
        known = {**vars(self.stages), **vars(self)}
        missing: Any = {name: value for name, value in derived.items() if known[name] is None}
        return self.tuned(**missing)


def as_settings(
    settings: Settings | Mapping[str, Any] | None, **changes: Unpack[Changes]
) -> Settings:
    """Return `settings`, or settings from a dict, with `changes` by name.

    Raises
    ------
    DivespotError
        `settings` is neither, a name is not a setting, or a value is out of range.

    """
    if isinstance(settings, Mapping):
        settings = Settings().changed(**settings)
    elif settings is not None:
        require_kind("settings", settings, Settings)
    return (settings or Settings()).changed(**changes)


NAMES = tuple(item.name for item in dataclasses.fields(Settings))
STAGE_NAMES = tuple(item.name for item in dataclasses.fields(Stages))

#: Settings of earlier versions that are now arguments of `divespot.volume`.
_VOLUME = ("method", "inner_voxel_m", "slice_m", "slice_contour", "alpha_m")


def elsewhere(name: str) -> str | None:
    """Return where a name that is no setting is accepted; None if nowhere."""
    if name in STAGE_NAMES:
        return f"{name} is no setting of the instrument: Settings.paper({name}=...) is needed"
    if name == "ring_share":
        return "ring_share is no setting any more: annulus_share is needed"
    if name in _VOLUME:
        return f"{name} is no setting any more: divespot.volume.volumes_m3 is needed"
    return None


#: Bases that do not need the ground in view.
GIVEN = ("height=", "surface=")


def needs_ground(settings: Settings) -> bool:
    """Return whether the base is the ground in view, not a given floor."""
    return not settings.is_outlined and not settings.base.startswith(GIVEN)


def given(value: float | None) -> float:
    """Return a length that was given or derived by now."""
    if value is None:
        raise DivespotError(
            "a length is not known yet: settings that a scan has completed are needed"
        )
    return value
