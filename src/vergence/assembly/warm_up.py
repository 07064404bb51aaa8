"""Turns of the loop that move nothing, so that nothing is compiled or loaded while an arm moves."""

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vergence.assembly.copied import copied
from vergence.assembly.parts import Parts
from vergence.assembly.started_driver import StartedDriver
from vergence.control import Guard, InnerLaw, Law
from vergence.runtime.losses import shows_target
from vergence.runtime.stages import Perception, Planner
from vergence.signals import Frame, JointState

_LOG = logging.getLogger(__name__)
# By how much the joints have moved at each image, rad or m: hardly; farther than the images agree
# with; and None where an image shows nothing.
_MOTION = (0.0, 1e-3, 2e-3, 3e-3, 2e-2, 4e-2, None, None, 5e-2, 5e-2)


def warm_up(parts: Parts, arm: str, period_s: float) -> None:
    """Let copies of perception, planner and law look at the first images again and again.

    A kernel is compiled, or loaded from its cache, when it is called first, which takes up to a
    minute: too long for an arm that moves. What contradicts the prediction, or is lost and found
    again, takes other ones, so there are such images as well. A part that cannot be copied is not
    warmed up.

    Args:
        parts: of the run; they are left as they are.
        arm: that is moved.
        period_s: between images.
    """
    try:
        perception, planner, law = copied((parts.perception, parts.planner, parts.law))
        guard = Guard(parts.driver.arms[arm], parts.driver.joints[arm], period_s)
        newest = max(frame.time for frame in parts.driver.frames.values())
        for number, moved in enumerate(_MOTION):
            time = max(newest, 0.0) + number * period_s
            q = parts.driver.joints[arm] + (moved or 0.0)
            joints = JointState(time, q, np.zeros_like(q))
            frames = tuple(_images(parts.driver, time, moved))
            _turn(perception, planner, law, frames, joints, guard)
    except Exception:
        _LOG.info("the run could not be warmed up", exc_info=True)


def _turn(
    perception: Perception,
    planner: Planner,
    law: Law,
    frames: tuple[Frame, ...],
    joints: JointState,
    guard: Guard,
) -> None:
    observation = perception.observe(frames)
    if observation is None:
        return
    reference = planner.reference(observation.time)
    if shows_target(observation):
        guard.step(law.command(observation, reference, joints).velocity)
        if isinstance(law, InnerLaw):
            guard.step(law.follow(guard.setpoint))
    elif isinstance(law, InnerLaw):
        law.hold()


def _images(driver: StartedDriver, time: float, moved: float | None) -> Iterator[Frame]:
    """Give the first image of each camera another time, and joints that have moved."""
    joints = {name: q + (moved or 0.0) for name, q in driver.joints.items()}
    for frame in driver.frames.values():
        seen = frame if moved is not None else _blank(frame)
        yield replace(seen, time=time, joints=joints)


def _blank(frame: Frame) -> Frame:
    image = None if frame.image is None else np.zeros_like(frame.image)
    return replace(frame, image=image)
