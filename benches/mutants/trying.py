"""Which tests read a constant, and which mutants they notice."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from mutants.building import COPY, ENVIRONMENT, PLACE, UNIT_TESTS, chosen
from mutants.idle import signs

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

#: A mutant that takes longer is noticed; longer tests are not run, nor more of them for a mutant.
LIMIT_S, LONGEST_S, TOGETHER_S = 120, 20.0, 8.0
PROCESSES = os.cpu_count() or 1
outcome_of = itemgetter("test", "passed", "took_s", "read")
#: Test files that say nothing of answers, or take long to.
LEFT_OUT = (
    *("packaging", "wheels", "readme", "layers", "examples", "interrupt", "memory", "io_web"),
    *("recordings", "recordings_kinect", "reproduce", "evaluate", "ablation", "real_scans"),
    *("rounds", "simulate", "simulate_families", "simulate_scenes", "simulate_solids"),
)


@dataclass
class Learnt:
    """The tests that read each constant, and how long a test takes."""

    readers: dict[str, list[str]]
    took_s: dict[str, float]

    def of_core(self, name: str) -> list[str]:
        """Return the core's unit tests that read a constant."""
        return [test for test in self.readers.get(name, ()) if ".py" not in test]

    def of_package(self, name: str) -> list[str]:
        """Return the quickest tests of the package that do."""
        tests = (test for test in self.readers.get(name, ()) if ".py" in test)
        total_s, found = 0.0, []
        for test in sorted(tests, key=self.took_s.__getitem__):
            total_s += self.took_s[test]
            if total_s < TOGETHER_S:
                found.append(test)
        return found


def learn(names: list[str], *, unit: bool) -> Learnt:
    """Run each test, and keep what it reads."""
    read = PLACE / "read"
    shutil.rmtree(read, ignore_errors=True)
    read.mkdir()
    outcomes = list(core_outcomes(read))
    if not unit:
        ended = PLACE / "ended.json"
        run = pytest(
            package_files(),
            *("-p", "mutants.plugin"),
            DIVESPOT_LEARN=str(read),
            DIVESPOT_ENDED=str(ended),
        )
        outcomes += lines_of(ended)
        if run.returncode not in (0, 1):
            raise SystemExit(run.stdout + run.stderr)
    learnt = Learnt(defaultdict(list), {})
    for test, passed, took_s, lines in map(outcome_of, outcomes):
        if not passed or took_s > LONGEST_S:
            print(f"{'too long' if passed else 'fails unchanged'}: {test} ({took_s:.1f} s)")
            continue
        learnt.took_s[test] = took_s
        for line in lines:
            learnt.readers[names[int(line)] if line.isdigit() else line].append(test)
    return learnt


def core_outcomes(read: Path) -> Iterator[dict[str, Any]]:
    """Run each unit test of the core in a process of its own; yield what it reads."""
    listed = subprocess.check_output([UNIT_TESTS, "--list", "--format=terse"], text=True)
    tests = [line.removesuffix(": test") for line in listed.splitlines() if line.endswith(": test")]
    for i, test in enumerate(tests):
        file = read / f"core-{i}"
        passed, took_s = run_core([test], {"DIVESPOT_READ": str(file)})
        lines = file.read_text().splitlines() if file.exists() else []
        yield {"test": test, "passed": passed, "took_s": took_s, "read": lines}


def package_files() -> list[str]:
    """Return the test files of the package."""
    files = [path.name for path in sorted((COPY / "tests").glob("test_*.py"))]
    return [name for name in files if name[len("test_") : -len(".py")] not in LEFT_OUT]


def survivors(wanted: list[str], names: list[str], learnt: Learnt) -> list[str]:
    """Return the mutants that no test notices: "piles/budget.rs COMMON * 2"."""
    left = []
    for name, sign in [(each, sign) for each in wanted for sign in signs(each)]:
        environment = {"DIVESPOT_MUTANT": chosen(name, sign, names)}
        if run_core(learnt.of_core(name), environment)[0]:
            left.append((name, sign, environment))
            print("no unit test notices", name, sign, "2", flush=True)
    ended = run_package([(learnt.of_package(name), environment) for name, _, environment in left])
    return [
        f"{name} {sign} 2{'' if name in learnt.readers else ' (no test reads it)'}"
        for (name, sign, _), passed in zip(left, ended, strict=True)
        if passed
    ]


def run_core(tests: list[str], environment: dict[str, str]) -> tuple[bool, float]:
    """Whether unit tests of the core pass, in time; and how long they took."""
    if not tests:
        return True, 0.0
    start = time.perf_counter()
    command = [UNIT_TESTS, "--exact", *tests]
    try:
        run = subprocess.run(
            command,
            env=ENVIRONMENT | environment,
            capture_output=True,
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, LIMIT_S
    return run.returncode == 0, time.perf_counter() - start


def run_package(jobs: list[tuple[list[str], dict[str, str]]]) -> list[bool]:
    """Return of each job, tests and an environment, whether they passed."""
    numbered = [
        {"job": i, "tests": tests, "environment": environment, "limit_s": LIMIT_S}
        for i, (tests, environment) in enumerate(jobs)
        if tests
    ]
    parts = [numbered[i::PROCESSES] for i in range(PROCESSES)]
    with ThreadPoolExecutor(PROCESSES) as pool:
        ended = list(pool.map(run_part, range(PROCESSES), parts))
    passed = {job["job"]: job["passed"] for part in ended for job in part}
    return [passed.get(i, True) for i in range(len(jobs))]


def run_part(number: int, jobs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Run some jobs, one after the other."""
    if not jobs:
        return []
    files = sorted({t.split("::")[0].removeprefix("tests/") for job in jobs for t in job["tests"]})
    given, ended = PLACE / f"jobs-{number}.json", PLACE / f"ended-{number}.json"
    given.write_text(json.dumps(jobs))
    run = pytest(files, "-p", "mutants.plugin", DIVESPOT_JOBS=str(given), DIVESPOT_ENDED=str(ended))
    found = lines_of(ended)
    if len(found) < len(jobs):
        raise SystemExit(run.stdout + run.stderr)
    return found


def lines_of(ended: Path) -> list[dict[str, Any]]:
    """Return what the plugin wrote."""
    return [json.loads(line) for line in ended.read_text().splitlines()]


def pytest(files: list[str], *options: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run pytest on test files of the copy."""
    command = [sys.executable, "-m", "pytest", *(f"tests/{name}" for name in files), *options]
    return subprocess.run(
        command,
        cwd=COPY,
        env=ENVIRONMENT | environment,
        capture_output=True,
        text=True,
        check=False,
    )
