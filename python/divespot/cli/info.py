"""``divespot info``: describe a scan without measuring it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from divespot.cli.outputs import STDOUT, check_outputs, force_option, json_option, write_json
from divespot.cli.screen import file_name, tell
from divespot.errors import printable, shortened
from divespot.numbers import rounded
from divespot.output import REPORT
from divespot.results.crs_name import crs_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from divespot.directions import Position
    from divespot.overview import Info

#: Standard classes of points (LAS 1.4 R15, table 17).
CLASSES = {
    0: "never classified",
    1: "unclassified",
    2: "ground",
    3: "low vegetation",
    4: "medium vegetation",
    5: "high vegetation",
    6: "building",
    7: "low noise",
    9: "water",
    10: "rail",
    11: "road",
    17: "bridge",
    18: "high noise",
}

#: Most characters of a reference system that are shown.
LONGEST_SYSTEM = 70


@click.command()
@click.argument("scan", metavar="SCAN", type=click.Path())
@click.option("--unit", default="auto", show_default=True, help="unit of the file's coordinates")
@click.option("--up", default="auto", show_default=True, help="which way is up, as for measure")
@json_option("write everything as JSON; -: to stdout, and nothing else there")
@force_option
def info(scan: str, unit: str, up: str, json_file: str | None, force: bool) -> None:  # noqa: FBT001 - click's call
    """Describe SCAN in about a second, without measuring it.

    Prints points, bounds, spacing and density, unit, reference system, classes, unusable points,
    which way is up and by what evidence, and where the ground is. A large LAS or LAZ file is
    sampled in stretches spread over it.
    """
    from divespot.overview import info as look  # noqa: PLC0415 - slow to import

    check_outputs({"--json": (json_file, REPORT)}, (scan,), force=force)
    found = look(scan, unit=unit, up=up)
    if json_file is not None:
        write_json(json_file, json.dumps(found.to_dict(), indent=1, allow_nan=False))
    if json_file != STDOUT:
        for warning in found.warnings:
            tell(f"divespot: {file_name(scan)}: warning: {printable(warning)}")
        click.echo(f"{file_name(scan)}: {found.format}, {_size(found.size_bytes)}\n")
        for name, value in _lines(found):
            click.echo(f"  {name:<9} {value}")


def _size(size_bytes: int) -> str:
    return f"{rounded(size_bytes / 1e6)} MB"


def _lines(found: Info) -> Iterator[tuple[str, str]]:
    yield "points", f"{found.points:,}{_looked_at(found)}"
    yield "dropped", f"{found.dropped_nonfinite:,} not finite, {found.dropped_zero:,} at (0, 0, 0)"
    size = (high - low for low, high in zip(found.low, found.high, strict=True))
    yield "size", f"{' x '.join(rounded(v) for v in size)} {found.unit}"
    yield "from", _place(found.low)
    yield "to", _place(found.high)
    density = f"{rounded(found.density_per_m2)} points a square metre"
    yield "spacing", f"{rounded(found.spacing_m)} m, {density}"
    yield "unit", found.unit + (" (stated)" if found.unit_stated else " (assumed)")
    yield "system", _system(found)
    if found.scale_factor is not None:
        yield "scale", f"{found.scale_factor:.6f} metres of the map to a metre on the ellipsoid"
    if found.classes:
        yield "classes", ", ".join(f"{_class(n)}: {count:,}" for n, count in found.classes.items())
    if found.sensor_m is not None:
        yield "sensor", f"{_place(found.sensor_m)} m"
    yield from _ground(found)


def _looked_at(found: Info) -> str:
    return "" if found.looked_at == found.points else f", {found.looked_at:,} of them looked at"


def _place(position: Position) -> str:
    return ", ".join(f"{value:.10g}" for value in position)


def _system(found: Info) -> str:
    if not found.crs:
        return "not stated"
    name = crs_name(found.crs) or ""
    text = shortened(printable(" ".join(name.split())), LONGEST_SYSTEM)
    return f"{text} (projected)" if found.projected else text


def _class(number: int) -> str:
    return f"{number} {CLASSES[number]}" if number in CLASSES else str(number)


def _ground(found: Info) -> Iterator[tuple[str, str]]:
    level = found.ground
    if level is None:
        yield "ground", "none found"
        return
    normal = ", ".join(f"{value:.3f}" for value in level.normal)
    yield "up", f"({normal}), from: {level.up_from}"
    tilt = f"{rounded(level.tilt_deg, 2)}°"
    yield "ground", f"a plane through {level.share:.0%} of the points, tilted by {tilt}"
