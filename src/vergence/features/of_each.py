"""A feature of each of several curves, stacked."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.features.feature import Feature


def of_each(feature: type[Feature], size: int) -> type[Feature]:
    """Return the feature of several curves: what `feature` is of each, one after the other.

    Args:
        feature: of one curve.
        size: how many points represent each curve, all of them in turn.
    """

    class OfEach(feature):  # type: ignore[misc, valid-type]
        """The values of each curve, and their interaction matrices, stacked."""

        def value(self) -> FloatArray:
            """Return s of each curve in turn, (C k,)."""
            return np.concatenate([one.value() for one in self._each()])

        def error(self, desired: Feature) -> FloatArray:
            """Return e = s - s_star of each curve in turn, (C k,)."""
            pairs = zip(self._each(), desired._each(), strict=True)  # type: ignore[attr-defined]
            return np.concatenate([now.error(then) for now, then in pairs])

        def interaction(self) -> FloatArray:
            """Return L of each curve in turn, (C k, 6)."""
            return np.concatenate([one.interaction() for one in self._each()])

        def _each(self) -> list[Feature]:
            count = len(self.points)
            if count % size:
                given = f"{count} points, {size} for each curve"
                raise InputError(feature.__name__, "points", given, "whole curves")
            places = range(0, count, size)
            return [feature(self.points[k : k + size], self.depth_m[k : k + size]) for k in places]

    return OfEach
