"""Options of surveys that are added up on a cluster."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from divespot.report import Report
    from divespot.settings import Settings

F = TypeVar("F", bound="Callable[..., Any]")


def cluster_options(command: F) -> F:
    """Add the options of a Dask cluster."""
    options = (
        click.option(
            "--scheduler",
            metavar="ADDRESS",
            help="measure all SCANs (LAS or LAZ) as one survey of any size, added up by the "
            "workers of a Dask cluster, as tcp://10.0.0.1:8786; each worker must see the files "
            "(extra dask)",
        ),
        click.option(
            "--skip-damaged",
            is_flag=True,
            help="with --scheduler: leave out unreadable files, with a warning for each",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


@dataclass(frozen=True)
class Cluster:
    """The address of a cluster, and whether damaged files are skipped."""

    address: str
    skip_damaged: bool

    @classmethod
    def of(cls, ctx: click.Context) -> Cluster | None:
        """Return the options' values; None if no cluster was given.

        Raises
        ------
        UsageError
            --skip-damaged was given without --scheduler.

        """
        address, skip_damaged = ctx.params["scheduler"], ctx.params["skip_damaged"]
        if address is not None:
            return cls(address, skip_damaged)
        if skip_damaged:
            raise click.UsageError("--skip-damaged was given: --scheduler is needed with it", ctx)
        return None

    def measured(
        self, paths: Sequence[str], settings: Settings, on_stage: Callable[[str], None] | None
    ) -> Report:
        """Measure files as one survey."""
        from divespot.scale.cluster import connected, measure  # noqa: PLC0415 - slow to import

        with connected(self.address) as client:
            return measure(
                paths, client, settings, skip_damaged=self.skip_damaged, on_stage=on_stage
            )
