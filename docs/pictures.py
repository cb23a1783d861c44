"""Draw the pictures of method.md from simulated scans: ``make docs-pictures``."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

import divespot
from divespot import simulate
from divespot._native import hills
from divespot.budget import Budget
from divespot.filters import radius_filter
from divespot.plot import AREA, INK, PILE
from divespot.settings import given
from divespot.simulate.hung import body
from divespot.simulate.level import Level
from divespot.surface import find_surface

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.report import Report
    from divespot.simulate import Scene, SimulatedScan

HERE = Path(__file__).parent
SEED = 1
OFF = "#c0392b"
GROUND, BANK, ANNULUS, TOE = "#b9cad3", "#5d6d7a", "#5fa777", "#e8cf8a"
TOE_ZONE, CORE = 2, 3
AROUND = (-0.75, 0.75)
CAMERA = simulate.Camera(frames=5, rail_m=1.6, height_m=2.0, bias_m=0.0)
# A floor that lay level among the voxels in which frames are fused would be cut by one of their
# faces, or not.
ASKEW = simulate.Pose(3.0, 2.0, 5.0)
SCANS = {
    "seen from above": "shape-05",
    "on a wavering floor": "wavering-floor",
    "against three walls": "bay",
    "seen from one side": "one-side",
}


@dataclass(frozen=True)
class Measured:
    """A scan and its report."""

    scan: SimulatedScan
    report: Report

    @classmethod
    def of(cls, scene: Scene | str, density: float) -> Measured:
        """Scan a scene, in metres, and measure it."""
        scan = simulate.scan(scene, seed=SEED, density=density)
        return cls(scan, divespot.measure(scan.points * scan.scene.unit_m))

    def title(self) -> str:
        """Return the true and the measured volume, as text."""
        largest_first = sorted(self.scan.volumes_m3, reverse=True)
        pairs = zip(largest_first, self.report.piles, strict=True)
        return "\n".join(
            f"true {true:.4f} m³, measured {pile.volume_m3:.4f} ± {pile.u95_m3:.4f} m³"
            for true, pile in pairs
        )


def main() -> None:
    """Draw all pictures."""
    for name, draw in PICTURES.items():
        path = HERE / f"method-{name}.png"
        draw().savefig(path, dpi=100, metadata={"Software": None})
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


def surface() -> Figure:
    """Draw a profile through a scan: points on the walked surface, and points off it."""
    found = Measured.of(_occupied(), density=0.6)
    points, report = found.scan.points, found.report
    kept = radius_filter(points, report.settings)
    level = report.level.frame.to_level(kept)
    is_on = find_surface(level, divespot.survey(points), report.settings).is_on
    x, y, z = found.scan.in_scene(kept).T
    near = np.abs(y) < 0.03
    figure = Figure(figsize=(9.0, 2.9), layout="constrained")
    axes = figure.subplots()
    for is_of, color, label in ((is_on, PILE, "surface"), (~is_on, OFF, "off the surface")):
        shown = near & is_of
        axes.scatter(x[shown], z[shown], s=2, color=color, linewidths=0, label=label)
    for text, place in {
        "pile": (-0.05, 0.1),
        "a body over it": (0.42, 0.6),
        "wall": (1.07, 0.54),
        "its shadow": (0.25, 0.24),
    }.items():
        axes.text(*place, text, color=INK, fontsize=9)
    axes.set(xlabel="x in m", ylabel="z in m", aspect="equal", ylim=(-0.05, 0.75))
    axes.set_title(found.title(), color=INK, fontsize=10)
    axes.legend(loc="upper left", frameon=False, markerscale=5)
    return figure


def _occupied() -> Scene:
    """Pour a pile, lean somebody over it, and build a wall beside it."""
    leaning = body((0.2, 0.0, 0.42), 0.7, tuple(range(CAMERA.frames)), np.random.default_rng(7))
    wall = simulate.Wall((1.1, -1.2), (1.1, 1.2), height_m=0.5)
    pile = simulate.Pile(0.07, repose_deg=33.0)
    return simulate.Scene(
        simulate.Floor(3.6, 3.2), (pile,), (leaning, wall), CAMERA, ASKEW, fuse_voxel_m=0.006
    )


def levels() -> Figure:
    """Draw the plan and a profile of a site with ground on two levels and a pit."""
    found = Measured.of(_two_levels(), density=0.5)
    height_map = found.report.level.height_map
    heights_m = height_map.heights_m
    labels, is_ground, _, _ = hills(heights_m, height_map.cell_m, with_holes=False, threads=0)[0]
    kinds = np.where(is_ground, 0, np.where(labels >= 0, 2, 1)).reshape(heights_m.shape)
    x, y = height_map.centers_m()
    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    plan, profile = figure.subplots(2, 1, height_ratios=(2.2, 1))
    colors = ListedColormap([GROUND, BANK, AREA])
    shown = np.ma.masked_where(np.isnan(heights_m), kinds)
    plan.pcolormesh(x, y, shown, cmap=colors, vmin=0, vmax=2, shading="nearest")
    for outline in found.report.level.outlines:
        corners = np.array([*outline.corners_m, outline.corners_m[0]])
        plan.plot(corners[:, 0], corners[:, 1], color=PILE, linewidth=1.5)
    row = int(np.abs(y[:, 0] - np.median(y)).argmin())
    plan.axhline(y[row, 0], color=INK, linewidth=0.8, linestyle=":")
    limits = (y[row, 0] - 1.2, y[row, 0] + 1.2)
    plan.set(ylabel="y in m", aspect="equal", ylim=limits, xlim=(x.min(), x.max()))
    plan.set_title(found.title(), color=INK, fontsize=10)
    names = ("ground, at whatever height", "bank: uphill lies ground", "hill: uphill lies a summit")
    for kind, (color, name) in enumerate(zip((GROUND, BANK, AREA), names, strict=True)):
        is_kind = kinds[row] == kind
        profile.scatter(x[row][is_kind], heights_m[row][is_kind], s=6, color=color, label=name)
    profile.set(xlabel="x in m", ylabel="z in m", xlim=(x.min(), x.max()))
    figure.legend(
        *profile.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=3,
        frameon=False,
        markerscale=2,
    )
    return figure


def _two_levels() -> Scene:
    """Pour a pile on each of two levels, and dig a pit into the lower one."""
    upper = Level((20.0, 0.0), (19.4, 20.0), 0.3, 50.0)
    pit = Level((-1.75, 0.0), (0.45, 0.45), -0.25, 40.0, rounded=True)
    low, high = (
        simulate.Pile(v, (x, 0.0), repose_deg=33.0) for v, x in ((0.05, -0.3), (0.03, 1.9))
    )
    floor = simulate.Floor(6.5, 3.6, node_m=0.008, levels=(upper, pit))
    camera = replace(CAMERA, frames=7, rail_m=3.6, height_m=2.4)
    return simulate.Scene(floor, (low, high), (), camera, ASKEW, fuse_voxel_m=0.01)


def base() -> Figure:
    """Draw the annulus of ground around a pile, and the base below the pile."""
    scene = simulate.scene_named("wavering-floor", SEED)
    floor = replace(scene.floor, wave_m=0.02)
    found = Measured.of(replace(scene, floor=floor, things=(), name="base"), density=0.6)
    height_map, base_m = found.report.level.height_map, found.report.level.base_m
    zones = _zones(found.report)
    x, y = (v - v[zones == CORE].mean() for v in height_map.centers_m())
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    figure.suptitle(found.title(), color=INK, fontsize=10)
    plan, profile = figure.subplots(1, 2, width_ratios=(1, 1.6))
    colors = ListedColormap([GROUND, ANNULUS, TOE, AREA])
    plan.pcolormesh(x, y, zones, cmap=colors, vmin=0, vmax=3, shading="nearest")
    row = int(np.abs(y[:, 0]).argmin())
    plan.axhline(y[row, 0], color=INK, linewidth=0.8, linestyle=":")
    plan.set(xlabel="x in m", ylabel="y in m", aspect="equal", xlim=AROUND, ylim=AROUND)
    heights_mm = 1e3 * height_map.heights_m[row]
    for zone, name in enumerate(("ground", "annulus", "toe", "core")):
        shown = zones[row] == zone
        profile.scatter(x[row][shown], heights_mm[shown], s=6, color=colors(zone / 3), label=name)
    under = zones[row] >= TOE_ZONE
    profile.plot(x[row][under], 1e3 * base_m[row][under], color=INK, label="base", linewidth=2)
    profile.set(xlabel="x in m", ylabel="z in mm", xlim=(-1.0, 1.0))
    profile.legend(loc="upper right", frameon=False, markerscale=2)
    return figure


def _zones(report: Report) -> NDArray[np.intp]:
    """Return the zone of each cell around the largest pile, as the core's ``Reach`` has them."""
    settings, level = report.settings, report.level
    height_map = level.height_map
    labels, *_ = hills(height_map.heights_m, height_map.cell_m, with_holes=False, threads=0)[0]
    hill = labels.reshape(height_map.heights_m.shape) == 0
    core = hill & (height_map.heights_m - level.base_m > given(settings.margin_m))
    toe = math.ceil(given(settings.stages.toe_m) / height_map.cell_m)
    annulus = max(3, int(settings.stages.annulus_share * math.sqrt(core.sum())))
    steps = [core]
    for step in range(toe + annulus):
        steps.append(_wider(steps[-1], diagonal=step % 2 == 1))
    return np.asarray(core.astype(np.intp) + steps[toe] + steps[-1])


