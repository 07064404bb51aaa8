"""Parts that work for a while, for test_parts_that_raise.py, which copies them beside a cell."""

import numpy as np

import vergence as vg
from vergence.vision import SsdTracking

CALLS: dict[type, int] = {}
FROM = 200  # calls that go well
MOVES_S = 0.6  # as long as a motion does


def late(part: type) -> bool:
    CALLS[part] = CALLS.get(part, 0) + 1
    return CALLS[part] > FROM


class OfPoints(vg.Feature):
    def value(self):
        return self.points.ravel()

    def interaction(self):
        L = vg.Points(self.points, self.depth_m).interaction()
        return self.wrong(L) if late(type(self)) else L


@vg.feature
class Raises(OfPoints):
    def wrong(self, L):
        raise ValueError("my corner")


@vg.feature
class Short(OfPoints):
    def wrong(self, L):
        return L[:-1]


@vg.feature
class NotFinite(OfPoints):
    def wrong(self, L):
        return L * np.nan


@vg.feature
class NoValue(OfPoints):
    def value(self):
        return None if late(NoValue) else self.points.ravel()


class Objective:
    def quadratic(self, state):
        L = state.features.interaction()
        answer = vg.least_squares(L, np.zeros(len(L)))
        return self.wrong(answer) if late(type(self)) else answer


@vg.objective
class ObjectiveRaises(Objective):
    def wrong(self, answer):
        raise KeyError("mine")


@vg.objective
class ObjectiveNothing(Objective):
    def wrong(self, answer):
        return None


@vg.objective
class ObjectiveSmall(Objective):
    def wrong(self, answer):
        return answer._replace(H=answer.H[:3, :3])


@vg.objective
class ObjectiveNotFinite(Objective):
    def wrong(self, answer):
        return answer._replace(g=answer.g + np.inf)


class Limit:
    def rows(self, arm, q, velocity, period_s):
        answer = np.zeros((1, len(q))), np.full(1, -1.0)
        return self.wrong(*answer) if late(type(self)) else answer


@vg.part("limit")
class LimitRaises(Limit):
    def wrong(self, C, d):
        raise IndexError("mine")


@vg.part("limit")
class LimitNothing(Limit):
    def wrong(self, C, d):
        return None


@vg.part("limit")
class LimitNarrow(Limit):
    def wrong(self, C, d):
        return C[:, 1:], d


@vg.part("limit")
class LimitOfTwoRows(Limit):
    def wrong(self, C, d):
        return np.vstack((C, C)), d


@vg.part("limit")
class LimitNotFinite(Limit):
    def wrong(self, C, d):
        return C * np.nan, d


@vg.part("tracker")
class Tracker:
    def start(self, image, points_px):
        return Tracking(SsdTracking().start(image, points_px))


class Tracking:
    def __init__(self, inner):
        self.inner = inner

    def track(self, image, predicted_px=None):
        if late(Tracking):
            raise RuntimeError("my lens cap")
        return self.inner.track(image, predicted_px)


class Motion:
    def poses(self, T_start, times, seed):
        T = np.tile(T_start, (len(times), 1, 1))
        return self.wrong(T) if times[-1] > MOVES_S else T


@vg.part("motion")
class MotionRaises(Motion):
    def wrong(self, T):
        raise ArithmeticError("my path")


@vg.part("motion")
class MotionFlat(Motion):
    def wrong(self, T):
        return T[:, :3]


@vg.part("motion")
class MotionNotFinite(Motion):
    def wrong(self, T):
        return T * np.nan
