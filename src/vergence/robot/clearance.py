"""Distances between the bodies of an arm, and from them to others, as laws and planners ask."""

from typing import NamedTuple, Protocol

from vergence.arrays import FloatArray, IntArray


class NearPairs(NamedTuple):
    """Pairs of bodies that are near each other now."""

    distance: FloatArray  # (K,) m, negative where they overlap
    margin: FloatArray  # (K,) m, the distance that is kept
    gradient: FloatArray  # (K, n) of the distance by the arm's joints, m/rad or 1
    drift: FloatArray  # (K,) m/s, how the distance changes by itself
    pair: IntArray  # (K,) which pair of all


class Clearance(Protocol):
    """Distances between the bodies of an arm, and from them to others, by joint positions.

    Attributes:
        margin: (P,) the distance kept by each pair, m.
        reach: (P, n) what a joint changes the distance of a pair by at most, m/rad or 1.
    """

    margin: FloatArray
    reach: FloatArray

    def near(self, q: FloatArray) -> NearPairs:
        """Return the pairs that are near with the joints at q (n,)."""
        ...

    def distances(self, q: FloatArray) -> FloatArray:
        """Return the distance of every pair, (P,), m; of one far apart what it is at least."""
        ...

    def least(self, near: NearPairs) -> dict[str, float]:
        """Return the least distance, m, to each kind of thing that is near."""
        ...

    def name(self, pair: int) -> str:
        """Return the names of the bodies of a pair."""
        ...

    def others(self) -> FloatArray:
        """Return the joint positions of the other arms that are looked at, (k,), rad or m."""
        ...
