"""From a cell file to a finished run: choose the parts, run the loop, tell the listeners."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell, SimulatedDriver
from vergence.control import Law, OptimalTrackingLaw
from vergence.errors import InputError
from vergence.estimation.exact_points import ExactPoints
from vergence.estimation.tracked_points import TrackedPoints
from vergence.outcome import Outcome
from vergence.planning import FixedReference, Reference
from vergence.runtime.loop import Loop, Patience
from vergence.runtime.recording import Listener, RunInfo
from vergence.runtime.stages import Perception
from vergence.runtime.summary import Summary


@dataclass(frozen=True, slots=True)
class RunResult:
    """What came of a run."""

    outcome: Outcome
    summary: dict[str, float] = field(default_factory=dict)


def run_cell(cell: Cell, listeners: Sequence[Listener] = (), images: bool = True) -> RunResult:
    """Run a cell in simulation.

    Args:
        cell: what to run.
        listeners: hear of every tick, such as a recorder.
        images: look through rendered images; if not, at exact projections.

    Raises:
        InputError: if the cell cannot be run as it is written.
        RenderingError: if there is nothing to render with.
    """
    driver = SimulatedDriver(cell, images)
    try:
        return _run(cell, driver, listeners, images)
    finally:
        driver.close()


def _run(
    cell: Cell, driver: SimulatedDriver, listeners: Sequence[Listener], images: bool
) -> RunResult:
    points_px, perception = _look(cell, driver, images)
    desired = _desired_points(cell, driver, points_px)
    summary = Summary(cell.task.camera)
    everyone = (summary, *listeners)
    loop = Loop(
        driver,
        cell.task.arm,
        perception,
        FixedReference(Reference(0.0, desired)),
        build_law(cell, driver),
        outer_rate_hz=cell.outer_rate_hz,
        listeners=everyone,
        patience=Patience(image_s=cell.task.image_timeout_s),
    )
    info = RunInfo.of(driver, cell.name, cell.text, cell.seed, cell.task.camera)
    for listener in everyone:
        listener.begin(info)
    began = time.perf_counter()
    outcome = loop.run(cell.duration_s)
    values = dict(summary.values)
    values["duration_s"] = outcome.time
    values["real_time_factor"] = outcome.time / max(time.perf_counter() - began, 1e-9)
    for listener in everyone:
        listener.close(outcome, values)
    return RunResult(outcome, values)


def build_law(cell: Cell, driver: SimulatedDriver) -> Law:
    """Make the law that a cell asks for."""
    table, name = cell.law, cell.task.camera
    truth = driver.first_frame(name).truth
    assert truth is not None
    depth = truth.depth_m if table.depth_m == "initial" else np.full(
        len(truth.depth_m), table.depth_m
    )
    if isinstance(table.R, tuple) and len(table.R) != len(table.axes):
        raise InputError(
            str(cell.path), "law.R", f"{len(table.R)} weights", f"one, or {len(table.axes)}"
        )
    if extra := set(table.avoidance_axes) - set(table.axes):
        raise InputError(
            str(cell.path), "law.avoidance_axes", ", ".join(sorted(extra)), "a subset of law.axes"
        )
    return OptimalTrackingLaw(
        driver.world.arm_to_camera(name),
        driver.cameras[name],
        depth,
        axes=table.axes,
        avoidance_axes=table.avoidance_axes,
        Q=table.Q,
        R=table.R,
        S=table.S,
        period=1.0 / cell.cameras[name].rate_hz,
        penalty=table.penalty,
        penalty_k=table.penalty_k,
        avoidance_speed_max=table.avoidance_speed_max_m_s,
        singular_below=table.singular_below,
    )


def _look(
    cell: Cell, driver: SimulatedDriver, images: bool
) -> tuple[FloatArray, Perception]:
    """Find the features in the first picture; return where they are and what follows them."""
    name = cell.task.camera
    frame = driver.first_frame(name)
    if cell.target.features is None:
        points_px = _pick(cell, driver, images)
        driver.anchor(name, points_px)
        frame = driver.first_frame(name)
    assert frame.truth is not None
    if not frame.truth.visible.all():
        hidden = ", ".join(str(j) for j in np.flatnonzero(~frame.truth.visible))
        raise InputError(
            str(cell.path),
            "target",
            f"at the start camera {name} does not see feature {hidden} of it",
            "a start from which the camera sees every feature",
        )
    points_px = frame.truth.points_px
    if not images:
        noise = np.random.default_rng([cell.seed, 3])
        return points_px, ExactPoints(name, rng=noise)
    from vergence.vision import SsdTracker

    assert frame.image is not None
    return points_px, TrackedPoints(name, SsdTracker(frame.image, points_px))


def _pick(cell: Cell, driver: SimulatedDriver, images: bool) -> FloatArray:
    """Choose features on the target by themselves: in the picture, or its middle without one."""
    name, count = cell.task.camera, cell.task.feature_count
    image = driver.first_frame(name).image
    camera = driver.cameras[name]
    if image is None:
        return _grid(camera.width, camera.height, count)
    from vergence.vision import pick_features

    picked = pick_features(image, 4 * count)
    on_target = ~np.isnan(driver.anchor(name, picked)).any(axis=1)
    points: FloatArray = picked[on_target]
    if len(points) < count:
        raise InputError(
            str(cell.path),
            "task.feature_count",
            count,
            f"at most {len(points)}: no more good features of the target are in the first picture",
        )
    return points[:count]


def _grid(width: int, height: int, count: int) -> FloatArray:
    """Return points spread over the middle of the picture; one alone in its centre."""
    side = int(np.ceil(np.sqrt(count)))
    share = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(width * (0.25 + 0.5 * share) - 0.5, height * (0.25 + 0.5 * share) - 0.5)
    return np.column_stack((u.ravel(), v.ravel()))[:count]


def _desired_points(cell: Cell, driver: SimulatedDriver, points_px: FloatArray) -> FloatArray:
    """Return s* (M, 2), as the task wants it."""
    wanted = cell.task.desired
    if wanted == "initial":
        return points_px
    camera = driver.cameras[cell.task.camera]
    if wanted == "centred":
        centred: FloatArray = points_px - points_px.mean(axis=0) + (camera.cx, camera.cy)
        return centred
    desired = np.array(wanted, dtype=np.float64)
    if desired.shape != points_px.shape:
        raise InputError(
            str(cell.path), "task.desired", f"{len(desired)} points", f"{len(points_px)} points"
        )
    if not camera.contains(desired).all():
        allowed = f"points inside {camera.width} x {camera.height}"
        raise InputError(str(cell.path), "task.desired", wanted, allowed)
    return desired
