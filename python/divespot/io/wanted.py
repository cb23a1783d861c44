"""What to read of a file: columns of a table, classes and returns of a LAS file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from divespot._arguments import shown
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Place: TypeAlias = tuple[float, float]
    Rectangle: TypeAlias = tuple[float, float, float, float]
    #: From a file's reference system and a place in it to a rectangle in its numbers.
    Plan: TypeAlias = Callable[[str | None, Place], Rectangle | None]

#: Classes of low and high noise (LAS 1.4 R15, table 17).
NOISE = frozenset({7, 18})


@dataclass(frozen=True)
class Wanted:
    """Which columns of a table, which classes and returns of a LAS file.

    Attributes
    ----------
    columns
        Columns of x, y and z: numbers from 1, or names in the header. None: found from the table.
    classes
        The classes to keep. None: all except noise.
    returns
        Which returns of a pulse to keep.
    crs
        The reference system, for a file that states none.
    plan
        Tells the rectangle outside of which no point is wanted.
    some
        Whether a sample of the points is enough.
    stretches
        Number of stretches of the sample, with points of any class; None: enough to represent the
        file, with points of the wanted classes.

    """

    columns: tuple[str, ...] | None = None
    classes: frozenset[int] | None = None
    returns: Literal["all", "first", "last"] = "all"
    crs: str | None = None
    plan: Plan | None = None
    some: bool = False
    stretches: int | None = None

    @classmethod
    def of(
        cls,
        columns: str | None,
        classes: str | None,
        returns: str,
        crs: str | None = None,
        plan: Sequence[float] | Plan | None = None,
    ) -> Wanted:
        """Return the choice that the texts describe.

        Raises
        ------
        DivespotError
            A text is invalid.

        """
        if not isinstance(returns, str) or returns not in {"all", "first", "last"}:
            raise DivespotError(f"returns is {returns!r}: one of all, first, last is needed")
        for name, value in (("columns", columns), ("classes", classes), ("crs", crs)):
            if not isinstance(value, str | None):
                raise DivespotError(f"{name} is a {type(value).__name__}: a text is needed")
        parts = None if columns is None else tuple(map(str.strip, columns.split(",")))
        if parts is not None and (len(parts) != 3 or not all(parts)):
            raise DivespotError(
                f"columns is {columns!r}: three numbers from 1 or names, as 3,2,4, are needed"
            )
        checked = plan if callable(plan) else _fixed(plan)
        return cls(parts, _numbers(classes), returns, crs, checked)  # type: ignore[arg-type]  # checked above

    def refuse_columns(self) -> None:
        """Raise DivespotError if columns were asked for, of a file that is no table of text."""
        if self.columns is not None:
            given = ",".join(self.columns)
            raise DivespotError(f"it is no table of text with columns {given}: one is needed")

    def rectangle(
        self, crs: str | None, low: Sequence[float], high: Sequence[float]
    ) -> Rectangle | None:
        """Return x0, y0, x1, y1 in the numbers of a file that lies between two corners, if any."""
        if self.plan is None:
            return None
        return self.plan(crs or self.crs, (0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])))


def _fixed(plan: Sequence[float] | None) -> Plan | None:
    if plan is None:
        return None
    try:
        x0, y0, x1, y1 = map(float, plan)
    except (TypeError, ValueError, OverflowError):
        x0 = y0 = x1 = y1 = math.nan
    if not all(map(math.isfinite, (x0, y0, x1, y1))):
        raise DivespotError(f"plan is {shown(plan)}: four numbers x0,y0,x1,y1 are needed")
    return lambda _crs, _at: (x0, y0, x1, y1)


def _numbers(classes: str | None) -> frozenset[int] | None:
    if classes is None:
        return None
    words = [word.strip() for word in classes.split(",")]
    if not all(word.isascii() and word.isdecimal() and len(word) <= 3 for word in words):
        raise DivespotError(f"classes is {classes!r}: numbers from 0 to 255, as 2,6, are needed")
    return frozenset(map(int, words))
