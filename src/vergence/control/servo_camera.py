"""One camera of a servo: its pose, its last image, and the motion of its features."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.camera import Camera
from vergence.control.aligned import lifted
from vergence.control.image_motion import ImageMotion, MotionSettings
from vergence.control.mounting import CameraMounting
from vergence.control.objectives import CameraState, state_of
from vergence.control.point_weights import point_weights, row_variance
from vergence.control.shown_faces import shown_faces
from vergence.errors import NOTHING, Absent, InputError
from vergence.estimation.feature_faces import FeatureFaces
from vergence.features import Points
from vergence.robot import Arm
from vergence.signals import ImagePoints, JointState, Observation, Reference

Cameras: TypeAlias = Camera | CameraMounting | Mapping[str, CameraMounting]
NOTHING_SEEN = ImagePoints(
    "", 0.0, np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0, dtype=np.bool_), ()
)
_STALE_S = 0.3  # with several cameras, older measurements of one are ignored


class ServoCamera:
    """Predicts a camera's last measurement to the time of the joints, for the objectives.

    Args:
        arm: up to its tip.
        mounting: of the camera.
        depth_m: believed depth of the features, (M,) or (1,) for all; None if unknown.
        motion: assumptions about the features between exposure and now.
        features: in the target's frame, (M, 3), m, if known.
        faces: with the features, if a surface is known around them.
        period_s: between two images.
    """

    def __init__(
        self,
        arm: Arm,
        mounting: CameraMounting,
        depth_m: FloatArray | None,
        motion: MotionSettings,
        features: FloatArray | None,
        faces: FeatureFaces | None,
        period_s: float,
    ) -> None:
        self.mounting = mounting
        self.view = NOTHING_SEEN  # the last measurement
        self._arm, self._depth_m, self.period_s = arm, depth_m, period_s
        self.features, self.faces, self.motion = features, faces, motion
        self._motion: ImageMotion | None = None
        if not motion.as_it_is:
            self._motion = ImageMotion(arm, mounting, motion, features=features)

    @property
    def feeds_forward(self) -> bool:
        """Whether features or depth are predicted, or the target's motion is fed forward."""
        return self._motion is not None

    def take_over(self, previous: "ServoCamera") -> None:
        """Continue with the estimates of target motion and depth of another servo's camera."""
        self._motion = previous._motion

    @property
    def depth_m(self) -> FloatArray:
        """Believed depth of the features, (M,), or (1,) for all."""
        if self._depth_m is None:
            raise InputError("Servo", "depth_m", NOTHING, "the depth of the features in metres")
        return self._depth_m

    def believed_depth(self, count: int) -> FloatArray:
        """Return the believed depth of the features, (count,), m."""
        depth = self.depth_m
        return np.full(count, depth[0]) if len(depth) == 1 else depth

    def is_fresh(self, time: float) -> bool:
        """Whether its last measurement is recent enough to count beside other cameras."""
        return self.view is not NOTHING_SEEN and time - self.view.time <= _STALE_S

    def state(
        self, observation: Observation, reference: Reference, joints: JointState, *, weighted: bool
    ) -> CameraState:
        """Return the camera's data for the objectives, with features at the time of the joints.

        Args:
            observation: of this tick; the camera's image in it may be an earlier one.
            reference: desired values in this camera's image.
            joints: now.
            weighted: whether features are weighted by their accuracy.
        """
        view, camera = self.view, self.mounting.camera
        depth, share = self._depth(reference, len(view.found)), float("nan")
        if self._motion is None:
            points = camera.normalize(view.points_px)
            flow = np.zeros_like(points)
        else:
            moved = self._motion.update(view, depth, joints, observation.target)
            points, flow, depth, share = moved
            if self.motion.prediction:
                reference = reference.at(joints.time)
        found = view.found
        desired = velocity = None
        if reference.points_px is not None:
            desired = camera.normalize(reference.points_px)
            if reference.velocity_px is not None:
                velocity = camera.normalize_velocity(reference.velocity_px, desired)[found]
            desired = desired[found]
        at_goal = reference.desired_depth_m
        weights, variance = None, 0.0
        if weighted:
            covariance_px = view.covariance_px[found]
            weights = point_weights(covariance_px)
            covariance = camera.normalize_covariance(covariance_px, points[found])
            variance = row_variance(weights, covariance)
        return CameraState(
            self.mounting,
            points[found],
            depth[found],
            flow[found],
            desired,
            velocity,
            None if at_goal is None else at_goal[found],
            count=len(found),
            period_s=self.period_s,
            target=observation.target,
            T_camera_target=reference.T_camera_target,
            time=joints.time,
            depth_share=share,
            weights=weights,
            variance=variance,
            faces=self._shown(found, lifted(points[found], depth[found]), desired, reference),
            **self._pose(joints.position),
        )

    def state_of(self, features: Points, desired: Points, q: FloatArray) -> CameraState:
        """Return the camera's data for given features of a stationary target.

        Args:
            features: the present ones.
            desired: the desired ones.
            q: joint positions, (n,).
        """
        known = state_of(features, desired)
        own = {"mounting": self.mounting, "period_s": self.period_s, **self._pose(q)}
        return replace(known, **own)

    def _shown(
        self, found: BoolArray, now: FloatArray, desired: FloatArray | None, reference: Reference
    ) -> FloatArray | None:
        """Return the faces that show the features found, now and as desired, (F, 6).

        Args:
            found: mask of them, (M,).
            now: their positions in the camera frame, (K, 3), m.
            desired: normalized coordinates, (K, 2).
            reference: with their desired depth, if known.
        """
        if self.faces is None or self.features is None:
            return None
        there = reference.desired_depth_m if reference.depth_m is None else reference.depth_m
        goal = np.empty((0, 3))
        if desired is not None and there is not None:
            goal = lifted(desired, there[found])
        shown: FloatArray = shown_faces(
            self.features[found], now, goal, self.faces.planes, self.faces.holds[found]
        )
        return shown

    def _depth(self, reference: Reference, count: int) -> FloatArray:
        if reference.depth_m is not None:
            return reference.depth_m
        return self.believed_depth(count) if count else np.empty(0)

    def _pose(self, q: FloatArray) -> dict[str, Any]:
        """Return the arm's part of the camera's data."""
        q = q.copy()  # kernels are compiled for arrays that may be written to
        if self.mounting.at_tip:
            return {"arm": self._arm, "q": q}
        T_world_tip = self._arm.forward_kinematics(q)
        return {
            "arm": self._arm, "q": q, "A": self.mounting.twist_map(T_world_tip),
            "T_world_tip": T_world_tip,
        }  # fmt: skip


def mountings_by_name(cameras: Cameras) -> dict[str, CameraMounting]:
    """Return the mountings of cameras by name; "" is the name of a single one."""
    if isinstance(cameras, Camera):
        return {"": CameraMounting(cameras)}
    if isinstance(cameras, CameraMounting):
        return {"": cameras}
    if not cameras:
        raise InputError("Servo", "cameras", Absent("none"), "one camera or more")
    return dict(cameras)


def depth_for(given: ArrayLike | Mapping[str, ArrayLike] | None, camera: str) -> FloatArray | None:
    """Return the believed depths, (M,) or (1,), given for a camera; None if there are none."""
    if isinstance(given, Mapping):
        given = given.get(camera)
    if given is None:
        return None
    depth = frozen(np.atleast_1d(np.asarray(given, dtype=np.float64)), (None,), "depth_m")
    if not (depth > 0).all():
        raise InputError("Servo", "depth_m", given, "positive depths")
    return depth