def _wider(cells: NDArray[np.bool_], *, diagonal: bool) -> NDArray[np.bool_]:
    """Return cells and their four neighbours, or all eight."""
    padded = np.pad(cells, 1)
    rows, columns = cells.shape
    near = [
        padded[1 + dy : rows + 1 + dy, 1 + dx : columns + 1 + dx]
        for dx in (-1, 0, 1)
        for dy in (-1, 0, 1)
        if diagonal or dx == 0 or dy == 0
    ]
    return np.asarray(np.logical_or.reduce(near))


def budget() -> Figure:
    """Draw the terms of the budget of some piles."""
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    terms = [item.name for item in dataclasses.fields(Budget)]
    names = [*(term.removesuffix("_m3") for term in terms), "u95"]
    panels = figure.subplots(1, len(SCANS), sharey=True)
    for axes, (title, name) in zip(panels, SCANS.items(), strict=True):
        pile = Measured.of(name, density=0.3).report.piles[0]
        u_m3 = [*(getattr(pile.budget, term) for term in terms), pile.u95_m3]
        shares = 100.0 * np.array(u_m3) / pile.volume_m3
        axes.barh(names, shares, color=[AREA] * len(terms) + [PILE])
        for place, share in enumerate(shares):
            axes.text(share, place, f" {share:.2f}", va="center", color=INK, fontsize=8)
        axes.set(title=title, xlabel="% of the volume", xlim=(0.0, 1.3 * shares.max()))
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].invert_yaxis()
    return figure


PICTURES = {"surface": surface, "levels": levels, "base": base, "budget": budget}

if __name__ == "__main__":
    main()
