"""The input of a planner."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.errors import InputError
from vergence.estimation.feature_faces import FeatureFaces, face_sines, shared_faces
from vergence.estimation.recovery import PoseFit
from vergence.geometry import se3_inverse, transform_points
from vergence.planning.visibility import NO_FACES, View, clearance_at, make_view
from vergence.robot import Arm, Clearance
from vergence.vision.two_view import TwoView


@dataclass(frozen=True, slots=True)
class PlanningProblem:
    """Move a camera from its present pose to one where it sees the points as desired."""

    arm: Arm  # up to the camera
    camera: Camera
    q_start: FloatArray  # (n,)
    T_world_goal: FloatArray  # (4, 4) desired pose of the camera
    points_world: FloatArray  # (N, 3) points that must stay in view, m
    margin_px: float = 10.0  # distance to keep from the border of the image
    margin_joint: float = 0.01  # distance to keep from the joint limits, relative to half the range
    margin_face_deg: float = 1.0  # smallest angle between a line of sight and a face of the object
    surface: FeatureFaces | None = None  # around the points, in the world; None if not known
    # Standard deviation of the goal, m and rad combined: its uncertainty from images.
    goal_deviation: float = 0.0
    bodies: Clearance | None = None  # distances of bodies that must not collide; None for no check

    def __post_init__(self) -> None:
        q = frozen(self.q_start, (self.arm.joint_count,), "q_start")
        object.__setattr__(self, "q_start", q)
        object.__setattr__(self, "T_world_goal", frozen(self.T_world_goal, (4, 4), "T_world_goal"))
        points = frozen(self.points_world, (None, 3), "points_world")
        object.__setattr__(self, "points_world", points)
        if not len(points) or not np.isfinite(points).all():
            raise InputError(
                "PlanningProblem", "points_world", f"{len(points)} points", "one or more, finite"
            )
        for name in ("margin_px", "margin_joint", "margin_face_deg"):
            if not getattr(self, name) >= 0:
                raise InputError("PlanningProblem", name, getattr(self, name), "zero or more")

    @classmethod
    def from_two_view(
        cls,
        two_view: TwoView,
        distance: float,
        arm: Arm,
        camera: Camera,
        q_start: FloatArray,
        *,
        margin_px: float = 10.0,
        margin_joint: float = 0.01,
    ) -> Self:
        """Take the goal and the object from two views, given d*.

        Args:
            two_view: the reconstruction; rejected matches are left out.
            distance: d*, of the desired camera from the reference plane, m. An estimate suffices:
                it cancels in the image path; only joints and depths depend on it.
            arm: up to the camera.
            camera: that took both images, the current one at q_start.
            q_start: present joint positions, (n,).
            margin_px: see the fields.
            margin_joint: see the fields.
        """
        T_world_camera = arm.forward_kinematics(q_start)
        T_world_goal = T_world_camera @ se3_inverse(two_view.T_star_camera(distance))
        points_star = np.ascontiguousarray(two_view.points_star(distance)[two_view.inliers])
        points_world = transform_points(T_world_goal, points_star)
        return cls(arm, camera, q_start, T_world_goal, points_world, margin_px, margin_joint)

    @classmethod
    def from_poses(
        cls,
        now: PoseFit,
        goal: PoseFit,
        features: FloatArray,
        arm: Arm,
        camera: Camera,
        q_start: FloatArray,
        **further: Any,
    ) -> Self:
        """Take the goal and the object from the present and desired poses of known features.

        Args:
            now: pose of the target in the camera at q_start.
            goal: desired pose of the target in the camera.
            features: in the target's frame, (N, 3), m.
            arm: up to the camera.
            camera: its intrinsics.
            q_start: present joint positions, (n,).
            further: fields of the problem.
        """
        T_world_target = arm.forward_kinematics(q_start) @ now.T_world_target
        T_world_goal = T_world_target @ se3_inverse(goal.T_world_target.copy())
        points = transform_points(T_world_target, features.copy())
        lever = float(np.linalg.norm(goal.T_world_target[:3, 3]))
        variance = sum(_worst_variance(fit.covariance, lever) for fit in (now, goal))
        return cls(
            arm, camera, q_start, T_world_goal, points,
            goal_deviation=float(np.sqrt(variance)), **further,
        )  # fmt: skip

    @property
    def T_goal_start(self) -> FloatArray:
        """Pose of the camera at the start in the frame of the goal, (4, 4)."""
        T: FloatArray = se3_inverse(self.T_world_goal) @ self.arm.forward_kinematics(self.q_start)
        return T

    @property
    def points_goal(self) -> FloatArray:
        """The points in the frame of the goal, (N, 3), m."""
        points: FloatArray = transform_points(se3_inverse(self.T_world_goal), self.points_world)
        return points

    @property
    def depth_min(self) -> float:
        """Smallest depth to keep, m: a fifth of the smaller of those at start and goal."""
        T_camera_world = se3_inverse(self.arm.forward_kinematics(self.q_start))
        depths = transform_points(T_camera_world, self.points_world)[:, 2]
        return 0.2 * float(min(depths.min(), self.points_goal[:, 2].min()))

    @property
    def faces(self) -> FloatArray:
        """The faces that are visible from start and goal, (F, 7), as in `View`.

        If an end sees one of them at less than twice the margin, half of that angle is kept. A flat
        object of unknown surface has one face, unless start and goal see opposite sides; other
        points have none unless their surface is known.
        """
        return self._kept(self._surface)

    @property
    def faces_needed(self) -> FloatArray:
        """Those of the faces without which a point is not visible, (F, 7)."""
        known = self._surface
        return self._kept(known.only(known.sole))

    def _kept(self, known: FeatureFaces) -> FloatArray:
        if not len(known.planes):
            return NO_FACES
        eyes = self._eyes
        kept = known.planes[shared_faces(known.planes, known.holds, eyes)]
        sines = np.min([face_sines(eye, kept) for eye in eyes], axis=0)
        least = np.minimum(np.sin(np.radians(self.margin_face_deg)), 0.5 * sines)
        return np.column_stack((kept, least))

    @property
    def sees_the_back(self) -> bool:
        """Whether start and goal see a flat object from opposite sides."""
        known = FeatureFaces.of_points(self.points_world)
        if not len(known.planes):
            return False
        one, other = (face_sines(eye, known.planes)[0] for eye in self._eyes)
        return bool(one * other < 0.0)

    @property
    def _surface(self) -> FeatureFaces:
        return FeatureFaces.of_points(self.points_world) if self.surface is None else self.surface

    @property
    def _eyes(self) -> FloatArray:
        """Positions of the camera at the start and at the goal, (2, 3)."""
        start = self.arm.forward_kinematics(self.q_start)
        return np.array([start[:3, 3], self.T_world_goal[:3, 3]])

    def view(self, margin_px: float | None = None) -> View:
        """Return the view constraint, with the problem's margin or another."""
        margin = self.margin_px if margin_px is None else margin_px
        depth = max(self.depth_min, 1e-6)
        return make_view(self.camera, self.points_world, margin, depth, self.faces)

    def joint_range(self, q_goal: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the joint limits less the margin, which is reduced if start or goal have less."""
        q_min, q_max = self.arm.q_min, self.arm.q_max
        span = np.where(np.isfinite(q_max - q_min), q_max - q_min, 0.0)
        margin = 0.5 * self.margin_joint * span
        ends = [self.q_start] if q_goal is None else [self.q_start, q_goal]
        low = np.minimum(q_min + margin, np.min(ends, axis=0))
        high = np.maximum(q_max - margin, np.max(ends, axis=0))
        return np.maximum(low, q_min), np.minimum(high, q_max)

    def clearance(self, q: FloatArray, margin_px: float | None = None) -> float:
        """Return the sine of the smallest angle to a side of the view or to a face at q (n,)."""
        return float(clearance_at(self.arm.chain, np.asarray(q), self.view(margin_px)))


def _worst_variance(covariance: FloatArray, lever: float) -> float:
    """Return the largest variance of a pose (6, 6) for a point at a lever, and of its angle."""
    position, angle = (
        float(np.linalg.eigvalsh(covariance[k : k + 3, k : k + 3])[-1]) for k in (0, 3)
    )
    return position + (1.0 + lever * lever) * angle
