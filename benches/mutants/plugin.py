"""A pytest run that learns what tests read, or that forks for each job: a mutant and its tests."""

from __future__ import annotations

import json
import os
import signal
import time
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pytest


def pytest_runtestloop(session: pytest.Session) -> bool:
    """Learn what each test reads, or run all jobs; write how each ended, one a line."""
    with Path(os.environ["DIVESPOT_ENDED"]).open("w") as ended:
        for outcome in learnt(session) if "DIVESPOT_LEARN" in os.environ else tried(session):
            ended.write(json.dumps(outcome) + "\n")
            ended.flush()
    return True


def learnt(session: pytest.Session) -> Iterator[dict[str, Any]]:
    """Run all tests here, one after the other, each with a file of its own for what it reads."""
    read = Path(os.environ["DIVESPOT_LEARN"])
    for i, (item, following) in enumerate(zip_longest(session.items, session.items[1:])):
        os.environ["DIVESPOT_READ"] = str(read / str(i))
        forget()
        start, failed = time.perf_counter(), session.testsfailed
        fails(item, following)
        passed, took_s = session.testsfailed == failed, time.perf_counter() - start
        lines = (read / str(i)).read_text().splitlines() if (read / str(i)).exists() else []
        yield {"test": item.nodeid, "passed": passed, "took_s": took_s, "read": lines}


def tried(session: pytest.Session) -> Iterator[dict[str, Any]]:
    """Run each job in a child, since a process keeps the mutant it began with."""
    items = {item.nodeid: item for item in session.items}
    for job in json.loads(Path(os.environ["DIVESPOT_JOBS"]).read_text()):
        passed = run([items[test] for test in job["tests"]], job["environment"], job["limit_s"])
        yield {"job": job["job"], "passed": passed}


def forget() -> None:
    """Let each constant be read and changed anew."""
    from divespot import _mutant  # noqa: PLC0415 - only the copy has it

    _mutant.forget()


def run(items: list[pytest.Item], environment: dict[str, str], limit_s: int) -> bool:
    """Run tests in a child until one fails; return whether none did, in time."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] == 0
    os.environ.update(environment)
    forget()  # the constants that were read while tests were collected
    signal.alarm(limit_s)
    failed = 1
    try:
        failed = any(fails(item, following) for item, following in zip_longest(items, items[1:]))
    finally:
        os._exit(int(failed))


def fails(item: pytest.Item, following: pytest.Item | None) -> bool:
    """Whether a test fails."""
    item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
    return bool(item.session.testsfailed)
