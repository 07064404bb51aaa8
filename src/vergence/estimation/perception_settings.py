"""Settings of the tracking loop."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PerceptionSettings:
    """Settings of the tracking loop."""

    budget: int = 8  # features measured per tick, over all cameras
    budget_in_doubt: int = 32  # the same while the filter is inconsistent
    doubt_widens: float = 4.0  # windows by 1 + this · fraction of recent points that disagreed
    margin_px: float = 8.0  # distance from the border of an image
    apart_px: float = 0.0  # smallest distance between features selected in one image
    least_cosine: float = 0.1  # between a face's normal and the line of sight
    horizon: float = 0.5  # s, largest delay of an image
    lost_after: float = 1.0  # s without an image that was used
    lost_doubts: int = 8  # consecutive contradicting images
