"""Search of whole images for a lost object that may have moved and turned.

A contour of the object is drawn for each of some rotations; a vote finds its best place in a coarse
image, and the pose is fitted at the best few of them. Images are examined in slices, so that a
control loop need not wait.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray, IntArray
from vergence.camera import Camera
from vergence.estimation.known_object.object_tracker import Measurement, ObjectTracker
from vergence.geometry import angle_between, se3, se3_compose, skew, so3_exp
from vergence.vision.known_object.contour_maps import Maps
from vergence.vision.known_object.contour_vote import directions_of, vote_place
from vergence.vision.known_object.look_alikes import centre_of, tried_turns, turns_of

_CELLS = 24.0  # across the object
_MOST_COLUMNS = 160  # of the coarse image
_SCALES = (0.87, 1.0, 1.15)  # of the distance
_REACH = 3.0  # deviations of the prediction within which places are examined
_STALE_RAD = 0.1  # turn of the camera after which a search begins again
_PLACE, _TURN_RAD = 0.12, 0.3  # deviation of a voted pose: relative to the size, and rotation


class SearchPace(NamedTuple):
    """What of a search is done for each image; a search continues in the next ones."""

    drawn: int  # rotations at which the object is drawn, once: 0.1 to 1 ms each
    voted: int  # rotations that are examined: 0.1 ms each
    fits: int  # poses fitted: 1 to 15 ms each


AT_ONCE = SearchPace(1_000_000, 1_000_000, 1_000_000)
IN_A_LOOP = SearchPace(20, 130, 2)


class Near(NamedTuple):
    """Where the prediction has an object."""

    T_camera_target: FloatArray  # (4, 4)
    covariance: FloatArray  # (6, 6) of (δp, δθ) along camera axes, grown since it was seen


class Fit(NamedTuple):
    """A pose of the object in an image."""

    T_camera_target: FloatArray  # (4, 4)
    share: float  # fraction of what should be visible that was found
    expected: int  # places that should be visible
    seen: Measurement


class _Template(NamedTuple):
    """The contour at one rotation, drawn on the optical axis."""

    T_camera_target: FloatArray  # (4, 4)
    cells: FloatArray  # (N, 2) columns and rows from the object's centre
    directions: IntArray  # (N,)


class _Hit(NamedTuple):
    score: float
    template: _Template
    scale: float  # of the distance
    centre_px: FloatArray  # (2,) where the object's centre is seen


@dataclass(slots=True)
class _Round:
    """How far some rotations have been examined."""

    T: FloatArray  # (4, 4) on the optical axis, which is turned
    turns: list[FloatArray]  # (4, 4) each
    templates: list[_Template]  # of the first of them
    fitted: int  # rotations at which the pose is fitted
    refined: int  # of the fitted poses that are fitted again
    examined: int = 0  # rotations
    hits: list[_Hit] = field(default_factory=list)
    fits: list[Fit] = field(default_factory=list)
    again: int = 0  # poses that were fitted again

    @property
    def left(self) -> int:
        """How many fits remain, once all rotations are examined."""
        return len(self.hits) + min(self.refined, len(self.hits) + len(self.fits)) - self.again


class ObjectSearch:
    """Searches images for an object, at any place and at many rotations from its last pose.

    Each rotation is relative to the line of sight, so it covers the change of view of an object
    that has moved aside. When a pose is found, those turned from it under which the object may look
    alike are examined as well.

    Args:
        tracker: measures the object.
        camera: the camera's model.
        pace: how much is done for each image.
        least_share: fraction of what should be visible at which a pose is promising.
    """

    _round: _Round

    def __init__(
        self, tracker: ObjectTracker, camera: Camera, pace: SearchPace, least_share: float
    ) -> None:
        self._tracker, self._camera, self._pace = tracker, camera, pace
        self._least_share = least_share
        self._centre = centre_of(tracker.model)
        # (K, 3) axes of the object, about which its rotation does not show
        self.free_axes = np.ascontiguousarray(tracker.free_motions(np.eye(4))[3:].T)
        self._turns = tried_turns(tracker.model, self.free_axes)
        self._alike = [turn.T_target_turned for turn in turns_of(tracker.model)]
        self.deviation = _PLACE * tracker.model.size, _TURN_RAD  # of a voted pose, m and rad
        self._covariance = np.diag(np.repeat(self.deviation, 3) ** 2)

    def begin(self, T_camera_target: FloatArray, memory: object) -> None:
        """Begin to search for an object.

        Args:
            T_camera_target: last pose, (4, 4).
            memory: appearance of the object.
        """
        camera, self._memory = self._camera, self._tracker.elsewhere(memory)
        self.T_last = T_camera_target
        self._T = self._on_axis(T_camera_target)
        size_px = camera.fx * self._tracker.model.size / self._place(self._T)[2]
        columns = min(_CELLS * camera.width / size_px, _MOST_COLUMNS)
        self._shape = (round(columns * camera.height / camera.width), round(columns))
        self._cell_px = np.array((camera.width, camera.height)) / self._shape[::-1]
        self._templates: list[_Template] = []
        self._start(seen=False)

    def look(self, image: ImageArray, near: Near | None = None) -> list[Fit] | None:
        """Examine an image further.

        Places beyond three deviations of the prediction are left out. An object may appear in the
        middle of a round, when some rotations have been examined already; the first promising pose
        therefore begins another round.

        Args:
            image: of the camera's size.
            near: where the object is predicted; None if it may be anywhere.

        Returns:
            The poses that fit best, best first, at the end of a round; until then None.

        Raises:
            InputError: if the image does not have the camera's size.
        """
        maps = self._tracker.maps(image, self._shape, self._memory)
        self._images += 1
        self._window = self._window_of(near)
        drawn, voted, fits = self._pace
        while True:
            now = self._round
            drawn, voted = self._examine(maps, now, drawn, voted)
            while now.left and fits and now.examined == len(now.turns):
                self._fit_next(image, maps, now)
                fits -= 1
            promising = any(fit.share >= self._least_share for fit in now.fits)
            if promising and self._images > 1 and not self._seen:
                self._start(seen=True)
                return None
            if now.left or now.examined < len(now.turns):
                return None
            if near is not None and now.turns is not self._alike:
                now.fits.append(self._fit(image, near.T_camera_target))
            self._found += now.fits
            if now.turns is self._alike or not (promising or near):
                found = sorted(self._found, key=lambda fit: -fit.share)
                self._start(seen=False)
                return found
            best = max(now.fits, key=lambda fit: fit.share).T_camera_target
            self._round = _Round(self._on_axis(best), self._alike, [], fitted=4, refined=0)

    def again(self, image: ImageArray, fits: Sequence[Fit]) -> list[Fit]:
        """Return the poses fitted once more: a vote is coarse, a first fit may end beside it."""
        return [self._fit(image, fit.T_camera_target) for fit in fits]

    def is_stale(self, T_last: FloatArray) -> bool:
        """Return whether the camera has turned since a search began, which then begins again.

        Args:
            T_last: last pose of the object in the camera as it is now, (4, 4).
        """
        return angle_between(self.T_last, T_last) > _STALE_RAD

    @property
    def promising(self) -> bool:
        """Whether a promising pose was found before this round."""
        return self._seen

    def _start(self, seen: bool) -> None:
        """Start with the first rotation; `seen`: whether the object was in the images before."""
        self._seen, self._images = seen, 0
        self._round = _Round(self._T, self._turns, self._templates, fitted=10, refined=3)
        self._found: list[Fit] = []

    def _examine(self, maps: Maps, now: _Round, drawn: int, voted: int) -> tuple[int, int]:
        """Vote on the next rotations, and keep those with the best scores; return what is left."""
        while now.examined < len(now.turns) and voted:
            if now.examined == len(now.templates):
                if not drawn:
                    break
                now.templates.append(self._drawn(se3_compose(now.T, now.turns[now.examined])))
                drawn -= 1
            now.hits.append(self._vote(maps, now.templates[now.examined], _SCALES))
            now.examined += 1
            voted -= 1
            if now.examined == len(now.turns):
                now.hits = sorted(now.hits, key=lambda hit: -hit.score)[: now.fitted]
        return drawn, voted

    def _fit_next(self, image: ImageArray, maps: Maps, now: _Round) -> None:
        """Fit the pose at the next rotation, or, after all, at the next of the best poses."""
        if now.hits:
            hit = now.hits.pop(0)
            vote = self._vote(maps, hit.template, (hit.scale,))  # it may have moved since
            T = self._seen_at(hit.template.T_camera_target, vote.centre_px, hit.scale)
            now.fits.append(self._fit(image, T))
            now.fits.sort(key=lambda fit: -fit.share)
        else:
            now.fits[now.again] = self._fit(image, now.fits[now.again].T_camera_target)
            now.again += 1

    def _drawn(self, T: FloatArray) -> _Template:
        contour = self._tracker.contour(T, self._camera)
        centre_px = self._camera.project(self._place(T)[None])[0]
        cells = (contour.points_px - centre_px) / self._cell_px
        return _Template(T, cells, directions_of(contour.normals))

    def _vote(self, maps: Maps, template: _Template, scales: tuple[float, ...]) -> _Hit:
        """Return the best place of a contour at some distances."""
        votes = [
            vote_place(
                maps,
                np.rint(template.cells / scale).astype(np.int64),
                template.directions,
                self._window,
            )
            for scale in scales
        ]
        k = int(np.argmax([vote.score for vote in votes]))
        cell = np.array((votes[k].column, votes[k].row))
        return _Hit(votes[k].score, template, scales[k], (cell + 0.5) * self._cell_px - 0.5)

    def _window_of(self, near: Near | None) -> IntArray:
        """Return the cells at which the centre may lie: first column and row, last + 1, (4,)."""
        rows, columns = self._shape
        if near is None:
            return np.array((0, 0, columns, rows))
        T, covariance = near
        turn = skew(np.ascontiguousarray(T[:3, :3] @ self._centre))
        J = np.hstack((np.eye(3), -turn))
        place = self._place(T)
        reach_m = _REACH * np.sqrt(np.diag(J @ covariance @ J.T)[:2])
        if not place[2] > 0.0:
            return np.array((0, 0, columns, rows))
        cell = self._camera.project(place[None])[0] / self._cell_px
        reach = reach_m * (self._camera.fx, self._camera.fy) / place[2] / self._cell_px + 1.0
        first = np.clip(np.floor(cell - reach), 0, (columns - 1, rows - 1)).astype(np.int64)
        last = np.clip(np.ceil(cell + reach), first + 1, (columns, rows)).astype(np.int64)
        return np.concatenate((first, last))

    def _fit(self, image: ImageArray, T: FloatArray) -> Fit:
        seen: Measurement = self._tracker.measure(
            image, self._camera, T, self._covariance, self._memory
        )
        T = seen.T_camera_target
        share = min(seen.share, seen.usual) if len(seen.points) and T[2, 3] > 0.0 else 0.0
        return Fit(T, share, seen.expected, seen)

    def _place(self, T: FloatArray) -> FloatArray:
        """Return where the object's centre is, (3,)."""
        place: FloatArray = T[:3, :3] @ self._centre + T[:3, 3]
        return place

    def _on_axis(self, T: FloatArray) -> FloatArray:
        """Return the pose on the optical axis at which the object looks the same."""
        return self._seen_at(T, self._camera.to_pixels(np.zeros((1, 2)))[0], 1.0)

    def _seen_at(self, T: FloatArray, centre_px: FloatArray, scale: float) -> FloatArray:
        """Return the pose turned about the camera's centre, which leaves its view, and scaled."""
        now = self._place(T)
        distance = float(np.linalg.norm(now))
        ray = np.append(self._camera.normalize(centre_px[None])[0], 1.0)
        R = _turn_to(now / distance, ray / np.linalg.norm(ray)) @ T[:3, :3]
        place = scale * distance * ray / np.linalg.norm(ray)
        return se3(np.ascontiguousarray(R), place - R @ self._centre)


def _turn_to(ray: FloatArray, other: FloatArray) -> FloatArray:
    """Return the smallest rotation (3, 3) of one unit vector into another."""
    axis = np.cross(ray, other)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3)
    R: FloatArray = so3_exp(np.ascontiguousarray(axis / sine * np.arctan2(sine, ray @ other)))
    return R
