"""How a command fails: one line on stderr and an exit status, never a traceback."""

from __future__ import annotations

from typing import IO, Any

import click

from divespot.cli.screen import tell
from divespot.errors import DivespotError, printable, shortened, unwritable

#: What is said where memory runs out.
TOO_LARGE = "the scan needs more memory than there is: a smaller scan, or a crop, is needed"

#: Exit status that shells report for a process ended by Ctrl-C: 128 + SIGINT.
INTERRUPTED = 130


def said(error: DivespotError | OSError) -> str:
    """Return an error as a sentence; a system error without a file name is about stdout."""
    if isinstance(error, DivespotError):
        return str(error)
    name = "the standard output" if error.filename is None else error.filename
    return str(unwritable(name, error))


class Failure(click.ClickException):
    """Bad input: ``divespot: <sentence>`` on stderr, exit 1."""

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the line."""
        sentence = shortened(printable(self.message))
        if file is None:
            tell(f"divespot: {sentence}")
        else:
            click.echo(f"divespot: {sentence}", file=file)


class Guarded(click.Group):
    """A group whose commands report bad input as `Failure`, whatever exception it caused."""

    def invoke(self, ctx: click.Context) -> Any:  # noqa: ANN401 - what a command returns
        """Run the command."""
        try:
            return super().invoke(ctx)
        except DivespotError as error:
            raise Failure(str(error)) from None
        except click.FileError as error:
            raise Failure(error.format_message()) from None
        except BrokenPipeError:
            raise  # click exits quietly: the reader of stdout is gone
        except OSError as error:
            raise Failure(said(error)) from None
        except MemoryError:
            raise Failure(TOO_LARGE) from None
        except KeyboardInterrupt:
            ctx.exit(INTERRUPTED)
