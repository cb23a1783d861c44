"""Reading the next frame while the current one is processed."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

T = TypeVar("T")


def ahead(job: Callable[[int], T], numbers: Sequence[int], threads: int) -> Iterator[T]:
    """Run a job for each number in order; with several threads, one job ahead of the caller."""
    if threads == 1 or not numbers:
        yield from map(job, numbers)
        return
    with ThreadPoolExecutor(max_workers=1) as worker:
        waiting = worker.submit(job, numbers[0])
        for number in numbers[1:]:
            found = waiting.result()
            waiting = worker.submit(job, number)
            yield found
        yield waiting.result()
