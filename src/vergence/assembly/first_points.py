"""Where a camera sees the features of a task in its first image, and what follows them."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.assembly.law_context import LawContext
from vergence.assembly.own_parts import started_tracker
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tag import TagFinder
from vergence.cell.schema import TrackTable
from vergence.errors import InputError, listed
from vergence.estimation import TrackedPoints
from vergence.geometry import se3_inverse, transform_points
from vergence.parts import kind_of
from vergence.runtime.stages import Perception
from vergence.signals import Frame
from vergence.simulation import ExactPoints, SimulatedDriver
from vergence.vision import PointTracker

_WINDOW_PX = 32.0  # of the tracker, at the finest level
_LEAST_RADIUS_PX = 1.0  # within which a predicted place is as good as a measured one


def first_points(
    context: LawContext, key: str, camera: str, driver: StartedDriver, images: bool
) -> tuple[FloatArray, Perception]:
    """Return the features in the first image of a camera, (M, 2), and what tracks them from there.

    Args:
        context: of the cell, with the target at its placement.
        key: of the cell file that describes what the camera looks at.
        camera: its name.
        driver: has the first image.
        images: whether it carries an image; if not, the features are exact projections.

    Raises:
        InputError: if a feature is not in sight, or too few can be picked.
    """
    frame = driver.frames[camera]
    now = max(frame.time, 0.0)
    if any(begin <= now < end for begin, end in context.cell.cameras[camera].blind_s):
        given = f"at the start camera {camera} is blind, by cameras.{camera}.blind_s"
        raise InputError(
            str(context.cell.path), key, given, "a camera that is not blind at the start"
        )
    if not images:
        return _exact_points(context, key, camera, frame)
    assert frame.image is not None
    points_px = _given_points(context, camera)
    if points_px is None and _shows_tag(context, camera):
        points_px = _tag_points(context, camera, frame)
    elif points_px is None and _are_known(context, camera):
        points_px = _predicted_points(context, key, camera, frame.image)
    elif points_px is None:
        points_px = _pick(context, camera, frame.image)
    assert isinstance(context.cell.task, TrackTable)
    tracker = started_tracker(context, context.cell.task.tracker, frame.image, points_px)
    if context.curve is not None:
        points_px = _first_curve(context, tracker, frame.image)
    elif not _are_known(context, camera) and isinstance(driver.driver, SimulatedDriver):
        driver.driver.anchor(camera, points_px)  # so that reports know where they truly are
    return points_px, TrackedPoints(camera, tracker, len(points_px))


def _first_curve(context: LawContext, tracker: PointTracker, image: ImageArray) -> FloatArray:
    """Return the points (M, 2) that represent a curve where its tracker finds it.

    Raises:
        InputError: if it does not.
    """
    tracks = tracker.track(image)
    if not tracks.found.all():
        given = f"{kind_of(context.curve)}, {next(filter(None, tracks.reasons))} in the first image"
        raise InputError(str(context.cell.path), "task.tracker", given, "a curve in view")
    return tracks.points_px


def _exact_points(
    context: LawContext, key: str, camera: str, frame: Frame
) -> tuple[FloatArray, Perception]:
    """Return what a simulated camera truly sees."""
    task, rng = context.cell.task, np.random.default_rng([context.cell.seed, 3])
    noise_px = task.noise_px if isinstance(task, TrackTable) else 0.0
    perception = ExactPoints(camera, noise_px, rng)
    observation = perception.observe((frame,))
    assert observation is not None
    view = observation.views[-1]
    if not view.found.all():
        missing = np.flatnonzero(~view.found)
        if _are_known(context, camera):
            raise _out_of_sight(context, key, camera, missing)
        given = f"at the start it does not fill the middle of camera {camera}'s image: "
        given += _whereabouts(context, camera)
        source = str(context.cell.path)
        raise InputError(source, "target", given, "features, or a start in front of the target")
    return view.points_px, perception


def _are_known(context: LawContext, camera: str) -> bool:
    """Return whether the file names the features that a camera looks at."""
    tool = context.cell.tool
    at_tool = tool is not None and tool.camera == camera
    return at_tool or context.cell.target.features is not None


def _shows_tag(context: LawContext, camera: str) -> bool:
    """Return whether a camera looks at a target with a tag rather than at a tool."""
    tool = context.cell.tool
    return context.cell.target.tag is not None and (tool is None or tool.camera != camera)


def _tag_points(context: LawContext, camera: str, frame: Frame) -> FloatArray:
    """Return where the corners of the target's tag are, wherever it is in the image.

    Raises:
        InputError: if it is not seen, or is not the only one of its number.
    """
    tag = context.cell.target.tag
    assert tag is not None
    finder = TagFinder(tag)
    found = finder.tag(frame)
    if isinstance(found, str):
        source, where = str(context.cell.path), f"by camera {camera} at the start"
        raise finder.refusal(frame, source, "target.tag", where, "in view")
    return found.corners_px


def _given_points(context: LawContext, camera: str) -> FloatArray | None:
    """Return the features in pixels, if the file says where they are."""
    task = context.cell.task
    if not isinstance(task, TrackTable) or task.points_px is None or camera != task.camera:
        return None
    points, lens = np.array(task.points_px, dtype=np.float64), context.cameras[camera]
    known, source = context.cell.target.features, str(context.cell.path)
    if context.curve is None and known is not None and len(known) != len(points):
        given, allowed = f"{len(points)} points", f"{len(known)}, as target.features"
        raise InputError(source, "task.points_px", given, allowed)
    if not lens.contains(points).all():
        allowed = f"points inside {lens.width} x {lens.height}"
        raise InputError(source, "task.points_px", task.points_px, allowed)
    return points


def _predicted_points(context: LawContext, key: str, camera: str, image: ImageArray) -> FloatArray:
    """Return where known features are by the placements, or the corners next to them.

    As far as the placement of the target is uncertain, the strongest corner near the predicted
    place is the feature.
    """
    points, lens = context.features_in_camera(camera), context.cameras[camera]
    in_world = transform_points(context.model.camera_pose(camera), points)
    visible = (points[:, 2] > 1e-3) & lens.in_view(points)
    visible[visible] &= context.model.sees(camera, in_world[visible])
    if not visible.all():
        raise _out_of_sight(context, key, camera, np.flatnonzero(~visible))
    points_px = lens.project(points)
    distance, angle = context.cell.placement_error
    away = distance + np.deg2rad(angle) * np.ptp(points, axis=0).max()
    radius = float((lens.focal_px.max() * away / points[:, 2]).max())
    exact = radius < _LEAST_RADIUS_PX or context.curve is not None
    return points_px if exact else _corners_near(image, points_px, radius)


def _corners_near(image: ImageArray, points_px: FloatArray, radius_px: float) -> FloatArray:
    """Return the strongest corner within a radius of each place (M, 2); the place without one."""
    from vergence.vision import pick_features

    v, u = np.indices(image.shape)
    found = points_px.copy()
    for j, (x, y) in enumerate(points_px):
        near = (u - x) ** 2 + (v - y) ** 2 <= radius_px**2
        corners = pick_features(image, 1, near, 1.0).points_px
        if len(corners):
            found[j] = corners[0]
    return found


def _out_of_sight(context: LawContext, key: str, camera: str, missing: IntArray) -> InputError:
    """Return which features a camera does not see, and why."""
    which = f"feature{'s' if len(missing) > 1 else ''} {listed([str(j) for j in missing])}"
    why = _reason(context, camera, missing)
    given = f"at the start camera {camera} does not see {which}{why}"
    allowed = "a start from which the camera sees every feature"
    return InputError(str(context.cell.path), key, given, allowed)


def _reason(context: LawContext, camera: str, missing: IntArray) -> str:
    points = context.features_in_camera(camera)[missing]
    points = points[(points[:, 2] > 1e-3) & context.cameras[camera].in_view(points)]
    if not len(points):
        return f", which {'is' if len(missing) == 1 else 'are'} out of its image"
    in_world = transform_points(context.model.camera_pose(camera), points)
    return f"; in the way: {', '.join(context.model.in_the_way(camera, in_world))}"


def _pick(context: LawContext, camera: str, image: ImageArray) -> FloatArray:
    """Choose features in the middle of the image, on the target as it is placed."""
    task = context.cell.task
    assert isinstance(task, TrackTable)
    if context.curve is not None:
        given = f"nothing, for the tracker {kind_of(task.tracker)}"
        allowed = "where its curve is in the first image, or target.features on it"
        raise InputError(str(context.cell.path), "task.points_px", given, allowed)
    points = _far_apart(context, camera, image, task.feature_count)
    if len(points) < task.feature_count:
        raise InputError(
            str(context.cell.path),
            "task.feature_count",
            task.feature_count,
            f"at most {len(points)}: no more good features of the target are in the first image",
        )
    return points[: task.feature_count]


def _far_apart(context: LawContext, camera: str, image: ImageArray, count: int) -> FloatArray:
    """Pick points of the target as far apart as it offers: close together they fix no pose."""
    from vergence.vision import pick_features

    height, width = image.shape
    for apart_px in (height / 4, height / 8, height / 16, 16.0):
        picked = pick_features(image, 4 * count, _middle(width, height), apart_px).points_px
        points: FloatArray = picked[_on_target(context, camera, picked)]
        if len(points) >= count:
            break
    return points


def _on_target(context: LawContext, camera: str, points_px: FloatArray) -> BoolArray:
    """Return the mask of the points whose windows lie wholly on the target."""
    corners = points_px[:, None] + _WINDOW_PX / 2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    depth = context.model.anchor(camera, corners.reshape(-1, 2))[:, 2].reshape(-1, 4)
    on: BoolArray = np.isfinite(depth.sum(axis=1))  # NaN where the target is not met
    return on


def _middle(width: int, height: int) -> BoolArray:
    """Return a mask of the middle of the image: what is picked there has room to move."""
    mask = np.zeros((height, width), dtype=np.bool_)
    mask[height // 4 : height - height // 4, width // 4 : width - width // 4] = True
    return mask


def _whereabouts(context: LawContext, camera: str) -> str:
    """Return where the target's placement is, as the camera sees it."""
    model = context.model
    x, y, z = (se3_inverse(model.camera_pose(camera)) @ model.target_pose())[:3, 3]
    side = "ahead" if z > 0 else "behind"
    return f"it is {abs(z):.2f} m {side}, {x:.2f} m to the right, {y:.2f} m down"
