"""A mutation fuzzer over all readers: ``python tests/fuzz.py SECONDS [FIRST]``, or `make fuzz`.

Inputs are valid files of `io_samples`, mutated by a generator that the input's number seeds, so
``python tests/fuzz.py --one NUMBER`` makes one again. They are read in a child with limits on
memory and time. An escape is whatever is neither a scan nor a `DivespotError` of one short line:
another exception, a warning, a crash, more than the memory or the time allowed.
"""

from __future__ import annotations

import gzip
import json
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import warnings
import zipfile
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import divespot
from divespot import DivespotError
from divespot import io as dio
from divespot.outline_file import read_regions
from io_samples import POINTS, UTM, VALID, VALID_LAS, las, npz, pcd, raster, text
from scanner_samples import (
    PLACE,
    TURN,
    cartesian,
    e57,
    ptx,
    with_checksums,
    without_checksums,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from divespot.frame import Frame

#: Inputs that one child reads before the next one begins afresh.
BATCH = 2000

#: What one input may take: seconds, and bytes beyond what an empty child holds.
MOST_S, MOST_BYTES = 2.0, 1 << 30

#: Seconds without a sign of life after which a child hangs in native code.
HANGS_S = 30.0

WORDS = [
    *(b"0", b"-1", b"1", b"255", b"65536", b"4294967295", b"18446744073709551616", b"1e999"),
    *(b"nan", b"-nan(ind)", b"1.#QNAN", b"inf", b'"1,5"', b"0x10", b"1_000", b"\xd9\xa3", b"\0"),
    *(b"\n", b"\r", b"\r\n", b"\t", b";", b",", b"#", b"//", b'"', b"(", b"{", b"[" * 2000),
    *(b"x", b"Y", b"POINT_Z", b"lon", b"COUNT 1 1 99999999999", b"DATA ascii\n", b"end_header\n"),
    *(
        b"element vertex 99999999",
        b"property list uchar int z",
        b"property double x",
        b"PK\x03\x04",
    ),
    *(b"\x1f\x8b", b"LASF", b"\x93NUMPY", b"\xff\xfe", b"\xff" * 8, b"\x80", b"\x7f\xff\xff\xff"),
]


def zipped(data: bytes) -> bytes:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("scan.ply", data)
    return stream.getvalue()


def polygon(*lines: list[list[float]]) -> bytes:
    features = [
        {"type": "Feature", "id": 7, "geometry": {"type": "Polygon", "coordinates": [line]}}
        for line in lines
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}).encode()


CRS = b'"crs": {"type": "name", "properties": {"name": "EPSG:32632"}}, '
SPHERE = {
    name: POINTS[:, axis] for axis, name in enumerate(("sphericalRange", "sphericalAzimuth"))
} | {"sphericalElevation": POINTS[:, 2], "sphericalInvalidState": np.zeros(5, np.uint8)}
SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
TABLE = raster(0.5, 8) + UTM
NUMBERED = "".join(f"{i},{y},{x},{z},GS\n" for i, (x, y, z) in enumerate(TABLE.tolist())).encode()
SEEDS = {
    **VALID,
    **VALID_LAS,
    "geo.las": las(POINTS[[0, 1, 4]], geokeys={1024: 1, 3072: 2278, 4096: 6360}),
    "wkt.las": las(POINTS[[0, 1, 4]], wkt='PROJCS["p",UNIT["foot",0.3048]],VERTCS["v",UNIT["m"]]'),
    "double.pcd": pcd(POINTS, "binary_compressed", "f8"),
    "columns.npz": npz(X=POINTS[:, 0], Y=POINTS[:, 1], Z=POINTS[:, 2]),
    "points.csv": NUMBERED,
    "names.csv": b'"POINT_X [ft]";"POINT_Y [ft]";"H [ft]"\n"1,5";"2,5";"3,5"\n' * 2,
    "utm.xyz": text(TABLE),
    "scan.ply.gz": gzip.compress(VALID["ascii.ply"], mtime=0),
    "scan.zip": zipped(VALID["little.ply"]),
    "poses.e57": e57((cartesian(POINTS), (1.0, 0.0, 0.0, 0.0, 5.0, 6.0, 7.0)), (SPHERE, None)),
    "several.ptx": ptx(POINTS[:2]) + ptx(POINTS[2:], TURN, PLACE),
    "several.pts": b"5\n" + text(POINTS) + b"5\n" + text(POINTS),
    "grid.asc": b"ncols 2\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4 5 6\n",
    "named.geojson": polygon(SQUARE).replace(b'"features"', CRS + b'"features"'),
    "lines.geojson": polygon(SQUARE, [[x + 2, y] for x, y in SQUARE]),
}


