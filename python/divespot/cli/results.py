"""Output files of one scan: their options, how such files begin, and the functions that write."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

import click

from divespot.cli.outputs import ends_in
from divespot.errors import DivespotError
from divespot.output import DEM, GEOPACKAGE, OUTLINES, PAGE, PICTURE, POINTS

if TYPE_CHECKING:
    import re
    from collections.abc import Callable, Mapping

    from divespot.report import Report
    from divespot.results.document import Survey

#: File name endings of pictures.
PICTURES = (".png", ".svg", ".pdf")

F = TypeVar("F", bound="Callable[..., Any]")


@dataclass(frozen=True)
class ResultFile:
    """An option for an output file of one scan."""

    flags: tuple[str, ...]
    metavar: str
    help: str
    own: re.Pattern[bytes]
    save: Callable[..., None]
    endings: tuple[str, ...] = ()
    is_drawn: bool = False
    is_page: bool = False

    @property
    def name(self) -> str:
        """The name of the option's parameter."""
        return self.flags[0].removeprefix("--").replace("-", "_")

    def option(self) -> Callable[[F], F]:
        """Return the option."""
        return click.option(
            *self.flags,
            self.name,
            type=click.Path(),
            metavar=self.metavar,
            callback=ends_in(self.endings),
            help=f"{self.help} (one scan only)",
        )

    def write(self, report: Report, path: str, survey: Survey | None) -> None:
        """Write the file."""
        about = (survey,) if self.is_page else ()
        if not self.is_drawn:
            return self.save(report, path)
        try:
            return self.save(report, path, *about)
        except DivespotError:
            raise
        # If matplotlib or Typst fails, only the picture is lost.
        except Exception as error:  # noqa: BLE001
            reason = f"{type(error).__name__}: {error}"
            what = f"{path}: cannot be drawn ({reason}): another format is needed"
            raise DivespotError(what) from None


def _later(module: str, name: str) -> Callable[..., None]:
    """Return a function of a module that is imported when it is called: slow, or of an extra."""

    def save(*given: Any) -> None:  # noqa: ANN401 - what the function takes
        getattr(import_module(module), name)(*given)

    return save


#: In the order in which they are written; pictures come last.
FILES = (
    ResultFile(
        ("--save-base",),
        "PATH",
        "write the base surface as .ply, .npy or .xyz, for --base surface=PATH",
        POINTS,
        _later("divespot.save", "save_base"),
    ),
    ResultFile(
        ("--geojson", "--save-outlines"),
        "PATH",
        "write the piles' outlines with their volumes as GeoJSON, for a GIS or --outline PATH",
        OUTLINES,
        _later("divespot.results.outlines", "save_outlines"),
    ),
    ResultFile(
        ("--gpkg",),
        "PATH.gpkg",
        "write the outlines as a GeoPackage in the scan's reference system; needs the extra gis",
        GEOPACKAGE,
        _later("divespot.results.geopackage", "save_gpkg"),
        (".gpkg",),
    ),
    ResultFile(
        ("--las",),
        "PATH.las|.laz",
        "write the scan's points with class 2 for ground and an extra dimension for the pile",
        POINTS,
        _later("divespot.results.las_points", "save_las"),
        (".las", ".laz"),
    ),
    ResultFile(
        ("--dem",),
        "PATH.tif",
        "write surface, base and their difference as a GeoTIFF; needs the extra raster",
        DEM,
        _later("divespot.results.dem", "save_dem"),
        (".tif", ".tiff"),
    ),
    ResultFile(
        ("--ply",),
        "PATH",
        "write each pile as a closed mesh of its surface and its base",
        POINTS,
        _later("divespot.results.mesh", "save_mesh"),
        (".ply",),
    ),
    ResultFile(
        ("--report",),
        "PATH.html|.pdf",
        "write a page to read and sign: volumes, plan, sections, 3D view, uncertainties",
        PAGE,
        _later("divespot.results.report_file", "save_report"),
        (".html", ".pdf"),
        is_drawn=True,
        is_page=True,
    ),
    ResultFile(
        ("--picture",),
        "PATH.png|.svg|.pdf",
        "draw the plan: heights, outlines, and each pile's volume on it",
        PICTURE,
        _later("divespot.plot", "save_picture"),
        PICTURES,
        is_drawn=True,
    ),
    ResultFile(
        ("--picture-ground",),
        "PATH.png|.svg|.pdf",
        "draw the histogram of heights, with the ground and the height at which objects begin",
        PICTURE,
        _later("divespot.plot", "save_ground_picture"),
        PICTURES,
        is_drawn=True,
    ),
)


def result_options(command: F) -> F:
    """Add an option for each output file of one scan."""
    for item in reversed(FILES):
        command = item.option()(command)
    return command


def chosen_files(params: Mapping[str, Any]) -> dict[ResultFile, str]:
    """Return the files that were asked for, in the order in which they are written."""
    return {item: params[item.name] for item in FILES if params[item.name] is not None}
