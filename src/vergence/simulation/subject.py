"""The features that the cameras observe in a task, and their ground truth."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.cell.cell import Cell
from vergence.cell.named_targets import target_body
from vergence.cell.schema import FollowTable, Task, TrackTable
from vergence.errors import InputError
from vergence.features import inverse_depth_plane
from vergence.geometry import se3_inverse, transform_points
from vergence.runtime.task_ends import looks_for_target
from vergence.signals import FrameTruth
from vergence.simulation.world import World
from vergence.vision import CurveTracking


class _Points(NamedTuple):
    """Points of an object."""

    features: FloatArray  # (M, 3) in its frame, m
    inside: str | None  # the target that contains them, which does not occlude them


class Subject:
    """The features of the task's target or tool and of the other targets, and their true positions.

    Args:
        cell: with its targets and tool.
        world: in its present state.
    """

    def __init__(self, cell: Cell, world: World) -> None:
        self._cell, self._world = cell, world
        self._curve: CurveTracking | None = None
        self._inside: str | None = None  # the target that contains the features
        self._others: dict[str, _Points] = {}  # of targets other than the task's
        self.features = np.empty((0, 3))  # in the target's frame, m

    def take_up(self, task: Task, images: bool) -> None:
        """Observe the features of a task, as far as they are known.

        Without images no features can be picked; they are spread over the middle of the task's
        image.
        """
        tracker = getattr(task, "tracker", None)
        self._curve = tracker if isinstance(tracker, CurveTracking) else None
        self._inside = None
        name = self._world.target_name = self._cell.name_of_target(task)
        self._others = {other: self._known(other) for other in self._cell.targets if other != name}
        known = self._cell.targets[name].features
        if known or isinstance(task, FollowTable) or looks_for_target(task.until):
            self.features, self._inside = self._known(name)
        elif images or not isinstance(task, TrackTable):
            self.features = np.empty((0, 3))
        else:
            camera = self._world.cameras[task.camera]
            points_px = _grid(camera.width, camera.height, task.feature_count)
            self.features = self._world.anchor(task.camera, points_px)

    def truth(self, camera: str, blind: bool) -> FrameTruth:
        """Return the ground truth of an image that a camera takes now."""
        T_world_target, features = self._seen_by(camera)
        truth = self._truth_of(camera, T_world_target, _Points(features, self._inside), blind)
        if self._curve is not None:
            truth = _truth_of_curves(truth, self._curve, self._world.cameras[camera])
        others = {
            name: self._truth_of(camera, self._world.target_pose(name), points, blind)
            for name, points in self._others.items()
        }
        return replace(truth, others=others)

    def _known(self, name: str) -> "_Points":
        """Return the points of a target that follow from its table or its geometry."""
        features = self._cell.targets[name].features
        if features:
            return _Points(np.array(features, dtype=np.float64), None)
        from vergence.vision.known_object import as_followed, object_model_of

        model = object_model_of(self._world.model, target_body(name))
        followed = as_followed(model)
        return _Points(followed.corners, None if followed is model else name)

    def _truth_of(
        self, camera: str, T_world_target: FloatArray, points: "_Points", blind: bool
    ) -> FrameTruth:
        """Return the true positions of the points of one object in an image."""
        features = points.features
        T_world_camera = self._world.camera_pose(camera)
        T_camera_target = se3_inverse(T_world_camera) @ T_world_target
        in_camera = transform_points(T_camera_target, features)
        intrinsics = self._world.cameras[camera]
        depth = in_camera[:, 2].copy()
        in_front = depth > 1e-3
        points_px = np.full((len(in_camera), 2), np.nan)
        points_px[in_front] = intrinsics.project(in_camera[in_front])
        visible = intrinsics.in_view(in_camera) & in_front & np.bool_(not blind)
        in_sight = np.flatnonzero(visible)
        if len(in_sight):
            points_world = transform_points(T_world_target, features[in_sight])
            visible[in_sight] = self._world.sees(camera, points_world, points.inside)
        return FrameTruth(T_world_target, T_world_camera, points_px, depth, visible)

    def _seen_by(self, camera: str) -> tuple[FloatArray, FloatArray]:
        """Return pose (4, 4) and features (M, 3) of what a camera observes: target or tool."""
        tool = self._cell.tool
        if tool is None or tool.camera != camera:
            return self._world.target_pose(), self.features
        return self._world.tool_pose(), np.array(tool.features)


def _truth_of_curves(truth: FrameTruth, curves: CurveTracking, camera: Camera) -> FrameTruth:
    """Return the truth of the points that represent curves, from as many points on each."""
    before: BoolArray = np.isfinite(truth.points_px[:, 0])
    nothing = replace(truth, visible=np.zeros(len(before), dtype=np.bool_))
    if not len(before) or not before.all():
        return nothing
    try:
        points_px = curves.points_on(truth.points_px, (camera.width, camera.height))
    except InputError:  # a circle on edge, a line seen end on
        return nothing
    count = curves.count
    in_sight = truth.visible | ~camera.contains(truth.points_px)
    depth_m, visible = [], []
    for on_it, depth, seen, places in zip(
        np.split(truth.points_px, count),
        np.split(truth.depth_m, count),
        np.split(in_sight, count),
        np.split(points_px, count),
        strict=True,
    ):
        A, B, C = inverse_depth_plane(camera.normalize(on_it), depth)
        x, y = camera.normalize(places).T
        depth_m.append(1.0 / (A * x + B * y + C))
        nearest = np.linalg.norm(places[:, None] - on_it[None], axis=2).argmin(axis=1)
        visible.append(seen[nearest] & camera.contains(places))
    return replace(
        truth,
        points_px=points_px,
        depth_m=np.concatenate(depth_m),
        visible=np.concatenate(visible),
    )


def _grid(width: int, height: int, count: int) -> FloatArray:
    """Return points (count, 2) spread over the middle of an image; one alone at its centre."""
    side = int(np.ceil(np.sqrt(count)))
    share = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(width * (0.25 + 0.5 * share) - 0.5, height * (0.25 + 0.5 * share) - 0.5)
    return np.column_stack((u.ravel(), v.ravel()))[:count]
