"""One program in a process of its own, where its memory is its own too."""

from __future__ import annotations

import contextlib
import gc
import importlib
import multiprocessing
import os
import signal
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from contest.clouds import Cloud, Scales
    from contest.task import Task

#: A run that takes longer is given up.
LIMIT_S = 180.0
PROCESSES = multiprocessing.get_context("spawn")


class TooSlowError(Exception):
    """A run took longer than the limit."""


class Worker:
    """A process with a program and its input loaded, which runs when it is told to."""

    def __init__(self, function: str, cloud: Cloud) -> None:
        self.pipe, far_end = PROCESSES.Pipe()
        arguments = (far_end, function, cloud.path, cloud.scales)
        self.process = PROCESSES.Process(target=serve, args=arguments)
        self.process.start()
        far_end.close()
        self.pipe.recv()

    def run(self) -> tuple[float, float]:
        """Run once; return seconds and the peak of memory in MB above what was there before."""
        self.pipe.send("run")
        if not self.pipe.poll(LIMIT_S):
            raise TooSlowError
        return self.pipe.recv()

    def finish(self) -> Any:  # noqa: ANN401 - each kernel's own
        """Return the last run's answer and let the process end, and first those it started."""
        self.pipe.send("finish")
        answer = self.pipe.recv()
        self.process.join()
        return answer

    def kill(self) -> None:
        """End the process and those that it started, whatever they do."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGTERM)
        self.process.join()


def serve(pipe: Connection, function: str, path: Path, scales: Scales) -> None:
    """Load a program and its input, then do as told."""
    os.setpgrp()
    module, name = function.split(":")
    task = getattr(importlib.import_module(f"contest.{module}"), name)(np.load(path), scales)
    pipe.send("ready")
    result = None
    while pipe.recv() == "run":
        result = None  # its memory is not the next run's
        result, seconds, peak_mb = watched(task)
        pipe.send((seconds, peak_mb))
    pipe.send(task.answer(result))


def watched(task: Task) -> tuple[Any, float, float]:
    """Run a task under the clock and the memory's high-water mark.

    `ru_maxrss` would not do: a process inherits its parent's, and it never falls again.
    """
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")
    before_mb = memory_mb("VmRSS")
    start = time.perf_counter()
    result = task.run()
    seconds = time.perf_counter() - start
    return result, seconds, memory_mb("VmHWM") - before_mb


def memory_mb(field: str) -> float:
    """Read one of this process's sizes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(field)) / 1024.0
