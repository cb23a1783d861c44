"""Rounds of an experiment: in parallel, in a fixed order, kept on disk, safe to interrupt.

A round is a frozen dataclass of plain values; its result is a function of these alone, and so
independent of the number of processes and of interruptions.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import divespot
from divespot._arguments import whole
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

Json = dict[str, Any]
R = TypeVar("R")

#: Name of the file, in the given folder, in which finished rounds are kept.
KEPT = "rounds.jsonl"

#: Most processes that may be asked for: above any machine's cores.
MOST_JOBS = 1024


def run_rounds(
    work: Callable[[R], Json],
    rounds: Sequence[R],
    *,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    on_done: Callable[[], None] | None = None,
) -> list[Json]:
    """Do the work of each round, and return the results in the order of the rounds.

    Parameters
    ----------
    work
        A function at the top level of a module, from a round to plain JSON values.
    rounds
        Frozen dataclasses of plain values, no two alike.
    jobs
        Number of processes. If more than one, they are spawned, so a calling script must guard
        its code with ``if __name__ == "__main__"``.
    folder
        Where finished rounds are kept, one per line. They are reused if the same rounds are run
        again by the same build of divespot.
    on_done
        Called for each round that is finished now or was before.

    Raises
    ------
    DivespotError
        `jobs` is 0, the folder cannot be used, or a process was killed.

    """
    if whole("jobs", jobs, MOST_JOBS) < 1:
        raise DivespotError(f"jobs is {jobs}: a whole number of 1 or more is needed")
    shelf = _Shelf(work, folder)
    results = {i: done for i, one in enumerate(rounds) if (done := shelf.get(one)) is not None}
    missing = {i: one for i, one in enumerate(rounds) if i not in results}
    for _ in results:
        _tell(on_done)
    for i, result in _carry_out(work, missing, min(jobs, max(len(missing), 1))):
        shelf.put(rounds[i], result)
        results[i] = result
        _tell(on_done)
    return [results[i] for i in range(len(rounds))]


def _tell(on_done: Callable[[], None] | None) -> None:
    if on_done is not None:
        on_done()


def _carry_out(
    work: Callable[[R], Json], rounds: dict[int, R], jobs: int
) -> Iterator[tuple[int, Json]]:
    """Yield the number and the result of each round as it is finished."""
    if jobs == 1:
        yield from ((i, work(one)) for i, one in rounds.items())
        return
    # Spawned, not forked: a fork would inherit locked threads of NumPy and of the core.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, context, _serve)
    try:
        futures = {pool.submit(work, one): i for i, one in rounds.items()}
        yield from ((futures[future], future.result()) for future in as_completed(futures))
    except BrokenProcessPool:
        raise DivespotError(
            f"one of {jobs} processes was killed, maybe for want of memory: fewer jobs are needed"
        ) from None
    finally:
        pool.shutdown(cancel_futures=True)


def _serve() -> None:
    """Ignore Ctrl-C, so that running rounds finish; end when the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        # The parent is gone; a worker waiting for the next round would wait forever.
        os._exit(1)


class _Shelf:
    """Finished rounds in a file, found by work, build and round."""

    def __init__(self, work: Callable[..., Json], folder: str | os.PathLike[str] | None) -> None:
        self._path = None if folder is None else Path(folder) / KEPT
        self._name = f"{work.__module__}.{work.__qualname__}"
        self._kept: dict[str, Json] = {}
        if self._path is not None:
            try:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                self._kept = dict(_lines(self._path))
            except (OSError, ValueError) as error:
                raise DivespotError(
                    f"{folder}: rounds cannot be kept there ({error}): another folder is needed"
                ) from None

    def get(self, one: Any) -> Json | None:  # noqa: ANN401 - any dataclass
        """Return the kept result of a round."""
        return self._kept.get(self._key(one)) if self._path is not None else None

    def put(self, one: Any, result: Json) -> None:  # noqa: ANN401 - as above
        """Keep the result of a round."""
        if self._path is None:
            return
        with self._path.open("a", encoding="utf-8") as file:
            # If a round was cut off within its line, start a new line.
            file.write(f"\n{json.dumps({'round': self._key(one), 'result': result})}\n")

    def _key(self, one: Any) -> str:  # noqa: ANN401 - as above
        described = {"work": self._name, "build": build(), **dataclasses.asdict(one)}
        return json.dumps(described, sort_keys=True)


def _lines(path: Path) -> Iterator[tuple[str, Json]]:
    if path.exists():
        lines = path.read_text(encoding="utf-8").splitlines()
        yield from (kept for line in lines if (kept := _line(line)) is not None)


def _line(line: str) -> tuple[str, Json] | None:
    """Return a round and its result; None if the line is empty, or cut off by an interruption."""
    try:
        kept = json.loads(line)
        return kept["round"], kept["result"]
    except (ValueError, TypeError, KeyError):
        return None


@functools.cache
def build() -> str:
    """Return a hash of all code of this build, since other builds may give other results."""
    package = Path(divespot.__file__).parent
    digest = hashlib.blake2b(digest_size=8)
    for path in sorted([*package.rglob("*.py"), *package.glob("_native*")]):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()
