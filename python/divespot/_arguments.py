"""What callers pass, as the native kernels take it."""

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot.errors import DivespotError


def as_floats(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return `values` as an array, of native floats where it holds real numbers.

    float32 and float64 stay as they are, without a copy; other real numbers become float64.
    What else there is to say about it, the kernels say.
    """
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise DivespotError(f"{name} are no array of numbers: {error}") from None
    if array.dtype.kind in "iuf" and array.dtype not in (np.float32, np.float64):
        return array.astype(np.float64)
    return array


def number(name: str, value: float) -> float:
    """Return `value` as a float."""
    try:
        return math.copysign(math.fabs(value), value)
    except (TypeError, OverflowError):
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
