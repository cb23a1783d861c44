"""Logging to the logger ``divespot``, if anybody listens."""

from __future__ import annotations

import sys

NAME = "divespot"


def log(level: str, text: str) -> None:
    """Log a text at a level, as INFO.

    Programs that listen have imported logging already. It is not imported for others, since that
    takes longer than the rest of this package's Python.
    """
    logging = sys.modules.get("logging")
    if logging is not None:
        logger = logging.getLogger(NAME)
        if not logger.handlers:
            logger.addHandler(logging.NullHandler())  # otherwise warnings go to stderr
        logger.log(getattr(logging, level), text)
