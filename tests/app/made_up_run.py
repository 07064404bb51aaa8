"""A run that never was: a textured square wanders through a camera's image, an arm sways."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.runtime import ArmInfo, RunInfo, TickRecord
from vergence.runtime.recording import Recorder
from vergence.signals import (
    Frame,
    FrameTruth,
    ImagePoints,
    JointCommand,
    JointState,
    Observation,
    Outcome,
    OutcomeKind,
    Reference,
    Sample,
)

CAMERA = Camera(320, 240, 400.0, 400.0, 159.5, 119.5)
CORNERS_PX = np.array([[-30.0, -30.0], [30.0, -30.0], [30.0, 30.0], [-30.0, 30.0]])
MIDDLE_PX = np.array([159.5, 119.5])
LIMITS = np.array([2.8, 2.0, 2.4, 1.9, 1.7, np.inf])
INFO = RunInfo(
    cell="made-up",
    text='name = "made-up"\nduration_s = 6.0\n',
    seed=3,
    arms={"puma": ArmInfo(tuple(f"joint{k}" for k in range(1, 7)), -LIMITS, LIMITS, np.ones(6))},
    cameras={"wrist": CAMERA},
)
COMPLETED = Outcome(OutcomeKind.COMPLETED, "the target was followed to the end", 6.0)


def ticks(
    duration: float = 6.0, rate_hz: float = 30.0, images: bool = True, seed: int = 3
) -> Iterator[TickRecord]:
    """Yield a run's ticks; the fourth point is lost for a while in the last third."""
    rng = np.random.default_rng(seed)
    texture = rng.integers(60, 255, (61, 61), dtype=np.uint8)
    for time in np.arange(0.0, duration, 1 / rate_hz).tolist():
        yield _tick(time, duration, texture if images else None, rng)


def record(folder: Path, outcome: Outcome = COMPLETED, **choices: object) -> Path:
    """Record such a run and return its folder."""
    recorder = Recorder(folder)
    recorder.begin(INFO)
    for tick in ticks(**choices):
        recorder.tick(tick)
    recorder.event(2.0, "target stopped", "the target came to rest")
    recorder.event(4.0, "feature lost", "point 4 of wrist: the residual is too large")
    recorder.close(outcome, {"duration_s": 6.0, "real_time_factor": 5.5})
    return folder


def renamed(tick: TickRecord, arm: str, camera: str) -> TickRecord:
    """Return a tick of an arm of two joints and a camera with other names."""
    (state,), (frame,) = tick.sample.joints.values(), tick.sample.frames
    assert tick.observation is not None
    (view,) = tick.observation.views
    two = JointState(state.time, state.position[:2], state.velocity[:2])
    command = replace(tick.commands["puma"], velocity=state.velocity[:2])
    return replace(
        tick,
        sample=Sample(tick.time, {arm: two}, (replace(frame, camera=camera, joints={}),)),
        observation=Observation(tick.time, (view._replace(camera=camera),)),
        commands={arm: command},
    )


def _tick(
    time: float, duration: float, texture: ImageArray | None, rng: np.random.Generator
) -> TickRecord:
    q, rates = _joints(time)
    true_px = _middle(time) + CORNERS_PX
    lost = 0.66 < time / duration < 0.75
    view = ImagePoints(
        "wrist",
        time,
        true_px + rng.normal(0, 0.1, (4, 2)),
        np.tile(0.01 * np.eye(2), (4, 1, 1)),
        np.array([True, True, True, not lost]),
        ("", "", "", "the residual is too large" if lost else ""),
    )
    image = None if texture is None else drawn_image(_middle(time), texture)
    frame = Frame("wrist", time, image, {"puma": q}, _truth(time, true_px))
    command = JointCommand(
        rates,
        np.concatenate([0.1 * rates[:3], 0.2 * rates[3:]]),
        0.4 + 0.1 * np.cos(time),
        0.8 + 0.1 * np.sin(time),
        ("joint rates",) if abs(rates[2]) > 0.4 else (),
        slack={"view": 0.3 * time / duration} if 2.0 < time < 2.5 else {},
    )
    return TickRecord(
        time,
        Sample(time, {"puma": JointState(time, q, rates)}, (frame,)),
        Observation(time, (view,)),
        Reference(time, points_px=MIDDLE_PX + CORNERS_PX),
        {"puma": command},
    )


def _joints(time: float) -> tuple[FloatArray, FloatArray]:
    frequency = np.linspace(0.4, 1.2, 6)
    amplitude = np.linspace(1.2, 0.3, 6)
    return amplitude * np.sin(frequency * time), amplitude * frequency * np.cos(frequency * time)


def _middle(time: float) -> FloatArray:
    away = 40.0 * np.exp(-0.6 * time)
    return MIDDLE_PX + away * np.array([np.cos(2 * time), 0.6 * np.sin(2 * time)])


def _truth(time: float, true_px: FloatArray) -> FrameTruth:
    target, camera = np.eye(4), np.eye(4)
    target[:3, 3] = [0.5 + 0.05 * time, 0.1 * np.sin(time), 0.2]
    camera[:3, 3] = target[:3, 3] + [0.0, 0.02 * np.exp(-time), 0.6]
    return FrameTruth(target, camera, true_px, np.full(4, 0.6), np.ones(4, dtype=bool))


def drawn_image(middle_px: FloatArray, texture: ImageArray) -> ImageArray:
    """Return an image with the texture's middle at a pixel, to a fraction of one."""
    import cv2

    shift = middle_px - (np.array(texture.shape[::-1]) - 1) / 2
    motion = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
    size = (CAMERA.width, CAMERA.height)
    ground = cv2.warpAffine(texture, motion, size, borderValue=40.0)
    return np.asarray(ground, dtype=np.uint8)
