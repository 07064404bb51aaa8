"""Distances between the bodies of an arm and to other bodies, as laws and planners query them."""

from typing import NamedTuple, Protocol

from vergence.arrays import FloatArray, IntArray


class NearPairs(NamedTuple):
    """Pairs of bodies that are close to each other at present."""

    distance: FloatArray  # (K,) m, negative where they overlap
    margin: FloatArray  # (K,) m, the distance to keep
    gradient: FloatArray  # (K, n) of the distance with respect to the joints, m/rad or 1
    drift: FloatArray  # (K,) m/s, change of the distance not caused by the arm's joints
    pair: IntArray  # (K,) index into all pairs


class Clearance(Protocol):
    """Distances between the bodies of an arm and to other bodies, as functions of joint positions.

    Attributes:
        margin: (P,) the distance to keep for each pair, m.
        reach: (P, n) the largest rate at which a joint can change the distance, m/rad or 1.
        reach_of_others: (P, k) the same for the joints of `others`.
    """

    margin: FloatArray
    reach: FloatArray
    reach_of_others: FloatArray

    def near(self, q: FloatArray) -> NearPairs:
        """Return the pairs that are close to each other at joint positions q (n,)."""
        ...

    def distances(self, q: FloatArray) -> FloatArray:
        """Return the distance of every pair, (P,), m; a lower bound for pairs far apart."""
        ...

    def least(self, near: NearPairs) -> dict[str, float]:
        """Return the smallest distance to each kind of body that is near, m."""
        ...

    def name(self, pair: int) -> str:
        """Return the names of the bodies of a pair."""
        ...

    def others(self) -> FloatArray:
        """Return the joint positions of the other arms taken into account, (k,), rad or m."""
        ...
