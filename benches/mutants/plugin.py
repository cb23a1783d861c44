"""A pytest run that forks after collection: for each job a child with its environment and tests."""

from __future__ import annotations

import json
import os
import signal
import time
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest


def pytest_runtestloop(session: pytest.Session) -> bool:
    """Run all jobs, and write how each ended, one a line."""
    jobs = json.loads(Path(os.environ["DIVESPOT_JOBS"]).read_text())
    items = {item.nodeid: item for item in session.items}
    with Path(os.environ["DIVESPOT_ENDED"]).open("w") as ended:
        for job in jobs:
            start = time.perf_counter()
            passed = run([items[test] for test in job["tests"]], job["environment"], job["limit_s"])
            took_s = time.perf_counter() - start
            ended.write(json.dumps({"passed": passed, "took_s": took_s}) + "\n")
            ended.flush()
    return True


def run(items: list[pytest.Item], environment: dict[str, str], limit_s: int) -> bool:
    """Run tests in a child until one fails; return whether none did, in time."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] == 0
    os.environ.update(environment)
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
