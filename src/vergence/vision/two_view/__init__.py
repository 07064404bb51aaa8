"""Two views of an unknown object: motion and shape up to scale, from matched points."""

from vergence.vision.two_view.estimate import estimate_two_view
from vergence.vision.two_view.failure import TwoViewFailure, TwoViewProblem
from vergence.vision.two_view.result import TwoView

__all__ = [
    "TwoView",
    "TwoViewFailure",
    "TwoViewProblem",
    "estimate_two_view",
]
