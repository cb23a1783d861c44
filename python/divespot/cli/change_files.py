"""The output files of a comparison: their options, and how such files begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

from divespot.cli.outputs import ends_in
from divespot.output import DEM, GEOPACKAGE, OUTLINES, PAGE, PICTURE

if TYPE_CHECKING:
    import re
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")


@dataclass(frozen=True)
class ChangeFile:
    """An option for an output file of a comparison."""

    flag: str
    help: str
    own: re.Pattern[bytes]
    endings: tuple[str, ...]

    @property
    def name(self) -> str:
        """The name of the option's parameter."""
        return self.flag.removeprefix("--")

    def option(self) -> Callable[[F], F]:
        """Return the option."""
        return click.option(
            self.flag,
            type=click.Path(),
            metavar="PATH" + "|".join(self.endings),
            callback=ends_in(self.endings),
            help=self.help,
        )


#: In the order in which they are written; pictures come last.
FILES = (
    ChangeFile("--geojson", "write the places' outlines as GeoJSON", OUTLINES, (".geojson",)),
    ChangeFile("--gpkg", "write the outlines as GeoPackage (extra gis)", GEOPACKAGE, (".gpkg",)),
    ChangeFile(
        "--dem",
        "write both surfaces and their difference as a GeoTIFF; needs the extra raster",
        DEM,
        (".tif", ".tiff"),
    ),
    ChangeFile(
        "--report",
        "write a page to read and sign: gains and losses, where they are, their uncertainty",
        PAGE,
        (".html", ".pdf"),
    ),
    ChangeFile("--picture", "draw the plan of gains and losses", PICTURE, (".png", ".svg")),
)


def change_options(command: F) -> F:
    """Add an option for each output file of a comparison."""
    for item in reversed(FILES):
        command = item.option()(command)
    return command
