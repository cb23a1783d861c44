"""The reference system of a file, as given by the user."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from divespot.io.crs import crs_from_wkt
from divespot.io.systems import is_same_system, require_system

if TYPE_CHECKING:
    from divespot.io.scan import RawCloud


def with_system(raw: RawCloud, crs: str | None) -> RawCloud:
    """Return a file's content with the given system, unless the file states its own.

    Raises
    ------
    DivespotError
        The text is not a reference system, or pyproj is missing.

    """
    if crs is None:
        return raw
    found = crs_from_wkt(require_system(crs).to_wkt())
    if raw.crs:
        told = f"the file states its own reference system, which was taken instead of {crs[:60]}"
        same = is_same_system(raw.crs, crs)
        return raw if same else replace(raw, warnings=(*raw.warnings, told))
    return replace(
        raw,
        crs=crs,
        unit=raw.unit or found.unit,
        vertical_unit=raw.vertical_unit or found.vertical_unit,
        projected=raw.projected or found.projected,
    )
