"""The time and the warnings of each stage."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from divespot.log import log

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")
T = TypeVar("T")


class Progress:
    """Runs stages, times them and collects their warnings."""

    def __init__(self, on_stage: Callable[[str], None] | None) -> None:
        self._on_stage = on_stage
        self.timings_s: dict[str, float] = {}
        self.warnings: list[str] = []

    def __call__(self, name: str, stage: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run one stage."""
        self.tell(name)
        start = time.perf_counter()
        result = stage(*args, **kwargs)
        self.timings_s[name] = time.perf_counter() - start
        log("INFO", f"{name}: {1e3 * self.timings_s[name]:.1f} ms")
        return result

    def tell(self, name: str) -> None:
        """Tell how far a measurement is."""
        if self._on_stage is not None:
            self._on_stage(name)

    def warn(self, text: str) -> None:
        """Keep a warning for the report."""
        self.warnings.append(text)

    @staticmethod
    def told(*warnings: str) -> tuple[str, ...]:
        """Log all warnings of a report and return them."""
        for warning in warnings:
            log("WARNING", warning)
        return warnings
