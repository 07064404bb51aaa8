"""The end of the path, where the tracker compares images with the photograph itself."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.estimation.displacement import REST_S, Displacement, fit_displacement, rested
from vergence.estimation.goal_fit import GoalFit, points_in
from vergence.planning.approach.goal import GoalImage
from vergence.planning.approach.point_depths import PointDepths
from vergence.signals import Reference
from vergence.vision import SsdTracker, pick_features
from vergence.vision.tracks import Tracks

_POINTS = 48
_FEWEST = 8  # points that must be found
_APART_PX = 16.0
_BORDER_PX = 40.0
_VAGUE_PX = 0.5  # stated deviation from which a point is useless this close to the goal
_FLOOR_PX = 0.03  # error of a measured position in addition to its stated deviation
_ARM_PX = 0.15  # error of a point predicted from the joints
_LEAST_RELIEF, _MOST_RELIEF = 0.03, 0.3  # relative deviation of the points' depths


class GoalPoints:
    """Well-textured points of the photograph, tracked in the images.

    Args:
        goal: the photograph.
        star_px: recognised points, (N, 2); more points are picked between them.

    Attributes:
        points_px: the points, (K, 2).
        found: number found in the last image.
        agree: which of them were found and agree with each other, (K,).
    """

    def __init__(self, goal: GoalImage, star_px: FloatArray) -> None:
        self.goal = goal
        self.points_px = _picked(goal, star_px)
        self._tracker = SsdTracker(goal.image, self.points_px)
        self.found = 0
        self.agree = np.zeros(len(self.points_px), dtype=np.bool_)
        self._depth_m = np.ones(len(self.points_px))
        self._relief = np.zeros(len(self.points_px))  # relative deviations of the depths
        self._depths: PointDepths | None = None  # None until a fit is known
        self._seen: list[tuple[float, Displacement]] = []

    def learn(self, fit: GoalFit) -> None:
        """Take pose and distance of the goal from a fit; motion will give each point's depth.

        The depths that a fit assigns to single points look like relief if they are wrong, and
        relief is what distinguishes a translation from a rotation.
        """
        depth_m = fit.points_goal[:, 2]
        middle = float(np.median(depth_m))
        share = float(np.clip(np.std(depth_m) / middle, _LEAST_RELIEF, _MOST_RELIEF))
        points = self.goal.camera.normalize(self.points_px)
        self._depths = PointDepths(points, fit.T_world_goal, middle, share)
        self._depth_m, self._relief = self._depths.at_goal()

    def shift_px(self, T_goal_camera: FloatArray) -> float:
        """Return the median distance of the points from their places at a camera pose, px."""
        seen = self.seen_px(T_goal_camera)
        if seen is None:
            return float("inf")
        return float(np.median(np.linalg.norm(seen - self.points_px, axis=1)))

    def seen_px(self, T_goal_camera: FloatArray) -> FloatArray | None:
        """Return where a camera sees the points, (K, 2); None if one is behind it."""
        seen = points_in(T_goal_camera, self._points_goal(self._depth_m))
        return None if (seen[:, 2] <= 0).any() else self.goal.camera.project(seen)

    def track(
        self,
        image: ImageArray,
        time: float,
        T_world_camera: FloatArray,
        T_goal_camera: FloatArray | None = None,
    ) -> Tracks | None:
        """Measure the points in an image; None if too few are found.

        Args:
            image: grey, (height, width).
            time: of its exposure, s.
            T_world_camera: pose of the camera that took it, (4, 4).
            T_goal_camera: assumed pose of the camera; the last one if None.
        """
        predicted = None
        if T_goal_camera is not None:
            predicted = self.seen_px(T_goal_camera)
            if predicted is None:
                return None
        tracks = self._tracker.track(image, predicted)
        variance = np.trace(tracks.covariance_px, axis1=1, axis2=2) / 2.0
        vague = np.flatnonzero(tracks.found & (variance > _VAGUE_PX**2))
        tracks = _without(tracks, vague, "its place is not known well enough")
        self.found = int(tracks.found.sum())
        if self.found < max(_FEWEST, len(tracks.found) // 3):
            return None
        found, camera = tracks.found, self.goal.camera
        points = camera.normalize(tracks.points_px)
        covariance = camera.normalize_covariance(
            tracks.covariance_px + _FLOOR_PX**2 * np.eye(2), points
        )
        self._learn_depths(T_world_camera, points, found)
        goal = self._points_goal(self._depth_m)
        displacement = fit_displacement(
            points[found], covariance[found], goal[found], self._relief[found]
        )
        if displacement is None:
            return None
        at_odds = np.flatnonzero(found)[~displacement.agrees]
        tracks = _without(tracks, at_odds, "disagrees with the other points")
        self.agree = tracks.found
        self._seen = [(t, d) for t, d in self._seen if t >= time - REST_S] + [(time, displacement)]
        return tracks

    def _learn_depths(
        self, T_world_camera: FloatArray, points: FloatArray, found: BoolArray
    ) -> None:
        if self._depths is None:
            return
        deviation = np.full(len(points), _ARM_PX / min(self.goal.camera.focal_px))
        self._depths.add(T_world_camera, points, deviation, found)
        self._depth_m, self._relief = self._depths.at_goal()

    @property
    def displacement(self) -> Displacement | None:
        """Displacement of the camera from the goal in the last image that determined it."""
        return self._seen[-1][1] if self._seen else None

    def at_rest(self, tolerance_m: float, tolerance_rad: float) -> bool:
        """Return whether the camera has hardly moved recently, relative to the tolerances."""
        return rested(self._seen, tolerance_m, tolerance_rad)

    def reference(self, time: float) -> Reference:
        """Return the points of the photograph, with their estimated depths."""
        depth_m = self._depth_m
        return Reference(
            time,
            self.points_px,
            velocity_px=np.zeros_like(self.points_px),
            depth_m=depth_m,
            desired_depth_m=depth_m,
        )

    def _points_goal(self, depth_m: FloatArray) -> FloatArray:
        points = self.goal.camera.normalize(self.points_px)
        rays: FloatArray = np.column_stack((points, np.ones(len(points))))
        return rays * depth_m[:, None]


def _without(tracks: Tracks, chosen: IntArray, why: str) -> Tracks:
    """Return tracks without some points, such as those on a hidden object."""
    found, reasons = tracks.found.copy(), list(tracks.reasons)
    found[chosen] = False
    for number in chosen:
        reasons[number] = why
    return tracks._replace(found=found, reasons=tuple(reasons))


def _picked(goal: GoalImage, star_px: FloatArray) -> FloatArray:
    """Return the best points of the photograph among those that were recognised, (K, 2)."""
    import cv2

    rows, columns = goal.image.shape
    hull = np.zeros((rows, columns), dtype=np.uint8)
    corners = cv2.convexHull(np.rint(star_px).astype(np.int32))
    cv2.fillConvexPoly(hull, corners, 1)
    border = int(_BORDER_PX)
    inside = np.zeros_like(hull)
    inside[border : rows - border, border : columns - border] = 1
    mask = (hull * inside) > 0
    if goal.mask is not None:
        mask &= goal.mask
    picked = pick_features(goal.image, _POINTS, mask, _APART_PX).points_px
    return picked if len(picked) >= _FEWEST else star_px[: 2 * _POINTS]