def mutated(number: int) -> tuple[str, bytes]:
    """Return the name and the bytes of an input by its number."""
    rng = random.Random(number)  # noqa: S311 - no secret
    name = rng.choice(list(SEEDS))
    data = bytearray(SEEDS[name])
    for _ in range(rng.choice((1, 1, 2, 3, 8))):
        rng.choice(MUTATIONS)(rng, data)
    if name.endswith(".e57") and rng.random() < 0.8:
        return name, repaired(bytes(data))
    return name, bytes(data)


def repaired(data: bytes) -> bytes:
    """Return an E57 file with correct checksums, so that readers do not stop at them."""
    body = without_checksums(data)
    return with_checksums(body + bytes(-len(body) % 1020))


def _flip(rng: random.Random, data: bytearray) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _replace(rng: random.Random, data: bytearray) -> None:
    if data:
        data[rng.randrange(len(data))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))


def _cut(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    del data[at : at + rng.choice((1, 2, 8, 64, len(data)))]


def _repeat(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    piece = data[at : at + rng.choice((1, 4, 32, 256))]
    data[at:at] = piece * min(rng.choice((1, 2, 50)), 4096 // max(len(piece), 1) + 1)


def _word(rng: random.Random, data: bytearray) -> None:
    at = rng.randrange(len(data) + 1)
    data[at : at + rng.choice((0, 1, 4))] = rng.choice(WORDS)


def _number(rng: random.Random, data: bytearray) -> None:
    """Put another number in the place of one that is written."""
    digits = [i for i, byte in enumerate(data) if byte in b"0123456789"]
    if digits:
        begin = end = rng.choice(digits)
        while end < len(data) and data[end] in b"0123456789":
            end += 1
        data[begin:end] = rng.choice(WORDS[:8])


def _field(rng: random.Random, data: bytearray) -> None:
    """Put another number in the place of one in binary."""
    size = rng.choice((2, 4, 8))
    if len(data) > size:
        at = rng.randrange(min(len(data) - size, 400) + 1)
        value = rng.choice((0, 1, 2 ** (8 * size) - 1, 2 ** (8 * size - 1), rng.randrange(70_000)))
        data[at : at + size] = (value % 2 ** (8 * size)).to_bytes(size, "little")


def _splice(rng: random.Random, data: bytearray) -> None:
    other = SEEDS[rng.choice(list(SEEDS))]
    data[rng.randrange(len(data) + 1) :] = other[rng.randrange(len(other)) :]


MUTATIONS: tuple[Callable[[random.Random, bytearray], None], ...] = (
    *(_flip, _replace, _cut, _repeat),
    *(_word, _number, _field, _splice),
)


class _TooLong(BaseException):
    """The time that one input may take is over."""


def read_one(number: int, folder: Path, frame: Frame) -> str | None:
    """Read an input; return what is wrong, None where it ends as it should."""
    name, data = mutated(number)
    path = folder / name
    path.write_bytes(data)
    signal.setitimer(signal.ITIMER_REAL, MOST_S)
    try:
        if name.endswith(".geojson"):
            read_regions(str(path), frame)
        else:
            dio.read(path, unit=random.Random(number).choice(("auto", "auto", "mm")))  # noqa: S311
    except DivespotError as error:
        sentence = str(error)
        proper = len(sentence) <= 500 and sentence.isprintable()
        return None if proper else f"the sentence {sentence!r}"
    except BaseException as error:  # noqa: BLE001 - that is what is looked for
        return f"{type(error).__name__}: {error}"[:300]
    else:
        return None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def child(first: int, count: int) -> None:
    """Read inputs, a line on stdout for each: its number, and what is wrong."""

    def stop(_signal: int, _frame: object) -> None:
        raise _TooLong

    frame = divespot.measure(raster(0.02, 60)).level.frame
    with tempfile.TemporaryDirectory() as folder:
        read_all(VALID_LAS, Path(folder))
        sys.stdout.write("ready\tnull\n")
        signal.signal(signal.SIGALRM, stop)
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * resource.getpagesize() + MOST_BYTES
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        warnings.simplefilter("error")
        for number in range(first, first + count):
            wrong = read_one(number, Path(folder), frame)
            sys.stdout.write(f"{number}\t{json.dumps(wrong)}\n")
            sys.stdout.flush()


def read_all(files: dict[str, bytes], folder: Path) -> None:
    """Read valid files, so that libraries are loaded before memory is limited."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
        dio.read(folder / name)


def batch(first: int, count: int) -> tuple[int, list[tuple[int, str]]]:
    """Let a child read a batch; return how many it read, and the escapes."""
    command = [sys.executable, __file__, "--child", str(first), str(count)]
    done, escapes, begun = 0, [], False
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:  # noqa: S603
        timer = _Watch(running)
        for line in running.stdout or ():
            timer.alive()
            number, wrong = line.split("\t", 1)
            if number == "ready":
                begun = True
                continue
            done += 1
            if json.loads(wrong) is not None:
                escapes.append((int(number), json.loads(wrong)))
    timer.stop()
    if not begun:
        sys.exit(f"a child ended with {running.returncode} before it read anything")
    if done < count:
        escapes.append((first + done, f"the process ended with {running.returncode}"))
        done += 1
    return done, escapes


class _Watch:
    """Kills a child that shows no sign of life."""

    def __init__(self, running: subprocess.Popen[str]) -> None:
        import threading  # noqa: PLC0415

        self._seen, self._over = time.monotonic(), threading.Event()
        self._running = running
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def alive(self) -> None:
        self._seen = time.monotonic()

    def stop(self) -> None:
        self._over.set()

    def _watch(self) -> None:
        while not self._over.wait(1.0):
            if time.monotonic() - self._seen > HANGS_S:
                self._running.kill()
                return


def main(seconds: float, first: int) -> int:
    """Fuzz for some seconds; return 1 where anything escaped."""
    begin, number, escaped = time.monotonic(), first, 0
    while time.monotonic() - begin < seconds:
        done, escapes = batch(number, BATCH)
        number += done
        escaped += len(escapes)
        for which, wrong in escapes:
            sys.stdout.write(f"input {which} ({mutated(which)[0]}): {wrong}\n")
    sys.stdout.write(
        f"{number - first:,} executions from {first:,} on, {escaped} escapes, "
        f"{time.monotonic() - begin:.0f} s\n"
    )
    return int(escaped > 0)


def one(number: int) -> None:
    """Write an input beside and read it, with a traceback."""
    name, data = mutated(number)
    path = Path(tempfile.mkdtemp()) / name
    path.write_bytes(data)
    sys.stdout.write(f"{path}\n")
    if name.endswith(".geojson"):
        read_regions(str(path), divespot.measure(raster(0.02, 60)).level.frame)
    else:
        dio.read(path, unit=random.Random(number).choice(("auto", "auto", "mm")))  # noqa: S311


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--child", first, count]:
            child(int(first), int(count))
        case ["--one", number]:
            one(int(number))
        case [seconds]:
            sys.exit(main(float(seconds), 0))
        case [seconds, first]:
            sys.exit(main(float(seconds), int(first)))
        case _:
            sys.exit(__doc__)
