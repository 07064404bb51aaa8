"""The task `track`: features kept where they are wanted in one camera's image."""

from dataclasses import replace

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.assembly.build_law import build_law
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.cell import Cell
from vergence.cell.schema import ToolTable, TrackTable
from vergence.errors import InputError
from vergence.estimation.exact_points import ExactPoints
from vergence.estimation.tracked_points import TrackedPoints
from vergence.geometry import se3_inverse, transform_points
from vergence.planning import FixedReference
from vergence.runtime.several_cameras import SeveralCameras
from vergence.runtime.stages import Perception
from vergence.signals import FrameTruth, Reference
from vergence.simulation import SimulatedDriver

_WINDOW_PX = 32.0  # of the tracker, at the finest level


def track_parts(cell: Cell, task: TrackTable, driver: SimulatedDriver, images: bool) -> Parts:
    """Put together what tracks features in the image."""
    points_px, perception = _look(cell, task, driver, images)
    desired = _desired_points(cell, "task.desired", task, driver, points_px)
    reference, tool = Reference(0.0, desired), task.tool
    seen_px = {task.camera: points_px}
    if tool is not None:
        points_px, second = _follow(cell, "task.tool", tool.camera, driver, images)
        desired = _desired_points(cell, "task.tool.desired", tool, driver, points_px)
        seen_px[tool.camera] = points_px
        reference = replace(reference, elsewhere_px={tool.camera: desired})
        perception = SeveralCameras((perception, second))
    context = LawContext.of(cell, driver, seen_px)
    return Parts(perception, FixedReference(reference), build_law(context), context)


def _look(
    cell: Cell, task: TrackTable, driver: SimulatedDriver, images: bool
) -> tuple[FloatArray, Perception]:
    """Find the features in the first picture; return where they are and what follows them."""
    if cell.target.features is None:
        driver.anchor(task.camera, _pick(cell, task, driver))
    return _follow(cell, "target", task.camera, driver, images)


def _follow(
    cell: Cell, key: str, name: str, driver: SimulatedDriver, images: bool
) -> tuple[FloatArray, Perception]:
    """Return where a camera sees the features that are known, and what follows them from there."""
    frame = driver.first_frame(name)
    assert frame.truth is not None
    if not frame.truth.visible.all():
        raise InputError(
            str(cell.path),
            key,
            f"at the start camera {name} does not see {_unseen(driver, name, frame.truth)}",
            "a start from which the camera sees every feature",
        )
    points_px = frame.truth.points_px
    if not images:
        noise = np.random.default_rng([cell.seed, 3])
        return points_px, ExactPoints(name, rng=noise)
    from vergence.vision import SsdTracker

    assert frame.image is not None
    return points_px, TrackedPoints(name, SsdTracker(frame.image, points_px))


def _unseen(driver: SimulatedDriver, camera: str, truth: FrameTruth) -> str:
    """Say which features a camera does not see, and why."""
    missing = np.flatnonzero(~truth.visible)
    which = "feature " + ", ".join(str(j) for j in missing)
    if any(begin <= 0 < end for begin, end in driver.cell.cameras[camera].blind_s):
        return f"{which}; it is blind then, by cameras.{camera}.blind_s"
    lens, points_px = driver.cameras[camera], truth.points_px[missing]
    inside = (truth.depth_m[missing] > 0) & lens.contains(np.nan_to_num(points_px, nan=-1.0))
    if not inside.any():
        return f"{which}, which is out of its picture"
    rays = np.column_stack((lens.normalize(points_px[inside]), np.ones(inside.sum())))
    points_camera = rays * truth.depth_m[missing[inside], None]
    hiding = driver.world.in_the_way(camera, transform_points(truth.T_world_camera, points_camera))
    return f"{which}; in the way: {', '.join(hiding)}"


def _pick(cell: Cell, task: TrackTable, driver: SimulatedDriver) -> FloatArray:
    """Choose features on the target by themselves: in the picture, or its middle without one."""
    name, count = task.camera, task.feature_count
    image = driver.first_frame(name).image
    camera = driver.cameras[name]
    if image is None:
        points = _grid(camera.width, camera.height, count)
        if np.isnan(driver.anchor(name, points)).any():
            given = f"at the start it does not fill the middle of camera {name}'s picture: "
            given += _whereabouts(driver, name)
            raise InputError(str(cell.path), "target", given, "features, or a start before it")
        return points
    points = _far_apart(image, count, driver, name)
    if len(points) < count:
        raise InputError(
            str(cell.path),
            "task.feature_count",
            count,
            f"at most {len(points)}: no more good features of the target are in the first picture",
        )
    return points[:count]


def _whereabouts(driver: SimulatedDriver, camera: str) -> str:
    """Say where the target's frame is, as the camera sees it."""
    world = driver.world
    x, y, z = (se3_inverse(world.camera_pose(camera)) @ world.target_pose())[:3, 3]
    side = "ahead" if z > 0 else "behind"
    return f"it is {abs(z):.2f} m {side}, {x:.2f} m to the right, {y:.2f} m down"


def _far_apart(image: ImageArray, count: int, driver: SimulatedDriver, camera: str) -> FloatArray:
    """Pick points of the target as far apart as it offers: close together they fix no pose."""
    from vergence.vision import pick_features

    height, width = image.shape
    for apart_px in (height / 4, height / 8, height / 16, 16.0):
        picked = pick_features(image, 4 * count, _middle(width, height), apart_px)
        points: FloatArray = picked.points_px[_on_target(picked.points_px, driver, camera)]
        if len(points) >= count:
            break
    return points


def _on_target(points_px: FloatArray, driver: SimulatedDriver, camera: str) -> BoolArray:
    """Tell whose windows lie on the target alone: what is behind it moves otherwise."""
    corners = points_px[:, None] + _WINDOW_PX / 2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    depth = driver.anchor(camera, corners.reshape(-1, 2))[:, 2].reshape(-1, 4)
    on: BoolArray = np.isfinite(depth.sum(axis=1))  # NaN where the target is not met
    return on


def _middle(width: int, height: int) -> BoolArray:
    """Return a mask of the middle of the picture: what is picked there has room to move."""
    mask = np.zeros((height, width), dtype=np.bool_)
    mask[height // 4 : height - height // 4, width // 4 : width - width // 4] = True
    return mask


def _grid(width: int, height: int, count: int) -> FloatArray:
    """Return points spread over the middle of the picture; one alone in its centre."""
    side = int(np.ceil(np.sqrt(count)))
    share = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(width * (0.25 + 0.5 * share) - 0.5, height * (0.25 + 0.5 * share) - 0.5)
    return np.column_stack((u.ravel(), v.ravel()))[:count]


def _desired_points(
    cell: Cell,
    key: str,
    task: TrackTable | ToolTable,
    driver: SimulatedDriver,
    points_px: FloatArray,
) -> FloatArray:
    """Return s* (M, 2), as the task wants it in its camera."""
    wanted = task.desired
    if wanted == "initial":
        return points_px
    camera = driver.cameras[task.camera]
    if wanted == "centred":
        centred: FloatArray = points_px - points_px.mean(axis=0) + (camera.cx, camera.cy)
        return centred
    desired = np.array(wanted, dtype=np.float64)
    if desired.shape != points_px.shape:
        raise InputError(str(cell.path), key, f"{len(desired)} points", f"{len(points_px)} points")
    if not camera.contains(desired).all():
        allowed = f"points inside {camera.width} x {camera.height}"
        raise InputError(str(cell.path), key, wanted, allowed)
    return desired
