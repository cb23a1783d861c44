"""The scale of a map projection."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.extras import is_installed
from divespot.io import UNITS
from divespot.io.systems import scale_factor

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.io import Scan

#: A larger deviation of the scale is corrected: 1 mm in 10 m.
MOST_OFF = 1e-4


def scale_of(scan: Scan, place_m: NDArray[np.float64]) -> tuple[float | None, tuple[str, ...]]:
    """Return metres of the map per metre on the ellipsoid, and a warning if it is corrected.

    None if the projection is not known.
    """
    if not scan.crs:
        return None, ()
    factor = scale_factor(scan.crs, place_m / UNITS[scan.unit])
    if factor is None:
        return None, _missing(scan)
    off = factor - 1.0
    told = (
        f"the projection changes lengths by {1e6 * off:+.0f} ppm here: corrected, which changes "
        f"volumes by {100 * (factor**-2 - 1):+.3g} %"
    )
    return factor, (told,) if abs(off) > MOST_OFF else ()


def _missing(scan: Scan) -> tuple[str, ...]:
    told = (
        "the scale of its projection is not known, in UTM lengths are up to 0.1 % off: "
        "pip install divespot[crs]"
    )
    return (told,) if scan.projected and not is_installed("pyproj") else ()
