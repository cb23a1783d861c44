"""What callers pass, as the native kernels take it."""

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot.errors import DivespotError


def as_floats(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return `values` as an array, of native floats where it holds real numbers.

    float32 and float64 stay as they are, without a copy; other real numbers become float64. What
    a masked array masks becomes NaN. What else there is to say about it, the kernels say.
    """
    if isinstance(values, np.ma.MaskedArray):
        return _filled(name, values)
    try:
        array = np.asarray(values)
    except (ValueError, OverflowError) as error:
        raise DivespotError(f"{name} are no array of numbers: {error}") from None
    if array.dtype.kind in "iuf" and array.dtype not in (np.float32, np.float64):
        # Beyond the range of float64 lies infinity, which is dropped and counted.
        with np.errstate(over="ignore", invalid="ignore"):
            return array.astype(np.float64)
    return array


def _filled(name: str, values: np.ma.MaskedArray[Any, Any]) -> NDArray[Any]:
    if values.dtype.kind not in "iuf":
        raise DivespotError(f"{name} are masked {values.dtype}: real numbers are needed")
    single = values.dtype == np.float32
    floats: Any = values.astype(np.float32 if single else np.float64)
    return np.asarray(floats.filled(np.nan))


def number(name: str, value: float) -> float:
    """Return `value` as a float."""
    try:
        return math.copysign(math.fabs(value), value)
    except (TypeError, ValueError, OverflowError):
        raise DivespotError(f"{name} is {value!r}: a number is needed") from None


def whole(name: str, value: int) -> int:
    """Return `value` as a whole number that fits a machine word."""
    try:
        given = operator.index(value)
    except TypeError:
        given = -1
    if not 0 <= given < 2**63:
        raise DivespotError(f"{name} is {value!r}: a whole number of 0 or more is needed")
    return given
