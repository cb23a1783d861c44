"""Reading small text files that come with frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.errors import DivespotError, unreadable
from divespot.io.files import bytes_of

if TYPE_CHECKING:
    from pathlib import Path


def text_of(file: Path, needed: str, most: int | None = None) -> str:
    """Return the text of a file of at most `most` bytes; `needed` completes the error."""
    try:
        return bytes_of(file, most).decode()
    except UnicodeDecodeError:
        raise DivespotError(f"{file}: is no text: {needed}") from None
    except OSError as error:
        raise unreadable(file, error) from None
    except DivespotError as error:
        raise DivespotError(f"{file}: {error}") from None
