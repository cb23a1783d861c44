"""Arguments of callers, checked and converted for the native kernels."""

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot.errors import DivespotError, shortened

#: Most threads that may be asked for: above any machine's cores; each thread takes a stack.
MOST_THREADS = 1024


def as_floats(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return `values` as an array, of native floats if it holds real numbers.

    float32 and float64 are not copied; other real numbers become float64. Masked values of a masked
    array become NaN. All further checks are those of the kernels.
    """
    if isinstance(values, np.ma.MaskedArray):
        return _filled(name, values)
    try:
        array = np.asarray(values)
    except (ValueError, OverflowError) as error:
        raise DivespotError(f"{name} are no array ({error}): real numbers are needed") from None
    if array.dtype.kind not in "iuf":
        raise DivespotError(
            f"{name} have shape {array.shape} and dtype {array.dtype}: real numbers are needed"
        )
    if array.dtype not in (np.float32, np.float64):
        # Values beyond the range of float64 become infinite; such points are dropped and counted.
        with np.errstate(over="ignore", invalid="ignore"):
            return array.astype(np.float64)
    return array


def _filled(name: str, values: np.ma.MaskedArray[Any, Any]) -> NDArray[Any]:
    if values.dtype.kind not in "iuf":
        raise DivespotError(f"{name} are masked {values.dtype}: real numbers are needed")
    single = values.dtype == np.float32
    floats: Any = values.astype(np.float32 if single else np.float64)
    return np.asarray(floats.filled(np.nan))


def flags(name: str, values: ArrayLike) -> NDArray[np.bool_]:
    """Return truth values, or zeros and ones, as a flat array; masked values become False."""
    try:
        array = np.asarray(np.ma.filled(values, 0)).ravel()
    except (ValueError, OverflowError) as error:
        raise DivespotError(
            f"{name} is no array ({error}): True or False for each is needed"
        ) from None
    if array.dtype.kind not in "biu" or not np.isin(array, (0, 1)).all():
        raise DivespotError(f"{name} has dtype {array.dtype}: True or False for each is needed")
    return array.astype(np.bool_)


def require_kind(name: str, value: object, kind: type) -> None:
    """Raise TypeError unless a value is of a kind."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} is {shown(value)}: a divespot.{kind.__name__} is needed")


def number(name: str, value: float) -> float:
    """Return `value` as a float."""
    try:
        return math.copysign(math.fabs(value), value)
    except (TypeError, ValueError, OverflowError):
        raise DivespotError(f"{name} is {shown(value)}: a number is needed") from None


def whole(name: str, value: int, most: int = 2**63 - 1) -> int:
    """Return `value` as a whole number from 0 to `most`, which fits a machine word."""
    try:
        given = operator.index(value)
    except TypeError:
        given = -1
    if not 0 <= given <= most:
        upper = "of 0 or more" if most >= 2**63 - 1 else f"from 0 to {most}"
        raise DivespotError(f"{name} is {shown(value)}: a whole number {upper} is needed")
    return given


def thread_number(value: int) -> int:
    """Return the setting ``threads``, 0 for every core."""
    return whole("threads", value, MOST_THREADS)


def seed_number(value: int) -> int:
    """Return the setting ``seed``."""
    return whole("seed", value, 2**64 - 1)


def switch(name: str, value: bool) -> bool:  # noqa: FBT001 - the value of an option
    """Return `value` as True or False."""
    if not isinstance(value, bool | np.bool_):
        raise DivespotError(f"{name} is {shown(value)}: True or False is needed")
    return bool(value)


def word(name: str, value: str) -> str:
    """Return `value` as a text that can be encoded."""
    if not isinstance(value, str) or not value.isprintable():
        raise DivespotError(f"{name} is {shown(value)}: a text is needed")
    return value


def shown(value: object) -> str:
    """Return the repr of a value, shortened if it is long."""
    try:
        return shortened(repr(value), 100)
    except Exception:  # noqa: BLE001 - repr may do anything, as for int beyond 4,300 digits
        return f"no {type(value).__name__} that can be written"
