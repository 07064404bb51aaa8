"""Vision: image points from windows of images, and two-view geometry."""

from vergence.vision.board import Board
from vergence.vision.board_file import read_board
from vergence.vision.image import grey_image
from vergence.vision.picking import Picked, pick_features
from vergence.vision.ssd_tracker import SsdTracker
from vergence.vision.ssd_tracking import SsdTracking
from vergence.vision.tracks import CurveTracking, PointTracker, PointTracking, Tracks
from vergence.vision.two_view import (
    TwoView,
    TwoViewFailure,
    TwoViewProblem,
    estimate_two_view,
)

__all__ = [
    "Board",
    "CurveTracking",
    "Picked",
    "PointTracker",
    "PointTracking",
    "SsdTracker",
    "SsdTracking",
    "Tracks",
    "TwoView",
    "TwoViewFailure",
    "TwoViewProblem",
    "estimate_two_view",
    "grey_image",
    "read_board",
    "pick_features",
]
