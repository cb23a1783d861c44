"""What an experiment is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from divespot.reproduce.found import Found, Need, Round
    from divespot.reproduce.page import Section
    from divespot.reproduce.plan import Plan


def nothing(_plan: Plan) -> Sequence[Need]:
    """Need no scans."""
    return ()


def no_rounds(_plan: Plan) -> Sequence[Round]:
    """Need no rounds of one's own."""
    return ()


@dataclass(frozen=True)
class Experiment:
    """An experiment of the paper.

    Attributes
    ----------
    name
        Its key in the JSON.
    section
        Makes its section of the page of what was found.
    needs
        The scans and settings that it looks at.
    rounds
        Further rounds of its own.

    """

    name: str
    section: Callable[[Found, Plan], Section]
    needs: Callable[[Plan], Sequence[Need]] = nothing
    rounds: Callable[[Plan], Sequence[Round]] = no_rounds
