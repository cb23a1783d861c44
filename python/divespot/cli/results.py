"""Output files of one scan: their options, how such files begin, and the functions that write."""

from __future__ import annotations

from dataclasses import dataclass
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


def _base(report: Report, path: str) -> None:
    from divespot import save_base  # noqa: PLC0415 - slow to import

    save_base(report, path)


def _outlines(report: Report, path: str) -> None:
    from divespot import save_outlines  # noqa: PLC0415 - slow to import

    save_outlines(report, path)


def _gpkg(report: Report, path: str) -> None:
    from divespot.results.geopackage import save_gpkg  # noqa: PLC0415 - needs the gis extra

    save_gpkg(report, path)


def _las(report: Report, path: str) -> None:
    from divespot.results.las_points import save_las  # noqa: PLC0415 - slow to import

    save_las(report, path)


def _dem(report: Report, path: str) -> None:
    from divespot.results.dem import save_dem  # noqa: PLC0415 - needs the raster extra

    save_dem(report, path)


def _mesh(report: Report, path: str) -> None:
    from divespot.results.mesh import save_mesh  # noqa: PLC0415 - slow to import

    save_mesh(report, path)


def _picture(report: Report, path: str) -> None:
    from divespot.plot import save_picture  # noqa: PLC0415 - needs the plot extra

    save_picture(report, path)


def _ground_picture(report: Report, path: str) -> None:
    from divespot.plot import save_ground_picture  # noqa: PLC0415 - needs the plot extra

    save_ground_picture(report, path)


def _page(report: Report, path: str, survey: Survey | None) -> None:
    from divespot.results.report_file import save_report  # noqa: PLC0415 - as above

    save_report(report, path, survey)


#: In the order in which they are written; pictures come last.
FILES = (
    ResultFile(
        ("--save-base",),
        "PATH",
        "write the base surface as .ply, .npy or .xyz, for --base surface=PATH",
        POINTS,
        _base,
    ),
    ResultFile(
        ("--geojson", "--save-outlines"),
        "PATH",
        "write the piles' outlines with their volumes as GeoJSON, for a GIS or --outline PATH",
        OUTLINES,
        _outlines,
    ),
    ResultFile(
        ("--gpkg",),
        "PATH.gpkg",
        "write the outlines as a GeoPackage in the scan's reference system; needs the extra gis",
        GEOPACKAGE,
        _gpkg,
        (".gpkg",),
    ),
    ResultFile(
        ("--las",),
        "PATH.las|.laz",
        "write the scan's points with class 2 for ground and an extra dimension for the pile",
        POINTS,
        _las,
        (".las", ".laz"),
    ),
    ResultFile(
        ("--dem",),
        "PATH.tif",
        "write surface, base and their difference as a GeoTIFF; needs the extra raster",
        DEM,
        _dem,
        (".tif", ".tiff"),
    ),
    ResultFile(
        ("--ply",),
        "PATH",
        "write each pile as a closed mesh of its surface and its base",
        POINTS,
        _mesh,
        (".ply",),
    ),
    ResultFile(
        ("--report",),
        "PATH.html|.pdf",
        "write a page to read and sign: volumes, plan, sections, 3D view, uncertainties",
        PAGE,
        _page,
        (".html", ".pdf"),
        is_drawn=True,
        is_page=True,
    ),
    ResultFile(
        ("--picture",),
        "PATH.png|.svg|.pdf",
        "draw the plan: heights, outlines, and each pile's volume on it",
        PICTURE,
        _picture,
        PICTURES,
        is_drawn=True,
    ),
    ResultFile(
        ("--picture-ground",),
        "PATH.png|.svg|.pdf",
        "draw the histogram of heights, with the ground and the height at which objects begin",
        PICTURE,
        _ground_picture,
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
