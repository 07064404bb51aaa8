"""The closed loop as a kernel: a run without Python, and what it comes to."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import image_tick
from vergence.control import guarded_step, guarded_steps
from vergence.control.point_law import (
    FINE,
    UNDETERMINED,
    LawMemory,
    Moment,
    PointLaw,
    SeenPoints,
    TrackingLaw,
)
from vergence.control.point_law_tick import law_tick
from vergence.robot.chain import forward_kinematics
from vergence.runtime.schedule import command_share
from vergence.simulation.kinematic_driver import IN_FRONT_M, in_camera

# How a run ends, if its law does not end it.
COMPLETED, IMAGE_LATE, TARGET_LOST, STUCK = range(UNDETERMINED + 1, UNDETERMINED + 5)


class LoopInputs(NamedTuple):
    """All that a run depends on."""

    law: PointLaw | TrackingLaw
    memory: LawMemory  # of the law, at the start
    limits: FloatArray  # (4, n) q_min, q_max, rate_max, acceleration_max
    start: FloatArray  # (n,) joint positions
    features: FloatArray  # (M, 3) in the target's frame, m
    camera: FloatArray  # (6,) width, height, fx, fy, cx, cy
    T_world_target: FloatArray  # (K, 4, 4) at the time of each image
    arrived: BoolArray  # (K,) whether an image ever arrives
    noise_px: FloatArray  # (K, M, 2) on the features found in it
    inner_hz: float  # rate of set-points
    outer_hz: float  # of images
    latency: int  # from exposure to arrival, images
    ends_s: FloatArray  # (4,) duration, and of `Timeouts` image_s, target_s, decay_s


class LoopRecord(NamedTuple):
    """What is kept of a run, rows an image."""

    position: FloatArray  # (K, n) of the joints
    velocity: FloatArray  # (K, n)
    rates: FloatArray  # (K, n) asked for until the next image, before an old command decays
    camera_m: FloatArray  # (K, 3) place of the camera in the world
    points_px: FloatArray  # (K, M, 2) true; NaN behind the camera
    stuck: BoolArray  # (n,) joints that a limit held back all the last period


@njit(cache=True, error_model="numpy")
def project(points: FloatArray, camera: FloatArray, points_px: FloatArray) -> None:
    """Fill points_px (M, 2) with where points (M, 3) in the camera frame are in the image."""
    for j in range(len(points)):
        points_px[j, :] = np.nan
        if points[j, 2] > IN_FRONT_M:
            for a in range(2):
                points_px[j, a] = points[j, a] / points[j, 2] * camera[2 + a] + camera[4 + a]


@njit(cache=True, error_model="numpy")
def found_points(
    points_px: FloatArray, noise_px: FloatArray, camera: FloatArray, time: float
) -> SeenPoints:
    """Return what is found in an image that was taken at a time."""
    seen = SeenPoints(time, np.full(points_px.shape, np.nan), np.zeros(len(points_px), np.bool_))
    for j in range(len(points_px)):
        u, v = points_px[j, 0], points_px[j, 1]
        if -0.5 <= u < camera[0] - 0.5 and -0.5 <= v < camera[1] - 0.5:
            seen.points[j, 0] = (u + noise_px[j, 0] - camera[4]) / camera[2]
            seen.points[j, 1] = (v + noise_px[j, 1] - camera[5]) / camera[3]
            seen.found[j] = True
    return seen


@njit(cache=True, error_model="numpy")
def faded_step(
    q: FloatArray,
    velocity: FloatArray,
    rates: FloatArray,
    limits: FloatArray,
    dt: float,
    stuck: BoolArray,
) -> None:
    """Take one guarded step in place; joints stay stuck as long as a limit holds them back."""
    step = guarded_step(q, velocity, rates, limits, dt)
    q[:], velocity[:] = step.position, step.velocity
    stuck &= step.at_limit


@njit(cache=True, error_model="numpy", nogil=True)
def closed_loop(run: LoopInputs, record: LoopRecord) -> tuple[int, int, int, float]:
    """Run a law in the loop, on an arm that follows commands exactly.

    It is `vergence.runtime.Loop` on a `KinematicDriver`, decision by decision, by the same kernels.

    Returns:
        A code, of the above or of the law's last tick, the inner tick, how many images had been
        looked at had all arrived, and the value behind the code: that of the last tick, or for how
        many seconds nothing was seen.
    """
    q, velocity, rates = run.start.copy(), np.zeros(len(run.start)), np.zeros(len(run.start))
    law, memory, chain = run.law, run.memory, run.law.chain
    inner_hz, outer_hz = run.inner_hz, run.outer_hz
    duration, image_s, target_s, decay_s = (
        run.ends_s[0],
        run.ends_s[1],
        run.ends_s[2],
        run.ends_s[3],
    )
    tick, last_image, last_seen = 0, 0.0, 0.0
    end = int(np.floor(duration * inner_hz + 0.5))  # the tick nearest to the end
    for k in range(len(run.arrived)):
        time, seen = tick / inner_hz, k - run.latency
        if tick >= end:
            return COMPLETED, tick, seen, 0.0
        T_world_camera = forward_kinematics(chain, q)
        points = in_camera(T_world_camera, run.T_world_target[k], run.features)
        project(points, run.camera, record.points_px[k])
        record.position[k], record.velocity[k], record.rates[k] = q, velocity, 0.0
        record.camera_m[k] = T_world_camera[:3, 3]
        if seen >= 0 and run.arrived[seen]:
            last_image, exposed = time, image_tick(seen, inner_hz, outer_hz) / inner_hz
            image = found_points(record.points_px[seen], run.noise_px[seen], run.camera, exposed)
            if image.found.any():
                last_seen = time
                memory, answer = law_tick(law, memory, Moment(chain, image, q, velocity, time))
                rates[:] = answer.rates
                if answer.end != FINE:
                    return answer.end, tick, seen + 1, answer.value
            else:
                rates[:] = 0.0
                if time - last_seen > target_s:
                    return TARGET_LOST, tick, seen + 1, time - last_seen
        elif time - last_image > image_s:
            return IMAGE_LATE, tick, seen, time - last_image
        record.rates[k] = rates
        due = image_tick(k + 1, inner_hz, outer_hz)
        steps = min(due, end) - tick
        if last_image == time:
            guarded_steps(q, velocity, rates, run.limits, 1.0 / inner_hz, steps, record.stuck)
        else:
            record.stuck[:] = True
            for step in range(steps):
                age_s = (tick + step) / inner_hz - last_image
                share = command_share(age_s, 1.0 / outer_hz, decay_s)
                faded_step(q, velocity, share * rates, run.limits, 1.0 / inner_hz, record.stuck)
        tick += steps
        if tick == due and record.stuck.any():
            return STUCK, tick, seen + 1, 0.0
    return COMPLETED, tick, len(run.arrived) - run.latency, 0.0
