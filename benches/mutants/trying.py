"""Which tests read a constant, and which mutants they notice."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mutants.building import COPY, ENVIRONMENT, PLACE, UNIT_TESTS, chosen
from mutants.idle import signs

if TYPE_CHECKING:
    from collections.abc import Iterator

#: A mutant that takes longer is noticed; longer tests are not run, nor more of them for a mutant.
LIMIT_S, LONGEST_S, TOGETHER_S = 60, 20.0, 25.0
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
    """Run each test on its own, and keep what it reads."""
    listed = subprocess.check_output([UNIT_TESTS, "--list", "--format=terse"], text=True)
    core = [line.removesuffix(": test") for line in listed.splitlines() if line.endswith(": test")]
    package = [] if unit else package_tests()
    read = PLACE / "read"
    shutil.rmtree(read, ignore_errors=True)
    read.mkdir()
    given = [{"DIVESPOT_READ": str(read / str(i))} for i in range(len(core) + len(package))]
    ended = [run_core([test], here) for test, here in zip(core, given, strict=False)]
    ended += run_package([([t], here) for t, here in zip(package, given[len(core) :], strict=True)])
    learnt = Learnt(defaultdict(list), {})
    for i, (test, (passed, took_s)) in enumerate(zip([*core, *package], ended, strict=True)):
        if not passed or took_s > LONGEST_S:
            print(f"{'too long' if passed else 'fails unchanged'}: {test} ({took_s:.1f} s)")
            continue
        learnt.took_s[test] = took_s
        lines = (read / str(i)).read_text().splitlines() if (read / str(i)).exists() else ()
        for line in lines:
            learnt.readers[names[int(line)] if line.isdigit() else line].append(test)
    return learnt


def package_tests() -> list[str]:
    """Return the tests of the package."""
    files = [path.name for path in sorted((COPY / "tests").glob("test_*.py"))]
    wanted = [name for name in files if name[len("test_") : -len(".py")] not in LEFT_OUT]
    return [line for line in pytest(wanted, "--collect-only").stdout.splitlines() if "::" in line]


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
        for (name, sign, _), (passed, _) in zip(left, ended, strict=True)
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


def run_package(jobs: list[tuple[list[str], dict[str, str]]]) -> list[tuple[bool, float]]:
    """Return of each job, tests and an environment, whether they passed and how long they took."""
    files = sorted(
        {test.split("::")[0].removeprefix("tests/") for tests, _ in jobs for test in tests}
    )
    if not files:
        return [(True, 0.0) for _ in jobs]
    given, ended = PLACE / "jobs.json", PLACE / "ended.json"
    given.write_text(
        json.dumps([{"tests": t, "environment": e, "limit_s": LIMIT_S} for t, e in jobs])
    )
    run = pytest(files, "-p", "mutants.plugin", DIVESPOT_JOBS=str(given), DIVESPOT_ENDED=str(ended))
    found = list(passed_in(ended))
    if len(found) < len(jobs):
        raise SystemExit(run.stdout + run.stderr)
    return found


def passed_in(ended: Any) -> Iterator[tuple[bool, float]]:  # noqa: ANN401
    """Yield what the plugin wrote."""
    for line in ended.read_text().splitlines():
        job = json.loads(line)
        yield job["passed"], job["took_s"]


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
