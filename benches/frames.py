"""Registration of depth frames against Open3D and small_gicp, on simulated frames.

Run by hand: ``python benches/frames.py [SCENE ...]``. A rival that is not installed is named and
left out. All are given the same frames, without poses. Printed are the position error of the
camera, the waviness of the fused floor (root mean square of 5 cm patches about their plane), the
error of the volume, and frames a second: of finding the poses, and of divespot also of adding all
pixels up. Then what divespot holds of each kind, in bytes, for the rail and for a hand.
"""

from __future__ import annotations

import importlib.util
import sys
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import divespot
from divespot import _native, frames, simulate
from divespot.frames.intrinsics import Intrinsics
from divespot.frames.placing import View, place
from divespot.frames.source import Frames

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from divespot.simulate import SimulatedFrames

    Poses = Sequence[NDArray[np.float64]]

#: Edge of the patches of floor, and points that each needs.
PATCH_M, FEWEST = 0.05, 20
#: Points of the floor lie within this of the plane; the voxel that clouds are thinned with.
FLOOR_M, VOXEL_M = 0.02, 0.01
#: Distances of correspondences, coarse to fine, and frames whose overlap is looked at in the graph.
REACHES_M, APART = (0.2, 0.06, 0.02), 4


def clouds(taken: SimulatedFrames) -> list[NDArray[np.float64]]:
    """Return the points of each frame, in its camera's frame."""
    rows, columns = taken.depth.shape[1:]
    rays = Intrinsics.of(taken.matrix).rays(rows, columns)
    z = taken.depth.reshape(len(taken.depth), -1) * 0.001
    return [(rays * (one / rays[:, 2])[:, None])[one > 0] for one in z]


def ours(taken: SimulatedFrames) -> Poses:
    """Return the poses that divespot finds."""
    found = frames.fuse(taken.depth, taken.matrix).registration
    return [pose for pose in found.poses if pose is not None] if found else []


def open3d_multiway(taken: SimulatedFrames) -> Poses:
    """Return the poses of Open3D's multiway registration: pairs by ICP, then a pose graph."""
    import open3d as o3d  # noqa: PLC0415 - may be absent

    icp = o3d.pipelines.registration
    held = []
    for points in clouds(taken):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud = cloud.voxel_down_sample(VOXEL_M)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=0.04, max_nn=30))
        cloud.orient_normals_towards_camera_location()
        held.append(cloud)

    def laid(one: Any, other: Any, start: NDArray[np.float64]) -> tuple[Any, Any]:  # noqa: ANN401 - Open3D's
        for reach in REACHES_M:
            way = icp.TransformationEstimationPointToPlane()
            found = icp.registration_icp(one, other, reach, start, way)
            start = found.transformation
        information = icp.get_information_matrix_from_point_clouds(one, other, REACHES_M[-1], start)
        return start, information

    graph = icp.PoseGraph()
    graph.nodes.append(icp.PoseGraphNode(np.eye(4)))
    whole = np.eye(4)
    steps: dict[tuple[int, int], NDArray[np.float64]] = {}
    for i in range(len(held) - 1):
        start = steps.get((i - 1, i), np.eye(4))
        step, information = laid(held[i], held[i + 1], start)
        steps[i, i + 1] = step
        whole = step @ whole
        graph.nodes.append(icp.PoseGraphNode(np.linalg.inv(whole)))
        graph.edges.append(icp.PoseGraphEdge(i, i + 1, step, information, uncertain=False))
    for i in range(len(held)):
        for k in range(i + 2, min(i + APART, len(held))):
            start = np.linalg.inv(graph.nodes[k].pose) @ graph.nodes[i].pose
            step, information = laid(held[i], held[k], start)
            graph.edges.append(icp.PoseGraphEdge(i, k, step, information, uncertain=True))
    icp.global_optimization(
        graph,
        icp.GlobalOptimizationLevenbergMarquardt(),
        icp.GlobalOptimizationConvergenceCriteria(),
        icp.GlobalOptimizationOption(
            max_correspondence_distance=REACHES_M[-1], edge_prune_threshold=0.25, reference_node=0
        ),
    )
    return [np.array(node.pose) for node in graph.nodes]


def small_gicp_chain(taken: SimulatedFrames) -> Poses:
    """Return the poses of small_gicp, each frame laid on the map of those before it."""
    import small_gicp  # noqa: PLC0415 - may be absent

    held = clouds(taken)
    poses, whole, step = [np.eye(4)], held[0], np.eye(4)
    for points in held[1:]:
        start = poses[-1] @ step
        for reach in REACHES_M:
            found = small_gicp.align(
                whole,
                points,
                init_T_target_source=start,
                registration_type="GICP",
                downsampling_resolution=VOXEL_M,
                max_correspondence_distance=reach,
                num_threads=2,
            )
            start = found.T_target_source
        step = np.linalg.inv(poses[-1]) @ start
        poses.append(start)
        whole = np.concatenate([whole, points @ start[:3, :3].T + start[:3, 3]])
    return poses


RIVALS: dict[str, tuple[str | None, Callable[[SimulatedFrames], Poses]]] = {
    "divespot": (None, ours),
    "Open3D multiway": ("open3d", open3d_multiway),
    "small_gicp": ("small_gicp", small_gicp_chain),
}


