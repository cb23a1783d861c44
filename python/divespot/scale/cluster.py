"""Adding up a survey of many tiles with the workers of a Dask cluster."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from divespot import pipeline
from divespot.cores import cores
from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.io.merge import paths_of
from divespot.one_pass import Part
from divespot.progress import Progress
from divespot.settings import as_settings
from divespot.streaming import planned, scan_of

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from typing_extensions import Unpack

    from divespot._typed import Changes
    from divespot.blocks import At, Blocks
    from divespot.doors import Report
    from divespot.io import Scan
    from divespot.io.las_stretches import Stretch
    from divespot.one_pass import Pass
    from divespot.settings import Settings

#: Most points of a task: a second of work, which is repeated if a worker dies. With smaller tasks,
#: a thousand workers would wait for the scheduler. Each core should get at least some tasks.
TASK_POINTS, TASKS_A_CORE = 4_000_000, 8

#: Number of parts merged by one task: a tree of few levels, with few parts in memory at once.
MERGED = 8


def measure(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    client: Any | None = None,  # noqa: ANN401 - distributed ships no types
    settings: Settings | Mapping[str, Any] | None = None,
    *,
    skip_damaged: bool = False,
    on_stage: Callable[[str], None] | None = None,
    **changes: Unpack[Changes],
) -> Report:
    """Measure LAS or LAZ files that are one survey, of any size, on many machines.

    The workers read the files, which all of them must see at the same paths, and add their points
    up in voxels; the result is measured on this machine. The report is the same, bit for bit, for
    any number of workers, even if some of them die.

    Parameters
    ----------
    paths
        The files.
    client
        A ``distributed.Client``; None: as many processes on this machine as there are cores, for
        the duration of the call (a script then needs its ``if __name__ == "__main__"``).
    settings
        As for `divespot.measure`.
    skip_damaged
        Whether to leave out unreadable files or parts, with a warning for each file.
    on_stage
        Called with the name of each stage as it begins, and with how much was read.
    **changes
        As for `divespot.measure`.

    Raises
    ------
    DivespotError
        As for `divespot.measure`; a file is not a LAS file, or distributed is missing
        (``pip install divespot[dask]``).

    """
    chosen = as_settings(settings, **changes)
    run = Progress(on_stage)
    with _client_or_own(client) as working:
        scan = run("read", _read, working, paths_of(paths), chosen, skip_damaged, on_stage)
    report = pipeline.measure(scan, chosen, on_stage=on_stage)
    read_s = run.timings_s["read"] + report.timings_s["read"]
    return replace(report, timings_s={**report.timings_s, "read": read_s})


@contextmanager
def _client_or_own(client: Any | None) -> Iterator[Any]:  # noqa: ANN401 - as above
    """Yield the given client, or one of a cluster on this machine."""
    if client is not None:
        yield client
        return
    distributed = _distributed()
    with (
        distributed.LocalCluster(
            n_workers=cores(), threads_per_worker=1, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as own,
    ):
        yield own


def connected(address: str, timeout_s: float = 10.0) -> Any:  # noqa: ANN401 - as above
    """Return a client of the scheduler at an address.

    Raises
    ------
    DivespotError
        No scheduler answers.

    """
    try:
        return _distributed().Client(address, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError, TypeError) as err:
        raise DivespotError(
            f"{address}: nothing answers there ({err}): a Dask scheduler is needed"
        ) from None


def _distributed() -> Any:  # noqa: ANN401 - as above
    return extra("distributed", "dask", "many machines need Dask's distributed")


def _read(
    client: Any,  # noqa: ANN401 - as above
    paths: list[str],
    settings: Settings,
    skip_damaged: bool,  # noqa: FBT001 - passed on
    on_stage: Callable[[str], None] | None,
) -> Scan:
    plan = planned(paths, settings, skip_damaged=skip_damaged)
    blocks = plan.way.blocks()
    groups = _tasks(plan.stretches, sum(client.ncores().values()))
    both = [client.submit(_add_up, plan.way, group, pure=False) for group in groups]
    tasks, fine = (
        [client.submit(itemgetter(which), pair, pure=False) for pair in both] for which in (0, 1)
    )
    del both
    _keep(client, fine, blocks, on_stage)
    while len(tasks) > 1:
        together = [tasks[first : first + MERGED] for first in range(0, len(tasks), MERGED)]
        tasks = [client.submit(_merge_up, some, pure=False) for some in together]
    return scan_of(plan, tasks[0].result(), blocks)


def _tasks(stretches: Sequence[Stretch], workers: int) -> list[list[Stretch]]:
    """Return stretches in groups of about equally many points."""
    points = sum(stretch.count for stretch in stretches)
    most = min(TASK_POINTS, points // (TASKS_A_CORE * max(workers, 1)))
    tasks: list[list[Stretch]] = [[]]
    held = 0
    for stretch in stretches:
        if held and held >= most:
            tasks.append([])
            held = 0
        tasks[-1].append(stretch)
        held += stretch.count
    return tasks


def _keep(
    client: Any,  # noqa: ANN401 - as above
    tasks: list[Any],
    blocks: Blocks | None,
    on_stage: Callable[[str], None] | None,
) -> None:
    """Keep the fine voxels of each task, and tell how many are done; why, if one failed."""
    count = len(tasks)
    waiting = _distributed().as_completed(tasks, loop=client.loop)
    tasks.clear()  # what was kept here, the workers may forget
    for done, task in enumerate(waiting, 1):
        pieces = task.result()
        if blocks is not None:
            blocks.put(pieces)
        if on_stage is not None:
            on_stage(f"read, {done} of {count} parts")


def _add_up(way: Pass, stretches: Sequence[Stretch]) -> tuple[Part, list[tuple[At, bytes]]]:
    """Add some stretches up, in coarse voxels and in fine ones: the work of one task."""
    part, pieces = way.nothing(), list[tuple["At", bytes]]()
    for stretch in stretches:
        records = way.records_of(stretch, part)
        if records is not None:
            way.take(records, stretch.layout, part)
            pieces += way.fine(records, stretch.layout)
    return part, pieces


def _merge_up(parts: Sequence[Part]) -> Part:
    """Merge parts without changing them, since a task may be repeated."""
    merged = Part(parts[0].voxels.empty())
    for part in parts:
        merged.merge(part)
    return merged
