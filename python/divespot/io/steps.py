"""The steps to which coordinates were rounded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of rows examined: steps that fit these fit all rows, except with probability 2**-1000.
SAMPLE = 10_000

#: Decimal steps that are tried, the largest first.
DECIMAL = (1000.0, 100.0, 10.0, 1.0, 0.1, 0.01, 0.001, 0.0001)

#: Largest deviation of a multiple of a decimal step, by the rounding of float64.
ROUNDING = 4.0 * 2.0**-53

#: A warning is given if steps are wider than this share of the point spacing.
TOLD_SHARE = 0.25

#: Number of rows for the raster test, and the largest ratio of cells to points.
RASTER, HOLES = 2_000_000, 4


def steps(xyz: NDArray[Any], unit: str) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return the steps to which x, y and z were rounded, 0 if there is no rounding, and warnings.

    The step is the largest power of two or of ten of which all values are multiples, as rounding to
    float32, to integers or to millimetres leaves it. x and y of a raster are not rounded, although
    they are multiples of the cell width.
    """
    sample = np.asarray(xyz[:: max(len(xyz) // SAMPLE, 1)], dtype=np.float64)
    found = np.array([_step(column[np.isfinite(column)]) for column in sample.T])
    width, depth = (_extent(column) for column in sample.T[:2])
    apart = float(np.sqrt(width * depth / max(len(xyz), 1)))
    if (found[:2] > TOLD_SHARE * apart).any() and _is_raster(xyz):
        found[:2] = 0.0
    named = [
        f"{axis} in steps of {step:g} {unit}"
        for axis, step in zip("xyz", found.tolist(), strict=True)
        if step > TOLD_SHARE * apart > 0.0
    ]
    if not named:
        return found, ()
    return found, (f"its coordinates are rounded: {', '.join(named)}, {apart:.2g} {unit} apart",)


def _extent(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if len(known) else 0.0


def _is_raster(xyz: NDArray[Any]) -> bool:
    """Return whether each position has one point, on crossing lines along x and y."""
    plan = np.asarray(xyz[:RASTER, :2], dtype=np.float64)
    plan = plan[np.isfinite(plan).all(axis=1)]
    _, columns = np.unique(plan[:, 0], return_inverse=True)
    distinct, rows = np.unique(plan[:, 1], return_inverse=True)
    cells = (int(columns.max(initial=0)) + 1) * len(distinct)
    taken = len(np.unique(columns.astype(np.int64) * len(distinct) + rows))
    return taken > 0.99 * len(plan) and cells <= HOLES * len(plan)


def _step(values: NDArray[np.float64]) -> float:
    if len(values) < 2 or values.min() == values.max():
        return 0.0
    step = max(_binary(values), _decimal(values))
    # Far smaller steps are those of float64 itself.
    return step if step > 1e-6 * float(np.ptp(values)) else 0.0


def _binary(values: NDArray[np.float64]) -> float:
    """Return the largest power of two that divides all values."""
    mantissa, exponent = np.frexp(values[values != 0.0])
    whole = np.abs(np.ldexp(mantissa, 53)).astype(np.int64)
    lowest_bit = np.log2((whole & -whole).astype(np.float64))
    return float(np.ldexp(1.0, int((exponent - 53 + lowest_bit).min())))


def _decimal(values: NDArray[np.float64]) -> float:
    for step in DECIMAL:
        multiples = values / step
        off = np.abs(multiples - np.rint(multiples))
        allowed = ROUNDING * np.abs(multiples)
        if (off <= allowed).all() and (allowed < 0.01).all():
            return step
    return 0.0
