"""One option per setting, made from the settings' metadata, so that the two cannot differ."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from divespot.errors import DivespotError
from divespot.settings import Settings, elsewhere
from divespot.stages import Stages

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")

PRESETS: dict[str, Callable[[], Settings]] = {"default": Settings, "paper": Settings.paper}
#: Sources of a value that count as given: the command line, or a profile.
GIVEN = (ParameterSource.COMMANDLINE, ParameterSource.DEFAULT_MAP)

FIELDS = {item.name: item for item in dataclasses.fields(Settings) if item.name != "stages"}
STAGES = {item.name: item for item in dataclasses.fields(Stages)}

#: Headings of ``--help`` after the outputs, and the settings under each.
GROUPS = {
    "The scan": ("unit", "crs", "columns", "classes", "returns", "crop"),
    "The ground": ("up", "max_tilt_deg", "level"),
    "The surface": ("radius_m", "cell_m", "margin_m"),
    "What is measured, and above what": ("outline", "inside", "base", "compare_bases", "repeat"),
    "Mass": ("material", "density_kg_m3", "density_u_kg_m3"),
    "The run": ("preset", "seed", "threads"),
    "The paper's method, with --preset paper": tuple(STAGES),
}
#: Options that are not settings, under headings of their own.
OTHERS = {
    "Depth frames": (
        "intrinsics",
        "depth_scale",
        "depth_kind",
        "depth_topic",
        "known_poses",
        "exact_poses",
    ),
}
_PAPER = Settings.paper().stages
_METAVARS = {"_kg_m3": "KG/M3", "_deg": "DEGREES", "_m": "METRES"}


def metres_or_auto(text: str) -> float | None:
    """Return a number of metres; None, which is derived from the scan, for ``auto``."""
    if text == "auto":
        return None
    try:
        return float(text)
    except ValueError:
        raise click.BadParameter(f"{text!r}: a number of metres, or auto, is needed") from None


def corners(text: str) -> tuple[float, ...]:
    """Return numbers separated by commas; the setting checks how many."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r}: numbers separated by commas are needed") from None


def simulation_options(command: F) -> F:
    """Add ``--seed`` and ``--density`` of a simulated scan."""
    density = click.option(
        "--density",
        type=float,
        default=1.0,
        show_default=True,
        help="number of points, relative to the scene's own",
    )
    seed = click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="seed of every random draw of the simulation",
    )
    return seed(density(command))


class Grouped(click.Command):
    """A command whose ``--help`` shows options under headings, outputs first."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse; for an option that was removed, name its replacement."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            name = error.option_name.lstrip("-").replace("-", "_")
            gone = elsewhere(name) or elsewhere(f"{name}_m")
            raise click.UsageError(gone, ctx) if gone else error from None

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of each group."""
        groups = OTHERS | GROUPS
        of = {name: title for title, names in groups.items() for name in names}
        rows: dict[str, list[tuple[str, str]]] = {"Outputs": [], **{title: [] for title in groups}}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx) if isinstance(param, click.Option) else None
            if record is not None:
                rows[of.get(param.name or "", "Outputs")].append(record)
        for title, records in rows.items():
            with formatter.section(title):
                formatter.write_dl(records)


def setting_options(command: F) -> F:
    """Add ``--preset``, and an option for each setting and each parameter of the paper's stages."""
    for item in reversed((FIELDS | STAGES).values()):
        command = _option(item)(command)
    preset = click.option(
        "--preset",
        type=click.Choice(list(PRESETS)),
        default="default",
        show_default=True,
        help="settings to start from: the measuring instrument, or the paper's method",
    )
    return preset(command)


def chosen_settings(ctx: click.Context) -> Settings:
    """Return the preset's settings with the options that were given.

    Raises
    ------
    click.UsageError
        A value is out of range.

    """
    changes: Any = {
        name: ctx.params[name]
        for name in FIELDS | STAGES
        if ctx.get_parameter_source(name) in GIVEN
    }
    inner = [name for name in changes if name in STAGES]
    if inner and ctx.params["preset"] != "paper":
        option = "--" + inner[0].replace("_", "-")
        raise click.UsageError(f"{option} is of the paper's method: --preset paper is needed", ctx)
    try:
        return PRESETS[ctx.params["preset"]]().tuned(**changes)
    except DivespotError as error:
        raise click.UsageError(str(error), ctx) from None


def _option(item: dataclasses.Field[Any]) -> Callable[[F], F]:
    flag = "--" + item.name.replace("_", "-")
    text = f"{item.metadata['help']}  [default: {_default(item)}]"
    if item.metadata["kind"] is bool:
        negative = flag.replace("--", "--no-", 1)
        return click.option(f"{flag}/{negative}", item.name, default=None, help=text)
    names = [flag, *_without_unit(flag)]
    return click.option(*names, item.name, type=_type(item), metavar=_metavar(item), help=text)


def _without_unit(flag: str) -> list[str]:
    """Return the flag without the unit it ends in: ``--density`` for ``--density-kg-m3``."""
    endings = (ending.replace("_", "-") for ending in _METAVARS)
    return [flag.removesuffix(ending) for ending in endings if flag.endswith(ending)][:1]


def _type(item: dataclasses.Field[Any]) -> click.Choice[str] | Callable[[str], Any]:
    kind: Callable[[str], Any] = item.metadata["kind"]
    if "choices" in item.metadata:
        return click.Choice(item.metadata["choices"])
    if kind is tuple:
        return corners
    return metres_or_auto if _is_length(item) else kind


def _metavar(item: dataclasses.Field[Any]) -> str | None:
    if item.metadata["kind"] is not float:
        return item.metadata.get("metavar")
    endings = (text for ending, text in _METAVARS.items() if item.name.endswith(ending))
    return next(endings, "NUMBER") + ("|auto" if _is_length(item) else "")


def _default(item: dataclasses.Field[Any]) -> str:
    default = getattr(_PAPER, item.name) if item.name in STAGES else item.default
    if default is None:
        return "auto, derived from the scan" if _is_length(item) else "none"
    if item.metadata["kind"] is bool:
        return "on" if default else "off"
    return f"{default:g}" if isinstance(default, float) else str(default)


def _is_length(item: dataclasses.Field[Any]) -> bool:
    """Return whether a setting is a length, which is derived from the scan where it is None."""
    return item.metadata["kind"] is float and item.name.endswith("_m")