def off_m(poses: Poses, taken: SimulatedFrames) -> float:
    """Return the largest distance of a camera from the truth, the whole moved onto it."""
    found, true = np.array(poses), taken.poses
    u, _, v = np.linalg.svd(np.einsum("nij,nkj->ik", true[:, :3, :3], found[:, :3, :3]))
    at, there = found[:, :3, 3] @ (u @ v).T, true[:, :3, 3]
    off = (at - at.mean(axis=0)) - (there - there.mean(axis=0))
    return float(np.linalg.norm(off, axis=1).max())


def waviness_m(points: NDArray[np.float64]) -> float:
    """Return the root mean square of the heights of patches of floor about their plane."""
    floor = points[np.abs(points[:, 2]) < FLOOR_M]
    cell = np.floor(floor[:, :2] / PATCH_M).astype(int)
    _, at, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(at, floor[:, k]) / count for k in range(3)], axis=1)
    means = means[count >= FEWEST]
    for _ in range(5):
        rows = np.column_stack([np.ones(len(means)), means[:, :2]])
        off = means[:, 2] - rows @ np.linalg.lstsq(rows, means[:, 2], rcond=None)[0]
        means = means[np.abs(off) <= 4 * 1.4826 * np.median(np.abs(off))]
    return float(np.sqrt(np.mean(off**2)))


def fused(taken: SimulatedFrames, poses: Poses) -> NDArray[np.float64]:
    """Return the points at given poses, in the same voxels for all, the floor at z = 0."""
    view = View.of(Frames.of(taken.depth), Intrinsics.of(taken.matrix), "planar", 0)
    joint = place(replace(view, source=Frames.of(taken.depth[:1]))).solve()
    first = np.array([*(joint.poses[0] or np.eye(4)[:3].tolist()), [0.0, 0.0, 0.0, 1.0]])
    fusion = view.fusion(joint, None, 2.0)
    back = np.linalg.inv(poses[0])
    for number, pose in enumerate(poses):
        fusion.add(*view.frame(number), (first @ back @ pose)[:3].tolist(), 0.0)
    return fusion.points()[0]


def told(name: str, taken: SimulatedFrames) -> str:
    """Run a rival and say how it did."""
    module, run = RIVALS[name]
    if module is not None and importlib.util.find_spec(module) is None:
        return f"  {name:16} not installed"
    start = time.perf_counter()
    poses = run(taken)
    took_s = time.perf_counter() - start
    scan = frames.fuse(taken.depth, taken.matrix) if module is None else fused(taken, poses)
    points = scan if isinstance(scan, np.ndarray) else scan.points
    try:
        error = divespot.measure(scan).piles[0].volume_m3 / taken.volume_m3 - 1
    except (divespot.DivespotError, IndexError):
        error = float("nan")
    return (
        f"  {name:16} position {1e3 * off_m(poses, taken):7.2f} mm   floor "
        f"{1e3 * waviness_m(points):6.3f} mm   volume {error:+.2%}   "
        f"{len(poses) / took_s:5.1f} frames/s"
    )


def open3d_odometry(taken: SimulatedFrames) -> Poses:
    """Return the poses of Open3D's dense odometry, frame to frame, point to plane."""
    import open3d as o3d  # noqa: PLC0415 - may be absent

    way = o3d.t.pipelines.odometry
    matrix = o3d.core.Tensor(taken.matrix)
    colour = np.zeros((*taken.depth.shape[1:], 3), np.uint8)

    def image(number: int) -> Any:  # noqa: ANN401 - Open3D's
        depth = o3d.t.geometry.Image(o3d.core.Tensor(taken.depth[number]))
        return o3d.t.geometry.RGBDImage(o3d.t.geometry.Image(o3d.core.Tensor(colour)), depth)

    poses = [np.eye(4)]
    for number in range(1, len(taken.depth)):
        found = way.rgbd_odometry_multi_scale(
            image(number),
            image(number - 1),
            matrix,
            depth_scale=1000.0,
            method=way.Method.PointToPlane,
        )
        poses.append(poses[-1] @ found.transformation.numpy())
    return poses


RIVALS["Open3D odometry"] = ("open3d", open3d_odometry)


def held(taken: SimulatedFrames) -> str:
    """Say what is held while frames are put together."""
    view = View.of(Frames.of(taken.depth), Intrinsics.of(taken.matrix), "planar", 0)
    placed = place(view)
    joint = placed.solve()
    fusion = view.fusion(joint, None, 2.0)
    for number, pose in enumerate(joint.poses):
        if pose is not None:
            fusion.add(*view.frame(number), pose, joint.offsets_m[number])
    still = _native.RawStill(view.shape, joint.noise, 0)
    model, keyframes = placed.tracker.bytes()
    sizes = {
        "a frame": 4 * taken.depth[0].size,
        "model": model,
        "patches of frames": keyframes,
        "voxels": fusion.bytes(),
        "if still": still.bytes(),
    }
    told = ", ".join(f"{name} {size / 1e6:.1f} MB" for name, size in sizes.items())
    return f"  held of {len(taken.depth)} frames: {told}"


def main(scenes: list[str]) -> None:
    """Print a line for each scene and rival."""
    for name in scenes:
        taken = simulate.frames(name)
        print(
            f"{name}: {len(taken.depth)} frames of {taken.depth.shape[2]} x "
            f"{taken.depth.shape[1]} pixels"
        )
        for rival in RIVALS:
            print(told(rival, taken), flush=True)
        print(held(taken), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["shape-05", "shape-11", "shape-17"])
