"""A target that carries a tag: found by the tag in the first images, and measured by it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.assembly.camera_poses import camera_poses
from vergence.assembly.law_context import LawContext
from vergence.assembly.started_driver import StartedDriver
from vergence.cell import Cell
from vergence.cell.schema import AdvanceTable, SwitchTable, TagTable
from vergence.errors import Absent, InputError
from vergence.estimation import NoPose, PoseFit, pose_from_points, view_of
from vergence.geometry import matrix_to_rpy, se3, se3_compose, se3_inverse, so3_exp
from vergence.signals import Frame, ImagePoints, Outcome, OutcomeKind
from vergence.simulation import placement_pose
from vergence.vision.marks import MarkerDetector, OneTag, one_tag, seen_instead

_COUNT = 4
_REHEARSED = 0.3  # share of the image's height that a tag takes in a rehearsal
_TILT = 0.4  # and how it is tilted, rad: straight on, its pose would stay open
_KNOWN = 3.0  # standard deviations of the first pose that the start is believed to


class TagFinder:
    """Finds a tag in whole images; a `Measure` and a `Find` of perception.

    Whatever is asked of one frame, its image is searched once.

    Args:
        tag: which.
    """

    def __init__(self, tag: TagTable) -> None:
        self._detector, self._tag = MarkerDetector(tag.dictionary), tag
        self._frame: Frame | None = None  # the last, and what it shows
        self._seen: OneTag | str = ""

    def tag(self, frame: Frame) -> OneTag | str:
        """Return the tag, or why it is not found."""
        if frame is not self._frame:
            assert frame.image is not None
            self._seen = one_tag(self._detector, frame.image, self._tag.id)
            self._frame = frame
        return self._seen

    def refusal(self, frame: Frame, source: str, key: str, where: str, shown: str) -> InputError:
        """Return the error that a frame without the tag is, and what it shows instead.

        Args:
            frame: that does not show it.
            source: the cell file.
            key: in it.
            where: it was searched for, such as "by camera eye at the start".
            shown: where it has to be, such as "in view".
        """
        given = Absent(f"{self.tag(frame)} {where}; {self.seen_instead(frame)}")
        allowed = f"one marker {self._tag.id} of {self._tag.dictionary} {shown}"
        return InputError(source, key, given, allowed)

    def seen_instead(self, frame: Frame) -> str:
        """Return in words which markers an image shows."""
        assert frame.image is not None
        return seen_instead(self._detector, frame.image)

    def __call__(
        self,
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        """Return the corners asked for, see `vergence.estimation.Measure`.

        They are searched for in the whole image: a number tells the tag from all else.
        """
        found = self.find(frame)
        if found is None:
            return _none(frame, len(features), str(self.tag(frame)))
        return ImagePoints(
            frame.camera,
            frame.time,
            found.points_px[features],
            found.covariance_px[features],
            found.found[features],
            ("",) * len(features),
        )

    def find(self, frame: Frame, _T_camera_target: FloatArray | None = None) -> ImagePoints | None:
        """Return all corners wherever they are in an image, or None; see `Find`."""
        tag = self.tag(frame)
        if isinstance(tag, str):
            return None
        seen = np.ones(_COUNT, dtype=np.bool_)
        reasons = ("",) * _COUNT
        return ImagePoints(frame.camera, frame.time, *tag, seen, reasons)


class Located(NamedTuple):
    """A cell whose target is where its tag was found, or why the task ends before it begins."""

    context: LawContext
    outcome: Outcome | None


def located(context: LawContext, driver: StartedDriver) -> Located:
    """Put the target of a cell where the first images show its tag.

    Nothing but its carrier knows where a target is that an arm holds; there its placement counts,
    and so it does in a task that does not look.

    Raises:
        InputError: if no camera shows the tag.
    """
    cell = context.cell
    idle = isinstance(cell.task, AdvanceTable | SwitchTable)
    if cell.target.tag is None or cell.target.carried_by is not None or idle:
        return Located(context, None)
    fit = _first_pose(context, driver, TagFinder(cell.target.tag))
    if isinstance(fit, NoPose):
        # For points in an image it matters little which of two poses it is: their depth is the
        # same to some percent.
        if not fit.alternatives or cell.task.kind == "follow":
            return Located(context, Outcome(OutcomeKind.TARGET_LOST, fit.reason, 0.0))
        fit = fit.alternatives[0]
    return Located(_placed(context, fit), None)


def _first_pose(context: LawContext, driver: StartedDriver, finder: TagFinder) -> PoseFit | NoPose:
    """Return the pose of the target by the first images of all cameras."""
    tag, source = context.cell.target.tag, str(context.cell.path)
    assert tag is not None
    camera_pose, views = camera_poses(context), []
    for name, frame in driver.frames.items():
        found = finder.find(frame)
        if found is not None:
            T_world_camera = camera_pose(name, frame.joints)
            points = np.array(tag.corners)
            views.append(view_of(found, context.cameras[name], T_world_camera, points))
    if views:
        return pose_from_points(views)
    frame = driver.frames[context.cell.task.camera]
    where = f"by camera {frame.camera} at the start"
    raise finder.refusal(frame, source, "target.tag", where, "in view")


def _placed(context: LawContext, fit: PoseFit) -> LawContext:
    """Return the context with the target at a pose, known as well as it is."""
    T, deviations = fit.T_world_target, np.sqrt(np.diag(fit.covariance))
    perception = context.cell.perception.model_copy(
        update={
            "start_error_m": _KNOWN * float(deviations[:3].max()),
            "start_error_deg": _KNOWN * float(np.rad2deg(deviations[3:].max())),
        }
    )
    context.model.move_target(T)
    context.model.update()
    cell = context.cell.with_target(**_placement(T))
    cell = cell.model_copy(update={"perception": perception})
    return replace(context, cell=cell)


def with_tag_in_view(cell: Cell) -> Cell:
    """Return a cell whose tag rests before the task's camera, for a rehearsal in simulation.

    A cell for a robot need not say where the tag is, and the rehearsal has to see it.
    """
    from vergence.simulation.cell_model import CellModel

    tag = cell.target.tag
    if tag is None or cell.target.carried_by is not None:
        return cell
    model = CellModel(cell)
    lens = model.cameras[cell.task.camera]
    away = tag.size_m * lens.fy / (_REHEARSED * lens.height)
    T_camera_tag = se3(so3_exp(np.array([np.pi - _TILT, 0.0, 0.0])), np.array([0.0, 0.0, away]))
    T_camera_target = se3_compose(T_camera_tag, se3_inverse(placement_pose(tag)))
    T = se3_compose(model.camera_pose(cell.task.camera), T_camera_target)
    return cell.replace(target={"motion": {"kind": "stationary"}, **_placement(T)})


def _placement(T: FloatArray) -> dict[str, tuple[float, ...]]:
    """Return the keys of a cell file for a pose (4, 4)."""
    yaw, pitch, roll = np.degrees(matrix_to_rpy(np.ascontiguousarray(T[:3, :3]))).tolist()
    return {"position_m": tuple(T[:3, 3].tolist()), "rotation_rpy_deg": (roll, pitch, yaw)}


def _none(frame: Frame, count: int, why: str) -> ImagePoints:
    """Return points of which none is found."""
    return ImagePoints(
        frame.camera, frame.time, np.full((count, 2), np.nan), np.tile(np.eye(2), (count, 1, 1)),
        np.zeros(count, dtype=np.bool_), (why,) * count,
    )  # fmt: skip
