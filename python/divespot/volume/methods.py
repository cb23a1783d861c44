"""The methods by name, and measuring the piles of a report by one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

from divespot._arguments import require_kind, shown, word
from divespot.errors import DivespotError
from divespot.report import Report
from divespot.volume.alpha import alpha_shape
from divespot.volume.body import bodies_of
from divespot.volume.hull import hull
from divespot.volume.slices import slices
from divespot.volume.tin import tin
from divespot.volume.voxels import inner_voxels

if TYPE_CHECKING:
    from divespot.volume.body import Body

#: Radius, in cells, of the disc that rolls around a concave contour.
REACH_CELLS = 2.0

#: Default thickness of a layer of `slices`, in cells.
SLICE_CELLS = 0.25

Method: TypeAlias = Literal["voxels", "slices", "hull", "alpha", "tin"]
METHODS: tuple[Method, ...] = get_args(Method)


def volumes_m3(  # noqa: PLR0913 - one keyword a parameter of a method
    report: Report,
    method: Method,
    *,
    voxel_m: float | None = None,
    slice_m: float | None = None,
    contour: Literal["convex", "concave"] = "convex",
    alpha_m: float | None = None,
) -> tuple[float, ...]:
    """Measure a report's piles again by another method, above the same base.

    Parameters
    ----------
    report
        The result of `divespot.measure`; its own volumes are by the ground grid.
    method
        ``voxels``, ``slices``, ``hull``, ``alpha`` or ``tin``: see the functions of
        `divespot.volume`. All but the first need SciPy.
    voxel_m
        Edge of the voxels of ``voxels``; by default that of a cell.
    slice_m, contour
        Thickness of the layers of ``slices``, by default a quarter of a cell, and the contour
        around the points of each.
    alpha_m
        Largest radius of ``alpha``; by default the height of the highest pile: empty spheres
        inside a pile have at most half this radius, and the factor of two allows for noise.

    Returns
    -------
    volumes_m3
        One for each of ``report.piles``, in their order. The method's own error is not in u95.

    Raises
    ------
    DivespotError
        There is no such method, a length is not above 0, or SciPy is not installed.

    Examples
    --------
    >>> import divespot
    >>> from divespot import simulate
    >>> from divespot.volume import volumes_m3
    >>> report = divespot.measure(simulate.scan("shape-05", density=0.03).points)
    >>> [round(volume_m3, 3) for volume_m3 in volumes_m3(report, "tin")]
    [0.028]

    """
    require_kind("report", report, Report)
    if word("method", method) not in METHODS:
        raise DivespotError(f"method is {shown(method)}: one of {', '.join(METHODS)} is needed")
    highest_m = max((pile.max_height_m for pile in report.piles), default=0.0)

    def measured(body: Body) -> float:
        if method == "voxels":
            return inner_voxels(body.points_m, body.cell_m if voxel_m is None else voxel_m)
        if method == "slices":
            thick_m = SLICE_CELLS * body.cell_m if slice_m is None else slice_m
            reach_m = REACH_CELLS * body.cell_m
            return slices(body.points_m, thick_m, contour=contour, reach_m=reach_m)
        if method == "alpha":
            largest_m = max(body.cell_m, highest_m) if alpha_m is None else alpha_m
            return alpha_shape(body.points_m, largest_m)
        return hull(body.points_m) if method == "hull" else tin(body.points_m, body.outline_m)

    return tuple(measured(body) for body in bodies_of(report))
