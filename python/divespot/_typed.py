"""Settings as typed keywords, for editors and type checkers; a test compares them with Settings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypedDict

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from divespot.stages import Stages


class Changes(TypedDict, total=False):
    """Keywords of `divespot.measure`: the fields of `divespot.Settings`."""

    unit: str
    crs: str | None
    columns: str | None
    classes: str | None
    returns: Literal["all", "first", "last"]
    crop: tuple[float, ...] | None
    up: str | tuple[float, float, float]
    max_tilt_deg: float
    radius_m: float | None
    level: bool
    cell_m: float | None
    margin_m: float | None
    outline: str | os.PathLike[str] | Mapping[str, Any] | None
    inside: tuple[float, ...] | None
    base: str
    compare_bases: bool
    repeat: bool
    density_kg_m3: float | None
    density_u_kg_m3: float | None
    material: str | None
    seed: int
    threads: int
    stages: Stages


class StageChanges(TypedDict, total=False):
    """The fields of `divespot.Stages`."""

    min_neighbors: int
    scene_cluster: bool
    voxel_m: float | None
    surface: Literal["auto", "cells", "triangles"]
    plane_threshold_m: float | None
    hypotheses: int
    bin_m: float | None
    window: int
    lower_fraction: float
    ground_form: Literal["surface", "level"]
    fine_cluster: bool
    fine_radius_m: float | None
    cluster_backend: Literal["divespot", "hdbscan"]
    min_cluster_size: int
    min_samples: int
    link_m: float | None
    select: Literal["all", "largest"]
    toe_m: float | None
    annulus_share: float
    factor: float


class PaperChanges(Changes, StageChanges, total=False):
    """Keywords of `divespot.Settings.paper`."""
