"""What a law may know of a cell and its driver."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.started_driver import StartedDriver
from vergence.camera import Camera
from vergence.cell import Cell
from vergence.control import ImageBased
from vergence.control.term import Term
from vergence.errors import Absent, InputError
from vergence.estimation import FollowedPose
from vergence.features import inverse_depth_plane, of_each
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.parts import kind_of
from vergence.robot import Arm, Clearance
from vergence.simulation import placement_pose
from vergence.simulation.solids import Solids
from vergence.vision import CurveTracking

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel


@dataclass(frozen=True, slots=True)
class LawContext:
    """A cell, its models, and what its driver said at the start; no ground truth.

    Poses are those that the cell file states, at the joint positions that the driver reports; of a
    target that the task before has followed, the last that was believed.
    """

    cell: Cell
    model: "CellModel"  # arms at their start, the target at its placement
    cameras: Mapping[str, Camera]  # cameras, by name
    inner_rate_hz: float
    joints: Mapping[str, FloatArray]  # positions at the start by arm name, (n,), rad or m
    points_px: Mapping[str, FloatArray]  # (M, 2) features in the first image, by camera name

    joints_now: Callable[[], Mapping[str, FloatArray]]  # newest positions by arm name, (n,)
    clearance: Clearance  # distances of the task's arm from what it must not touch, for the loop
    bodies: Clearance  # and the same for planners, which may run beside it
    # Who follows the pose of a target, by its name, as far as that has begun.
    followed: dict[str, FollowedPose] = field(default_factory=dict)
    # Whether the points may lie on anything in the cell, so that nothing is known to hide them.
    points_on_anything: bool = False
    # (M, 2) desired places of the features, by camera name, where the task states them.
    desired_px: Mapping[str, FloatArray] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        cell: Cell,
        driver: StartedDriver,
        model: "CellModel | None" = None,
        believed: Mapping[str, FloatArray] | None = None,
    ) -> Self:
        """Return the context of a cell and a driver.

        Args:
            cell: the cell.
            driver: of its arms and cameras.
            model: of the cell, compiled already; it is placed at the start.
            believed: T_world_target (4, 4) by name, of targets known better than by the cell.

        Raises:
            InputError: if the models of the cell cannot be read.
        """
        from vergence.assembly.clearance import cell_clearance
        from vergence.simulation.cell_model import CellModel

        model, joints = model or CellModel(cell, hulls=True), driver.joints
        model.target_name = cell.target_name
        for name, target in cell.targets.items():
            model.move_target((believed or {}).get(name, placement_pose(target)), name)
        model.place(driver.start)
        clearance = cell_clearance(cell, model, lambda: driver.states)
        bodies = clearance.twin()
        model.place(joints)
        return cls(
            cell,
            model,
            driver.cameras,
            driver.inner_rate_hz,
            joints,
            {},
            lambda: driver.joints,
            clearance,
            bodies,
        )

    def with_points(
        self,
        points_px: Mapping[str, FloatArray],
        desired_px: Mapping[str, FloatArray] | None = None,
    ) -> Self:
        """Return the context with the features in the first image, and where they are desired.

        Args:
            points_px: (M, 2) by camera name.
            desired_px: the same, if the task states it.
        """
        return replace(self, points_px=points_px, desired_px=desired_px or {})

    @property
    def camera_name(self) -> str:
        """The task's camera."""
        return self.cell.task.camera

    def camera(self, name: str | None = None) -> Camera:
        """Return the intrinsics of a camera; of the task's if None."""
        return self.cameras[name or self.camera_name]

    def period_s(self, name: str | None = None) -> float:
        """Return the time between two images of a camera, s; of the task's if None."""
        return 1.0 / self.cell.cameras[name or self.camera_name].rate_hz

    @property
    def inner_period_s(self) -> float:
        """Time between two set-points, s."""
        return 1.0 / self.inner_rate_hz

    @property
    def is_fixed(self) -> bool:
        """Whether the task's camera is fixed in the world and looks at what the arm holds."""
        return self.cell.cameras[self.camera_name].arm is None

    @property
    def arm(self) -> Arm:
        """The task's arm: with the task's camera as its tip, or the target that it holds."""
        return self.arm_to_target if self.is_fixed else self.arm_to_camera(self.camera_name)

    @property
    def arm_to_target(self) -> Arm:
        """The arm that holds the target, with the target as its tip."""
        return self.model.arm_to_target()

    def arm_to_camera(self, name: str) -> Arm:
        """Return the arm that carries a camera, with the camera as its tip."""
        return self.model.arm_to_camera(name)

    @property
    def distance_m(self) -> float:
        """From the task's camera to the target, where the model has them, m."""
        T_camera, T_target = self.model.camera_pose(self.camera_name), self.model.target_pose()
        return float(np.linalg.norm(T_target[:3, 3] - T_camera[:3, 3]))

    def T_world_camera(self, name: str | None = None) -> FloatArray | None:
        """Return the pose (4, 4) of a fixed camera; None of one that an arm carries.

        Args:
            name: of the camera; the task's if None.
        """
        name = name or self.camera_name
        carried = self.cell.cameras[name].arm is not None
        return None if carried else self.model.camera_pose(name)

    def depth_m(self, camera: str, given: float | None) -> FloatArray:
        """Return the believed depth of a camera's features at the start, (M,), m.

        Args:
            camera: its name.
            given: one depth for all; if None, that of known features, or of the places on the
                target's surface that the first image shows, with the target at its placement.

        Raises:
            InputError: if no depth is given and the placement implies none.
        """
        count = len(self.points_px[camera])
        if given is not None:
            return np.full(count, given)
        depth: FloatArray = (
            self.features_in_camera(camera)[:, 2]
            if self.curve is None
            else self._depth_of_curve(camera)
        )
        if not (depth > 0).all():  # false for NaN too
            given_text = Absent("no depth, and the target's placement implies none")
            raise InputError("law", "depth_m", given_text, "a depth in metres")
        return depth

    def target_corners(self) -> FloatArray:
        """Return the points that represent the target in its frame, (K, 3), m."""
        from vergence.assembly.target_geometry import target_shape

        return target_shape(self.cell, self.model).corners

    @property
    def solids(self) -> Callable[[], FloatArray]:
        """What may come between the camera and the target, see `vergence.simulation.solids`."""
        return Solids(self.model, self.cell.task.arm, self.joints_now)

    def features_in_camera(self, name: str) -> FloatArray:
        """Return a camera's features in its frame at the start, (M, 3), m, by the placements.

        Those that nobody named are where the rays of the first image meet the target; NaN where
        they miss it.
        """
        features, T_world_features = self._features(name)
        T_camera_features = se3_compose(se3_inverse(self.model.camera_pose(name)), T_world_features)
        points: FloatArray = transform_points(T_camera_features, features)
        return points

    @property
    def declared_stationary(self) -> bool:
        """Whether the cell declares the target stationary before the task's camera."""
        return self.rests(self.cell.target_name)

    def rests(self, target: str) -> bool:
        """Tell whether the cell declares a target stationary, but for the task's arm."""
        table = self.cell.targets[target]
        if kind_of(table.motion) != "stationary":
            return False
        holder = table.carried_by
        return holder in (None, self.cell.task.arm) or self.cell.arms[holder].motion is None

    @property
    def curve(self) -> CurveTracking | None:
        """What follows curves rather than points, if the task does."""
        tracker = getattr(self.cell.task, "tracker", None)
        return tracker if isinstance(tracker, CurveTracking) else None

    @property
    def terms(self) -> list[Term]:
        """The objectives of the law, with weights and cameras.

        A feature of one curve is that of each of them, stacked, where the task follows several.
        """
        terms: list[Term] = self.cell.law.terms
        if self.curve is None or self.curve.count == 1:
            return terms
        return [self._of_each_curve(term, self.curve.count) for term in terms]

    def _of_each_curve(self, term: Term, count: int) -> Term:
        objective, points_px = term.objective, self.points_px.get(term.camera or self.camera_name)
        if points_px is None or not isinstance(objective, ImageBased):
            return term
        if not objective.feature.of_curve:
            return term
        feature = of_each(objective.feature, len(points_px) // count)
        return term._replace(objective=replace(objective, feature=feature))

    def known_features(self, camera: str) -> FloatArray | None:
        """Return the features that the cell states for a camera, (M, 3), m; None if it has none.

        Those of a curve say where it is; which of its points are measured they do not.
        """
        if self.curve is not None:
            return None
        tool = self.cell.tool
        if tool is not None and tool.camera == camera:
            return np.array(tool.features)
        known = self.cell.target.features
        return None if known is None else np.array(known)

    def _depth_of_curve(self, camera: str) -> FloatArray:
        """Return the depth of the points that represent curves, (M,), m, by the placements.

        Those of each lie on the plane of its features, or of the target's surface inside it.
        """
        assert self.curve is not None
        curves = np.split(self.points_px[camera], self.curve.count)
        points = self.features_in_camera(camera)
        if not self._has_features(camera):
            inside = [0.9 * curve + 0.1 * curve.mean(axis=0) for curve in curves]
            points = self.with_points({camera: np.concatenate(inside)}).features_in_camera(camera)
        elif len(points) % len(curves):
            return np.full(len(self.points_px[camera]), np.nan)
        pairs = zip(np.split(points, len(curves)), curves, strict=True)
        return np.concatenate([self._depth_on_plane(camera, *pair) for pair in pairs])

    def _depth_on_plane(self, camera: str, points: FloatArray, points_px: FloatArray) -> FloatArray:
        """Return the depth of points in the image (K, 2) on the plane through others (N, 3), m."""
        points = points[points[:, 2] > 0.0]  # false for NaN too
        if not len(points):
            return np.full(len(points_px), np.nan)
        A, B, C = inverse_depth_plane(points[:, :2] / points[:, 2:], points[:, 2])
        x, y = self.cameras[camera].normalize(points_px).T
        depth: FloatArray = 1.0 / (A * x + B * y + C)
        return depth

    def _has_features(self, camera: str) -> bool:
        tool = self.cell.tool
        return (tool is not None and tool.camera == camera) or bool(self.cell.target.features)

    def _features(self, camera: str) -> tuple[FloatArray, FloatArray]:
        """Return what a camera looks at: points (M, 3) in a frame, and its pose (4, 4)."""
        tool = self.cell.tool
        if tool is not None and tool.camera == camera:
            return np.array(tool.features), self.model.tool_pose()
        known = self.cell.target.features
        if known is not None or camera not in self.points_px:
            return np.array(known or np.empty((0, 3))), self.model.target_pose()
        return self.model.anchor(camera, self.points_px[camera]), self.model.target_pose()
