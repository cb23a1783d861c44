"""The definition of an experiment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from divespot.reproduce.found import Found, Need, Round
    from divespot.reproduce.page import Section
    from divespot.reproduce.plan import Plan


def nothing(_plan: Plan) -> Sequence[Need]:
    """Return no scans."""
    return ()


def no_rounds(_plan: Plan) -> Sequence[Round]:
    """Return no rounds."""
    return ()


@dataclass(frozen=True)
class Experiment:
    """An experiment of the paper.

    Attributes
    ----------
    name
        Its key in the JSON.
    section
        Makes the experiment's section of the page from the results.
    needs
        The scans and settings that it needs.
    rounds
        Further rounds of its own.

    """

    name: str
    section: Callable[[Found, Plan], Section]
    needs: Callable[[Plan], Sequence[Need]] = nothing
    rounds: Callable[[Plan], Sequence[Round]] = no_rounds
