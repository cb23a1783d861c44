"""``--profile site.toml``: options of a site that is measured again and again."""

from __future__ import annotations

import sys
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

F = TypeVar("F", bound="Callable[..., Any]")

#: Options whose values are paths, besides those of type path.
_FILES = ("outline",)

#: The prefix of a path in `base`.
_SURFACE = "surface="

#: Options that may not be in a profile, since they are for a single call.
_NOT_IN_PROFILES = ("profile", "help", "force")


def profile_option(command: F) -> F:
    """Add ``--profile``, whose options apply unless given on the command line."""
    return click.option(
        "--profile",
        type=click.Path(),
        metavar="PATH.toml",
        is_eager=True,
        callback=_taken,
        help='take options from a TOML file, as base = "plane"; paths in it are relative to it, '
        "options on the command line take precedence",
    )(command)


def _taken(ctx: click.Context, _param: click.Parameter, path: str | None) -> str | None:
    if path is not None:
        ctx.default_map = _defaults(ctx, Path(path), _read(path))
    return path


def _read(path: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):
        import tomllib  # noqa: PLC0415 - slow to import
    else:
        import tomli as tomllib  # noqa: PLC0415 - as above
    try:
        return tomllib.loads(Path(path).read_bytes().decode())
    except (OSError, ValueError) as error:  # errors of decoding and of TOML are ValueErrors
        reason = getattr(error, "strerror", None) or error
        raise click.BadParameter(f"{path}: cannot be read ({reason}): TOML is needed") from None


def _defaults(ctx: click.Context, path: Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of this command's options; options of other commands are ignored."""
    own = dict(_named(ctx.command))
    siblings = getattr(ctx.find_root().command, "commands", {}).values()
    known = {name for command in siblings for name, _ in _named(command)} | set(own)
    found = {}
    for key, value in given.items():
        name = key.replace("_", "-")
        if name not in known:
            near = get_close_matches(name, known, 1)
            hint = f", such as {near[0]}," if near else ""
            raise click.BadParameter(f"{path}: {key} is no option: the name of one{hint} is needed")
        if name in own:
            option = own[name]
            found[option.name or ""] = _placed(option, _plain(path, key, value), path.parent)
    return found


def _named(command: click.Command) -> Iterator[tuple[str, click.Option]]:
    """Yield the options by their names on the command line."""
    for option in command.params:
        if isinstance(option, click.Option):
            names = (flag.removeprefix("--") for flag in option.opts if flag.startswith("--"))
            yield from ((name, option) for name in names if name not in _NOT_IN_PROFILES)


def _plain(path: Path, key: str, value: Any) -> Any:  # noqa: ANN401 - any value of TOML
    """Return a value as the option takes it; numbers of a list are joined by commas."""
    if isinstance(value, list):
        return ",".join(str(_plain(path, key, item)) for item in value)
    if isinstance(value, str | bool | int | float):
        return value
    kind = type(value).__name__
    raise click.BadParameter(f"{path}: {key} is a {kind}: a text, a number or true is needed")


def _placed(option: click.Option, value: Any, folder: Path) -> Any:  # noqa: ANN401 - as above
    """Return a value; if it is a path, relative to the profile's folder."""
    if not isinstance(value, str) or value == "-":
        return value
    if isinstance(option.type, click.Path) or option.name in _FILES:
        return str(folder / value)
    if option.name == "base" and value.startswith(_SURFACE):
        return _SURFACE + str(folder / value.removeprefix(_SURFACE))
    return value
