"""An evaluation as tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from divespot.cli.table import Table
from divespot.evaluate import Summary, goals
from divespot.evaluate.evaluation import GROUPS, THINNED_AREA_M2, has_points, kinds_of
from divespot.evaluate.goals import COMPRESSION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from divespot.evaluate import ErrorStatistics, Evaluation, Outcome


def tables_of(evaluation: Evaluation) -> Iterator[tuple[str, Table]]:
    """Yield a heading and a table for each part that the evaluation has."""
    if evaluation.whole:
        yield "Errors of the piles in %, by kind of scene", kinds_table(evaluation)
        if (remarks := remarks_table(evaluation)).row_count:
            yield "What went wrong", remarks
    if evaluation.paper:
        yield "`Settings()` beside `Settings.paper()`, in %", paper_table(evaluation)
    if evaluation.thinned:
        yield (
            "Errors of the paper's shapes in %, thinned (the goals are for those of 5.2 m²)",
            compression_table(evaluation),
        )
    if evaluation.real:
        yield "Real scans", real_table(evaluation)
    if found := goals(evaluation):
        table = Table(("goal", "wanted %", "is %", ""))
        for goal in found:
            table.add_row(goal.what, goal.wanted, _percent(goal.value), goal.verdict)
        yield "Goals", table


def kinds_table(evaluation: Evaluation) -> Table:
    """Return a row for each kind of scene, and one for all.

    right: scans, out of all, where every pile was found and there was no false pile; held: share
    of the piles whose truth lies within u95; u95: its median, as a share of the volume.
    """
    names = ("scene", "right", "piles", "mean", "largest", "bias", "held", "u95")
    table, grouped = Table(names), False
    for kind, summary in evaluation.summaries().items():
        if kind in GROUPS.values() and not grouped:
            table.add_section()
            grouped = True
        table.add_row(kind, *_counts(summary), *_figures(summary.piles))
    table.add_section()
    everything = Summary.of(evaluation.whole)
    table.add_row("all, each pile", *_counts(everything), *_figures(everything.piles))
    table.add_row("all, total", "", str(everything.total.count), *_figures(everything.total))
    return table


def paper_table(evaluation: Evaluation) -> Table:
    """Return a row for each kind of scene: the default's errors, then the paper's method's.

    The paper's method measures one object, which is compared with the largest pile of a scan. Its
    compensation factor, which corrects for the toe that it cuts off, is 1 here.
    """
    table = Table(("scene", "piles", "mean", "largest", "paper: piles", "mean", "largest"))
    for kind, summary in evaluation.summaries().items():
        paper = evaluation.paper_of_kind(kind)
        if not paper.piles.count:
            continue
        cells = [
            cell
            for errors in (summary.piles, paper.piles)
            for cell in (
                str(errors.count),
                _percent(errors.mean_error),
                _percent(errors.largest_error),
            )
        ]
        table.add_row(kind, *cells)
    return table


def remarks_table(evaluation: Evaluation) -> Table:
    """Return a row for each kind of failure in a kind of scene, with its count."""
    table = Table(("scene", "times", "what"), text=True)
    scenes = dict.fromkeys(kinds_of(one.scene)[0] for one in evaluation.whole)
    for kind in scenes:
        summary = Summary.of(evaluation.of_kind(kind))
        wrong = {
            "not measured: ": summary.failures,
            "a pile not found: ": summary.missed,
            "called a pile: ": summary.extras,
        }
        for what, names in wrong.items():
            for name, times in sorted(names.items()):
                table.add_row(kind, str(times), what + name)
    return table


def compression_table(evaluation: Evaluation) -> Table:
    """Return a row for each voxel edge, the paper's figures beside ours.

    The paper's are for the shapes of 5.2 m², to which the goals refer; all shapes follow for
    information.
    """
    names = ("m²", "voxel m", "kept", "mean", "largest", "held", "right", "paper kept", "paper %")
    table = Table(names)
    for name, counts in ((f"{THINNED_AREA_M2:g}", has_points), ("all", lambda _: True)):
        _compression_rows(table, name, evaluation, counts)
        table.add_section()
    return table


def _compression_rows(
    table: Table, name: str, evaluation: Evaluation, counts: Callable[[Outcome], bool]
) -> None:
    for row in COMPRESSION:
        outcomes = [one for one in evaluation.thinned_to(row.voxel_m) if counts(one)]
        if not outcomes:
            continue
        summary = Summary.of(outcomes)
        piles = summary.piles
        kept = sum(one.kept for one in outcomes) / len(outcomes)
        table.add_row(
            name,
            f"{row.voxel_m:g}",
            f"{kept:.4f}",
            *map(_percent, (piles.mean_error, piles.largest_error)),
            _percent(piles.coverage),
            f"{summary.right}/{summary.scans}",
            f"{row.paper_kept:.4f}",
            _percent(row.paper_error),
        )


def real_table(evaluation: Evaluation) -> Table:
    """Return a row for each pile of each real scan."""
    table = Table(("scan", "known m³", "measured", "u95", "error %", "remarks"), text=True)
    for one in evaluation.real:
        for row in _real_rows(one):
            table.add_row(*row)
    return table


def _real_rows(one: Outcome) -> Iterator[list[str]]:
    name = Path(one.scene).name
    for pile in one.piles:
        if pile.volume_m3 is None or pile.u95_m3 is None:
            why = one.failure or "nothing found"
            yield [name, f"{pile.truth_m3:.4g}", "-", "-", _percent(pile.error), why]
        else:
            yield [
                name,
                f"{pile.truth_m3:.4g}",
                f"{pile.volume_m3:.4g}",
                f"{pile.u95_m3:.2g}",
                _percent(pile.error),
                pile.instead or "",
            ]


def _counts(summary: Summary) -> list[str]:
    return [f"{summary.right}/{summary.scans}", str(summary.piles.count)]


def _figures(errors: ErrorStatistics) -> list[str]:
    shares = (
        errors.mean_error,
        errors.largest_error,
        errors.bias,
        errors.coverage,
        errors.median_u95,
    )
    return [*map(_percent, shares)]


def _percent(share: float | None) -> str:
    """Return a share in percent, with as many digits as fit in a column."""
    if share is None:
        return "-"
    return f"{100 * share:.{2 if abs(share) < 0.1 else 1 if abs(share) < 1.0 else 0}f}"
