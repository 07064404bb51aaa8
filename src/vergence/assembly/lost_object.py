"""A lost target with corners, found in whole images by its edges."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.estimation import Measure
from vergence.estimation.known_object.half_hidden import enough_seen
from vergence.estimation.known_object.object_rivals import chance_of, choose_pose
from vergence.estimation.known_object.object_search import ObjectSearch, SearchPace
from vergence.geometry import transform_points
from vergence.signals import Frame, ImagePoints
from vergence.vision.known_object import EdgeTracker, ObjectModel

_PACE = SearchPace(40, 130, 6)  # about 12 ms an image
_LEAST_SHARE = 0.85  # of the edges
_HALF_PX = 8.0  # of the windows at a pose that was fitted
_FORGOTTEN_S = 0.5  # after which a search does not continue


class ObjectFinder:
    """Finds a lost target in whole images; a `Find` of perception.

    The cameras take turns, one round of the search each. A pose is an answer if its edges are found
    more precisely than chance explains, and if no other pose explains them as well.

    Args:
        model: the target's geometry.
        cameras: by name.
        measure: finds corners in windows.
    """

    def __init__(self, model: ObjectModel, cameras: Mapping[str, Camera], measure: Measure) -> None:
        self._tracker, self._measure = EdgeTracker(model), measure
        self._corners = model.corners
        self._cameras = cameras
        self._searches = {
            name: ObjectSearch(self._tracker, camera, _PACE, _LEAST_SHARE)
            for name, camera in cameras.items()
        }
        self._turns = self._tracker.symmetries()
        self._names = list(cameras)
        self._time = -np.inf  # s, of the last image
        self._begun = ""  # the camera whose images are searched

    def __call__(self, frame: Frame, T_camera_target: FloatArray) -> ImagePoints | None:
        """Return the corners where the target is found, or None.

        Args:
            frame: the image.
            T_camera_target: last pose of the target in this camera, (4, 4).
        """
        if frame.camera != self._names[0] or frame.image is None:
            return None
        search = self._searches[frame.camera]
        late = frame.time - self._time > _FORGOTTEN_S
        self._time = frame.time
        if late or self._begun != frame.camera or search.is_stale(T_camera_target):
            search.begin(T_camera_target, self._tracker.blank())
            self._begun = frame.camera
        fits = search.look(frame.image)
        if fits is None:
            return None
        self._names.append(self._names.pop(0))
        chance = chance_of(fits)
        compare = partial(
            self._tracker.log_ratio, camera=self._cameras[frame.camera], chance=chance
        )
        enough = enough_seen(fits, None, _LEAST_SHARE, compare, chance)
        if isinstance(enough, str):
            return None
        chosen = choose_pose(enough, T_camera_target, self._turns, search.free_axes, compare)
        return (
            None
            if chosen is None or chosen.rivals
            else self._corners_at(frame, chosen.T_camera_target)
        )

    def _corners_at(self, frame: Frame, T: FloatArray) -> ImagePoints:
        places = self._cameras[frame.camera].project(transform_points(T, self._corners.copy()))
        features = np.arange(len(places))
        return self._measure(frame, features, places, np.full((len(places), 2), _HALF_PX), T)
