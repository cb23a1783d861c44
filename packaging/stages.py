"""A hash of what each stage of a measurement hands on, for two machines to compare.

`stages.py SCAN.npy...` prints a line a stage: scan, stage and hash. SCAN.json holds the settings.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import struct
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot import measure
from divespot.errors import DivespotError
from divespot.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

#: Attributes without which a value is the same: where it came from, and times.
LEFT_OUT = {"path", "timings_s"}


def pieces(value: Any) -> Iterator[bytes]:  # noqa: ANN401 - any value of a stage
    """Yield the bytes that make a value what it is."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype}{value.shape}".encode() + np.ascontiguousarray(value).tobytes()
    elif isinstance(value, float):
        yield struct.pack("<d", value)
    elif value is None or isinstance(value, bool | int | str | np.generic):
        yield repr(value).encode()
    elif isinstance(value, dict):
        yield from pieces(sorted(value.items()))
    elif isinstance(value, tuple | list):
        yield str(len(value)).encode()
        for item in value:
            yield from pieces(item)
    else:
        yield from pieces(attributes(value))


def attributes(value: Any) -> dict[str, Any]:  # noqa: ANN401 - as above
    """Return the fields of a dataclass, or what a native object shows."""
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]
    else:
        names = [name for name in dir(value) if not name.startswith("_")]
    found = {name: getattr(value, name) for name in names if name not in LEFT_OUT}
    return {name: item for name, item in found.items() if not callable(item)}


def digest(value: Any) -> str:  # noqa: ANN401 - as above
    """Return a short hash of a value."""
    found = hashlib.sha256()
    for piece in pieces(value):
        found.update(piece)
    return found.hexdigest()[:16]


class Hashing(Progress):
    """Stages whose results are printed as hashes."""

    scan = ""

    def __call__(self, name: str, stage: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401
        """Run one stage, and print what it hands on."""
        result = super().__call__(name, stage, *args, **kwargs)
        print(f"{self.scan}\t{name}\t{digest(result)}", flush=True)
        return result


def main(scans: list[str]) -> None:
    """Print a line for each stage of each scan."""
    sys.modules["divespot.pipeline"].Progress = Hashing  # type: ignore[attr-defined]
    for scan in scans:
        Hashing.scan = scan.rsplit("/", 1)[-1]
        try:
            settings = json.loads(Path(scan).with_suffix(".json").read_text("utf-8"))
            report = measure(np.load(scan), threads=2, **settings)
        except DivespotError as error:
            print(f"{Hashing.scan}\terror\t{error}")
        else:
            print(f"{Hashing.scan}\treport\t{digest(dataclasses.replace(report, timings_s={}))}")


if __name__ == "__main__":
    main(sys.argv[1:])
