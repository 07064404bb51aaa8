"""The closed loop as a kernel: thousands of runs without Python, and what each of them comes to."""

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera import image_tick
from vergence.control import (
    guarded_step,
    guarded_steps,
    optimal_tracking_tick,
    unpack_chain,
)
from vergence.robot.chain import Axes, tip_frame
from vergence.runtime.schedule import command_share

COMPLETED, IMAGE_LATE, TARGET_LOST, SINGULAR, STUCK = range(5)  # how a run ends
_IN_FRONT_M = 1e-3  # depth from which a feature can be seen


class LoopInputs(NamedTuple):
    """All that a run depends on; with one axis more in front, that of many runs."""

    weights: FloatArray  # (27,) of `pack_setup`
    joints: FloatArray  # (m + 1, 5, 4) of `pack_setup`
    limits: FloatArray  # (4, n) q_min, q_max, rate_max, acceleration_max
    start: FloatArray  # (n,) joint positions
    features: FloatArray  # (M, 3) in the target's frame, m
    desired: FloatArray  # (M, 3) x and y in normalized coordinates, and the believed depth, m
    camera: FloatArray  # (6,) width, height, fx, fy, cx, cy
    T_world_target: FloatArray  # (K, 4, 4) at the time of each image
    arrived: BoolArray  # (K,) whether an image ever arrives
    noise_px: FloatArray  # (K, M, 2) on the features found in it
    rates_hz: FloatArray  # (2,) of set-points and of images
    latency: IntArray  # (1,) from exposure to arrival, images
    ends_s: FloatArray  # (4,) duration, and of `Timeouts` image_s, target_s, decay_s
    singular_below: FloatArray  # (1,) smallest singular value of J at which the run ends


class LoopRecord(NamedTuple):
    """What is kept of a run, rows an image; with one axis more in front, of many runs."""

    position: FloatArray  # (K, n) of the joints
    rates: FloatArray  # (K, n) asked for until the next image, before an old command decays
    camera_m: FloatArray  # (K, 3) place of the camera in the world
    points_px: FloatArray  # (K, M, 2) true; NaN behind the camera
    stuck: BoolArray  # (n,) joints that a limit held back all the last period
    end: FloatArray  # (4,) see `closed_loop`


@njit(cache=True, error_model="numpy")
def project(
    tip: Axes, T: FloatArray, features: FloatArray, camera: FloatArray, points_px: FloatArray
) -> None:
    """Fill points_px (M, 2) with where a camera at the tip sees features of a target at T."""
    x, y, z, p = tip
    for j in range(len(features)):
        a, b, c = features[j, 0], features[j, 1], features[j, 2]
        u = T[0, 0] * a + T[0, 1] * b + T[0, 2] * c + T[0, 3] - p[0]
        v = T[1, 0] * a + T[1, 1] * b + T[1, 2] * c + T[1, 3] - p[1]
        w = T[2, 0] * a + T[2, 1] * b + T[2, 2] * c + T[2, 3] - p[2]
        depth = z[0] * u + z[1] * v + z[2] * w
        if depth > _IN_FRONT_M:
            right, down = x[0] * u + x[1] * v + x[2] * w, y[0] * u + y[1] * v + y[2] * w
            points_px[j, 0] = right / depth * camera[2] + camera[4]
            points_px[j, 1] = down / depth * camera[3] + camera[5]
        else:
            points_px[j, :] = np.nan


@njit(cache=True, error_model="numpy")
def look(
    points_px: FloatArray,
    noise_px: FloatArray,
    desired: FloatArray,
    camera: FloatArray,
    found: FloatArray,
) -> int:
    """Fill rows of found (M, 5) for `image_model` from an image; return how many."""
    count = 0
    for j in range(len(points_px)):
        u, v = points_px[j, 0], points_px[j, 1]
        if -0.5 <= u < camera[0] - 0.5 and -0.5 <= v < camera[1] - 0.5:
            found[count, 0] = (u + noise_px[j, 0] - camera[4]) / camera[2]
            found[count, 1] = (v + noise_px[j, 1] - camera[5]) / camera[3]
            for i in range(3):
                found[count, 2 + i] = desired[j, i]
            count += 1
    return count


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


