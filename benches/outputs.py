"""What results cost and how well they keep a volume: `python benches/outputs.py [SCAN...]`.

A yard of a million points in UTM is simulated, and one command writes every output of it, as of
each SCAN that is given. Then what was written is read again, and its volume held against the
report's.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
import pyproj
import rasterio

import divespot
from divespot.cli.results import FILES
from divespot.results.html_report import html_report
from divespot.results.mesh import mesh
from divespot.results.pdf_report import pdf_report
from divespot.results.pile_matching import labels

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from divespot import Report

POINTS = 1_000_000

#: Of a cone: x and y of its middle, radius, height, in metres.
CONES = ((-25, -15, 9, 6.0), (15, -15, 7, 4.5), (-20, 20, 8, 5.0), (20, 18, 6, 4.0))

#: Bounds of the page for a million points.
MOST_PAGE_MB, MOST_PAGE_S = 5.0, 3.0

#: Endings of files whose option takes any.
ENDINGS = {"save_base": ".ply", "geojson": ".geojson"}


def yard(path: Path) -> None:
    """Simulate a flight over four heaps on a yard, 2 cm noise, in ETRS89 / UTM 32."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform((-50, -40), (50, 40), (POINTS, 2)).T
    z = 0.02 * np.sin(x / 9.0) + 0.01 * x + rng.normal(0.0, 0.02, POINTS)
    for at_x, at_y, radius, height in CONES:
        z += np.clip(height * (1.0 - np.hypot(x - at_x, y - at_y) / radius), 0.0, None)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-3), np.array([482_000, 5_456_000, 300])
    header.add_crs(pyproj.CRS.from_epsg(25832))
    las = laspy.LasData(header)
    las.xyz = np.column_stack([x + 482_310.0, y + 5_456_790.0, z + 312.0])
    las.write(path)


def every_output(scan: str | Path, folder: Path) -> dict[str, Path]:
    """Write every output of a scan by one command; return where they are."""
    files = {item.name: f"{ENDINGS.get(item.name) or item.endings[0]}" for item in FILES}
    paths = {name: folder / f"{name}{ending}" for name, ending in files.items()}
    flags = {item.name: item.flags[0] for item in FILES}
    paths |= {name: folder / f"a.{name}" for name in ("json", "csv", "history")}
    given = [
        str(part) for name, path in paths.items() for part in (flags.get(name, f"--{name}"), path)
    ]
    command = [sys.executable, "-m", "divespot", "measure", str(scan), *given, "-q"]
    subprocess.run(command, check=True)
    return paths


def round_trips(report: Report, written: dict[str, Path]) -> Iterator[tuple[str, float]]:
    """Return the volume that each format gives back."""
    yield "LAZ, measured again", divespot.measure(written["las"]).total.volume_m3
    yield "GeoTIFF, difference over the piles", _of_raster(report, written["dem"])
    surface = divespot.measure(written["dem"], crs="EPSG:25832").total.volume_m3
    yield "GeoTIFF, surface measured as a scan", surface
    yield "mesh, volume of the closed surface", _of_mesh(report)
    for name, kind in (("geojson", "GeoJSON"), ("gpkg", "GeoPackage")):
        inside = divespot.measure(report.source.path or "", outline=written[name])
        yield f"{kind}, measured inside its outlines", inside.total.volume_m3
    text = written["json"].read_text("utf-8")
    yield "JSON, read again", divespot.Report.from_json(text).total.volume_m3


def _of_raster(report: Report, path: Path) -> float:
    with rasterio.open(path) as raster:
        difference = raster.read(3)[::-1]
        cell_m2 = abs(raster.transform.determinant)
    at = labels(report.piles, report.level.frame, report.level) > 0
    factor = report.source.scale_factor or 1.0
    return float(np.nansum(difference[at])) * cell_m2 / factor**2


def _of_mesh(report: Report) -> float:
    nodes, faces = mesh(report)
    a, b, c = (nodes[faces["nodes"][:, i].astype(np.int64)] - nodes[0] for i in range(3))
    factor = report.source.scale_factor or 1.0
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0 / factor**2


def timed(work: Callable[[Report], Any], report: Report) -> tuple[float, float]:
    """Return the least work of three times in seconds, and the size in megabytes."""
    best, size = float("inf"), 0
    for _ in range(3):
        begin = time.process_time()  # of this process alone, however busy the machine is
        page = work(report)
        best, size = min(best, time.process_time() - begin), len(page)
    return best, size / 1e6


def main() -> int:
    """Print all figures; return whether a page passes its bounds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scan = folder / "yard.laz"
        yard(scan)
        for one in (scan, *sys.argv[1:]):
            written = folder / Path(one).stem
            written.mkdir()
            begin = time.perf_counter()
            paths = every_output(one, written)
            size = sum(path.stat().st_size for path in paths.values()) / 1e6
            took = time.perf_counter() - begin
            print(f"{Path(one).name}: {len(paths)} outputs, {size:.1f} MB, in {took:.1f} s")
        report = divespot.measure(scan)
        volume, u95 = report.total.volume_m3, report.total.u95_m3
        truth = sum(np.pi * radius**2 * height / 3.0 for *_, radius, height in CONES)
        print(f"\nvolume {volume:.2f} ± {u95:.2f} m³, truth {truth:.2f} m³\n")
        for what, back in round_trips(report, every_output(scan, written)):
            off = 100.0 * (back / volume - 1.0)
            print(f"{what:<40} {back:10.3f} m³ {off:+8.4f} % {(back - volume) / u95:+6.2f} u95")
        print()
        good = True
        for kind, work in (("HTML", html_report), ("PDF", pdf_report)):
            took, size = timed(work, report)
            print(f"{kind} page of {POINTS:,} points: {took:.2f} s, {size:.2f} MB")
            good &= size <= MOST_PAGE_MB and took <= MOST_PAGE_S
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
