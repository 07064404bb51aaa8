"""A flat target seen straight on may leave on either side: no small covariance on the wrong one."""

from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.cell.schema import TagTable
from vergence.estimation import (
    CameraRig,
    MirrorWatch,
    PoseFilter,
    PosePerception,
    TargetShape,
    pose_from_points,
    view_of,
)
from vergence.geometry import se3, so3_exp, so3_log, transform_points
from vergence.signals import Frame, ImagePoints

CAMERA = Camera(640, 480, 720, 720, 319.5, 239.5)
CORNERS = np.array(TagTable(id=1, size_m=0.03).corners)
EVERY = np.ones(4, dtype=np.bool_)
FIVE_SIGMA = 40.0  # χ² with six degrees of freedom
RATE_HZ, IMAGES = 30.0, 100


class Film:
    """A small tag that sways about the line of sight, half a metre away."""

    def __init__(self, seed: int, noise_px: float) -> None:
        rng = np.random.default_rng(seed)
        self._swing = rng.uniform(0.1, 0.4), rng.uniform(0.0, 0.3), rng.uniform(0.0, 6.0)
        self._seed, self._noise = seed, noise_px

    def pose(self, t: float) -> np.ndarray:
        a, b, phase = self._swing
        turn = np.array([a * np.sin(1.5 * t + phase), b * np.cos(1.1 * t + phase), 0.2 * np.sin(t)])
        R = so3_exp(np.array([np.pi, 0.0, 0.0])) @ so3_exp(turn)
        return se3(R, np.array([0.05 * np.sin(t), 0.03 * np.cos(t), 0.7]))

    def corners(self, frame: Frame, _T: FloatArray | None = None) -> ImagePoints:
        rng = np.random.default_rng([self._seed, round(frame.time * RATE_HZ)])
        true = CAMERA.project(transform_points(self.pose(frame.time), CORNERS))
        spread = np.tile(np.eye(2) * self._noise**2, (4, 1, 1))
        places = true + rng.normal(0.0, self._noise, true.shape)
        return ImagePoints("eye", frame.time, places, spread, EVERY, ("",) * 4)


def followed(seed: int, noise_px: float, watched: bool) -> list[float]:
    """Return the squared deviations of the stated pose from the truth, an image each."""
    film = Film(seed, noise_px)

    def measure(frame: Frame, features: Any, *_: Any) -> ImagePoints:
        seen = film.corners(frame)
        return ImagePoints(
            "eye", frame.time, seen.points_px[features], seen.covariance_px[features],
            seen.found[features], ("",) * len(features),
        )  # fmt: skip

    frames = [Frame("eye", k / RATE_HZ, None, {}) for k in range(3 * IMAGES)]
    fits = (
        pose_from_points([view_of(film.corners(f), CAMERA, np.eye(4), CORNERS)]) for f in frames
    )
    begin, fit = next((k, fit) for k, fit in enumerate(fits) if fit)
    covariance = np.diag(np.repeat([0.0, 0.0, 0.1, 0.3], 3) ** 2)
    covariance[:6, :6] = fit.covariance
    target_filter = PoseFilter()
    rig = CameraRig.of({"eye": CAMERA}, noise_px)
    perception: Any = PosePerception(
        rig,
        TargetShape.from_points(CORNERS),
        lambda _camera, _joints: np.eye(4),
        measure,
        target_filter,
        target_filter.start(fit.time, fit.T_world_target, covariance=covariance),
        find=film.corners,
    )
    if watched:
        perception = MirrorWatch(perception, rig, lambda _camera, _joints: np.eye(4), CORNERS)
    found = []
    for frame in frames[begin + 1 : begin + 1 + IMAGES]:
        state = perception.observe([frame]).target
        if state is None:
            continue
        T, true = state.T_world_target, film.pose(frame.time)
        turn = so3_log(np.ascontiguousarray(T[:3, :3] @ true[:3, :3].T))
        off = np.concatenate((T[:3, 3] - true[:3, 3], turn))
        found.append(float(off @ np.linalg.solve(state.covariance[:6, :6], off)))
    return found


def wrong_share(noise_px: float, watched: bool) -> float:
    every = [d for seed in range(6) for d in followed(seed, noise_px, watched)]
    assert len(every) > 4 * IMAGES
    return float(np.mean(np.array(every) > FIVE_SIGMA))


def test_a_sharp_tag_is_never_wrong_with_a_small_covariance() -> None:
    assert wrong_share(0.1, watched=True) == 0.0


def test_the_other_pose_of_a_poor_tag_stays_within_reach() -> None:
    alone, watched = (wrong_share(0.3, each) for each in (False, True))
    assert alone > 0.15
    assert watched < 0.3 * alone
