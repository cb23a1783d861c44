"""What goes on, for whoever listens to the logger ``divespot``."""

from __future__ import annotations

import sys

NAME = "divespot"


def log(level: str, text: str) -> None:
    """Log a text at a level, as INFO.

    Who listens has imported logging; for all others it is not imported, which takes longer than
    the rest of this package's Python.
    """
    logging = sys.modules.get("logging")
    if logging is not None:
        logger = logging.getLogger(NAME)
        if not logger.handlers:
            logger.addHandler(logging.NullHandler())  # else warnings go to stderr unasked
        logger.log(getattr(logging, level), text)
