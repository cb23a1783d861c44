"""Drawings of a report page: sections and budgets, as SVG."""

from __future__ import annotations

import math
import re
from datetime import datetime
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.plot import figure_class
from divespot.results.drawn_fill import filled
from divespot.results.plan import HATCH, INK, PAPER, PILE, draw_plan
from divespot.results.profile import profiles

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from divespot.report import Pile, Report
    from divespot.results.history import Past
    from divespot.results.profile import Profile
    from divespot.results.show_units import Shown

SAND, SEEN_NOT = "#e3b778", "#c0392b"

#: If there are more piles, only the largest have sections.
MOST_SECTIONS = 12

#: Largest vertical exaggeration of sections.
MOST_EXAGGERATED = 5.0

#: A colour for each term of the budget, in order; also distinguishable for the colour-blind.
TERMS = (*("#4477aa", "#66ccee", "#228833", "#ccbb44", "#ee6677", "#aa3377", "#bbbbbb", "#222255"),)


#: Text is kept as text, and equal drawings get equal ids.
_TEXT_IS_TEXT: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "divespot"}

#: Margins of the sections, as shares of their figure; fixed, since computing them takes longer.
_ROOM = {"left": 0.065, "right": 0.99, "top": 0.87, "bottom": 0.2, "wspace": 0.08}


def svg(figure: Figure) -> str:
    """Return a figure as SVG, starting with its root element."""
    from matplotlib import rc_context  # noqa: PLC0415 - an extra

    data = BytesIO()
    with rc_context(_TEXT_IS_TEXT):
        figure.savefig(data, format="svg", dpi=150, transparent=True, metadata={"Date": None})
    text = data.getvalue().decode()
    return text[text.index("<svg") :]


def plan_svg(report: Report) -> str:
    """Return the plan."""
    return svg(draw_plan(report, width_in=7.4))


def section_svgs(report: Report, texts: Mapping[str, str]) -> list[tuple[Pile, str]]:
    """Return the two sections through each of the largest piles."""
    level = report.level
    whole, base = filled(level.height_map.heights_m), filled(level.base_m)
    outlined = [outline for outline in level.outlines if outline.reason is None]
    pairs = list(zip(report.piles, outlined, strict=True))[:MOST_SECTIONS]
    return [
        (pile, svg(_sections(profiles(level, outline, whole, base), texts)))
        for pile, outline in pairs
        if outline.corners_m
    ]


def _sections(pair: tuple[Profile, Profile], texts: Mapping[str, str]) -> Figure:
    figure: Figure = figure_class()(figsize=(9.0, 2.3))
    left, right = figure.subplots(1, 2, sharey=True, gridspec_kw=_ROOM)
    span = max(profile.along_m[-1] for profile in pair)
    heights = np.concatenate([np.append(p.surface_m, p.base_m) for p in pair])
    tall = max(float(np.nanmax(heights) - np.nanmin(heights)), 1e-9)
    times = min(max(1.0, round(0.4 * span / tall)), MOST_EXAGGERATED)
    names = texts["along"], texts["across"]
    for axes, profile, name in zip((left, right), pair, names, strict=True):
        _section(axes, profile, texts)
        axes.set_aspect(times, adjustable="datalim")
        exaggerated = texts["exaggerated"].format(times=f"{times:g}")
        told = name if times == 1.0 else f"{name} ({exaggerated})"
        axes.set_title(told, fontsize=9, color=INK, loc="left")
    left.set_ylabel(texts["height_axis"], fontsize=8, color=INK)
    left.legend(fontsize=7, frameon=False, labelcolor=INK, loc="upper left")
    return figure


def _section(axes: Axes, profile: Profile, texts: Mapping[str, str]) -> None:
    along, surface, base = profile.along_m, profile.surface_m, profile.base_m
    axes.fill_between(along, base, surface, where=list(surface > base), color=SAND, linewidth=0)
    seen = np.where(profile.is_seen, surface, math.nan)
    if not profile.is_seen.all():
        label = texts["filled"]
        axes.plot(along, surface, color=SEEN_NOT, linewidth=1.2, linestyle=":", label=label)
    axes.plot(along, seen, color=PILE, linewidth=1.4, label=texts["surface"])
    axes.plot(along, base, color=INK, linewidth=1.1, linestyle="--", label=texts["base"])
    _plain(axes)
    axes.set_xlabel("m", fontsize=8, color=INK)


def _plain(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(HATCH)
    axes.tick_params(labelsize=7, colors=INK)


def history_svg(past: Sequence[Past], shown: Shown) -> str:
    """Return the total of each survey over time, with its u95."""
    figure: Figure = figure_class()(figsize=(9.0, 2.2), layout="constrained")
    draw_history(figure.subplots(), past, shown)
    return svg(figure)


def draw_history(axes: Axes, past: Sequence[Past], shown: Shown, label: str | None = None) -> None:
    """Draw volumes over time."""
    times = [datetime.fromisoformat(one.time) for one in past]
    volumes = [shown.per_m3 * one.volume_m3 for one in past]
    u95 = [shown.per_m3 * one.u95_m3 for one in past]
    look: dict[str, Any] = {"marker": "o", "markersize": 4, "capsize": 3, "label": label}
    color = PILE if label is None else None
    axes.errorbar(times, volumes, yerr=u95, color=color, **look)  # type: ignore[arg-type]
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _plain(axes)
    axes.set_ylabel(f"{shown.what} {shown.unit}", fontsize=8, color=INK)


def budget_svg(report: Report, names: Mapping[str, str], axis: str) -> str:
    """Return a bar chart of each pile's u95, split by source."""
    piles = report.piles[:MOST_SECTIONS]
    figure = figure_class()(figsize=(9.0, 0.9 + 0.32 * len(piles)), layout="constrained")
    axes = figure.subplots()
    left = np.zeros(len(piles))
    rows = range(len(piles))
    for (term, name), color in zip(names.items(), TERMS, strict=True):
        parts = np.array([_part(pile, term) for pile in piles])
        if parts.max(initial=0.0) > 0.0:
            axes.barh(rows, parts, left=left, color=color, height=0.62, label=name)
        left += parts
    axes.set_yticks(rows, [str(pile.id) for pile in piles])
    axes.invert_yaxis()
    _plain(axes)
    axes.set_xlabel(axis, fontsize=8, color=INK)
    above: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0, 1), "ncols": len(TERMS)}
    axes.legend(fontsize=7, frameon=False, labelcolor=INK, **above)
    return svg(figure)


def _part(pile: Pile, term: str) -> float:
    """Return a term's share of u95 in % of the volume, in proportion to its variance."""
    variance = sum(value * value for value in vars(pile.budget).values())
    share = getattr(pile.budget, term) ** 2 / variance if variance else 0.0
    return 100.0 * share * pile.u95_m3 / abs(pile.volume_m3) if pile.volume_m3 else 0.0


#: Colours of drawings that follow the page's theme.
THEMED = {INK: "ink", HATCH: "line", PAPER: "paper"}


def themed(drawing: str) -> str:
    """Return a drawing whose ink and lines have the page's colours."""
    pattern = re.compile("|".join(THEMED))
    return pattern.sub(lambda found: f"var(--{THEMED[found[0]]})", drawing)


def numbered(drawing: str, number: int) -> str:
    """Return a drawing whose ids differ from those of other drawings on the page."""
    ids = re.sub(r'\bid="([^"]+)"', rf'id="d{number}-\1"', drawing)
    links = re.sub(r'href="#([^"]+)"', rf'href="#d{number}-\1"', ids)
    return re.sub(r"url\(#([^)]+)\)", rf"url(#d{number}-\1)", links)