@njit(cache=True, error_model="numpy")
def closed_loop(run: LoopInputs, record: LoopRecord) -> tuple[int, int, int, float]:
    """Run [Nelson1995] in the loop, on an arm that follows commands exactly.

    It is `vergence.runtime.Loop` on a `KinematicDriver`, decision by decision, by the same kernels.

    Returns:
        One of the codes above, the inner tick, how many images had been looked at had all
        arrived, and what ended it: the singular value, or for how many seconds nothing was seen.
    """
    q, velocity = run.start.copy(), np.zeros(len(run.start))
    answer, rates = np.zeros(len(q) + 10), np.zeros(len(q))
    found = np.empty((len(run.features), 5))
    chain = unpack_chain(run.joints)
    inner_hz, outer_hz = run.rates_hz[0], run.rates_hz[1]
    duration, image_s, target_s, decay_s = (
        run.ends_s[0],
        run.ends_s[1],
        run.ends_s[2],
        run.ends_s[3],
    )
    tick, last_image, last_seen = 0, 0.0, 0.0
    end = int(np.floor(duration * inner_hz + 0.5))  # the tick nearest to the end
    for k in range(len(run.arrived)):
        time, seen = tick / inner_hz, k - run.latency[0]
        if tick >= end:
            return COMPLETED, tick, seen, 0.0
        tip = tip_frame(chain, q)
        record.position[k], record.rates[k] = q, 0.0
        record.camera_m[k, 0], record.camera_m[k, 1], record.camera_m[k, 2] = tip[3]
        project(tip, run.T_world_target[k], run.features, run.camera, record.points_px[k])
        if seen >= 0 and run.arrived[seen]:
            last_image = time
            image, noise = record.points_px[seen], run.noise_px[seen]
            count = look(image, noise, run.desired, run.camera, found)
            if count > 0:
                last_seen = time
                optimal_tracking_tick(run.weights, run.joints, q, found[:count], answer)
                rates[:] = answer[: len(q)]
                sigma = answer[len(q) + 9]
                if sigma < run.singular_below[0]:
                    return SINGULAR, tick, seen + 1, sigma
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
    return COMPLETED, tick, len(run.arrived) - run.latency[0], 0.0


@njit(cache=True, error_model="numpy")
def run_one(runs: LoopInputs, records: LoopRecord, r: int) -> None:
    """Make run r of many."""
    run = LoopInputs(
        runs.weights[r],
        runs.joints[r],
        runs.limits[r],
        runs.start[r],
        runs.features[r],
        runs.desired[r],
        runs.camera[r],
        runs.T_world_target[r],
        runs.arrived[r],
        runs.noise_px[r],
        runs.rates_hz[r],
        runs.latency[r],
        runs.ends_s[r],
        runs.singular_below[r],
    )
    record = LoopRecord(
        records.position[r],
        records.rates[r],
        records.camera_m[r],
        records.points_px[r],
        records.stuck[r],
        records.end[r],
    )
    code, tick, images, value = closed_loop(run, record)
    record.end[0], record.end[1], record.end[2], record.end[3] = code, tick, images, value


@njit(cache=True, error_model="numpy")
def closed_loops(runs: LoopInputs, records: LoopRecord) -> None:
    """Make many runs, one after the other."""
    for r in range(len(runs.start)):
        run_one(runs, records, r)


@njit(cache=True, error_model="numpy", parallel=True)
def closed_loops_parallel(runs: LoopInputs, records: LoopRecord) -> None:
    """Make many runs on as many cores as numba may use."""
    for r in prange(len(runs.start)):
        run_one(runs, records, r)
