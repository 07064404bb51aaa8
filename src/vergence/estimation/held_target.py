"""A target held by an arm, tracked in the frame of the arm's tip, where it hardly moves."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.measure import CameraPose, Joints
from vergence.estimation.visibility import Blocked
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.signals import Frame, Observation, TargetState

TipPose: TypeAlias = Callable[[Joints], FloatArray]  # joints to T_world_tip (4, 4)


class FollowedPose(Protocol):
    """A perception that may lose its target."""

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is tracked."""
        ...

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return the observation in the frames, or None if none of them is relevant."""
        ...

    def pose_at(self, frame: Frame) -> FloatArray:
        """Return the expected T_world_target (4, 4) at an exposure; the last one if lost."""
        ...


class HeldTarget:
    """Tracks a target held by an arm, with cameras that do not move with it.

    The filter works in the frame of the tip, in which the target hardly moves and the cameras move
    as determined by the joints: the arm's motion is known and need not be estimated. The result is
    converted back to the target's pose in the world, together with the pose of the tip.

    Args:
        perception: set up in the tip's frame, see `seen_from_tip` and `blocked_from_tip`.
        tip_pose: computes T_world_tip (4, 4) from the joints at the exposure.
    """

    def __init__(self, perception: FollowedPose, tip_pose: TipPose) -> None:
        self._perception, self._tip_pose = perception, tip_pose

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is tracked."""
        return self._perception.lost

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return the observation in the images and the target's pose, or None without an image."""
        observation = self._perception.observe(frames)
        if observation is None or observation.target is None:
            return observation
        newest = max(frames, key=lambda frame: frame.time)
        held = replace(observation.target, time=newest.time)
        return replace(observation, target=_in_world(held, self._tip_pose(newest.joints)))

    def pose_at(self, frame: Frame) -> FloatArray:
        """Return the expected T_world_target (4, 4) at an exposure."""
        T: FloatArray = se3_compose(self._tip_pose(frame.joints), self._perception.pose_at(frame))
        return T


def seen_from_tip(camera_pose: CameraPose, tip_pose: TipPose) -> CameraPose:
    """Convert a function that returns T_world_camera (4, 4) to one that returns T_tip_camera."""

    def pose(camera: str, joints: Joints) -> FloatArray:
        T_hand_camera: FloatArray = se3_compose(
            se3_inverse(tip_pose(joints)), camera_pose(camera, joints)
        )
        return T_hand_camera

    return pose


def blocked_from_tip(
    blocked_at: Callable[[Frame], Blocked], tip_pose: TipPose
) -> Callable[[Frame], Blocked]:
    """Return an occlusion test for a viewpoint and points in the tip's frame."""

    def at(frame: Frame) -> Blocked:
        T, blocked = tip_pose(frame.joints), blocked_at(frame)

        def hidden(eye: FloatArray, points: FloatArray) -> BoolArray:
            return blocked(T[:3, :3] @ eye + T[:3, 3], transform_points(T, points))

        return hidden

    return at


def _in_world(held: TargetState, T_world_tip: FloatArray) -> TargetState:
    """Convert a target state from the tip's frame to world axes."""
    turn = np.kron(np.eye(4), T_world_tip[:3, :3])
    return TargetState(
        held.time,
        se3_compose(T_world_tip, held.T_world_target),
        turn[:6, :6] @ held.velocity,
        turn @ held.covariance @ turn.T,
        held.consistent,
        T_world_tip,
    )
