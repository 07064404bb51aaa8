"""`vergence track --tag`: what to follow a tag with, by the options."""

from functools import partial

from vergence.app.options.track import TrackOptions
from vergence.app.tracking.footage import Footage, FootageFrame
from vergence.app.tracking.intrinsics import camera_of_options
from vergence.app.tracking.pose_subject import PoseSubject
from vergence.app.tracking.tag_follower import TagFollower, tag_of_option
from vergence.app.tracking.track_subject import Start
from vergence.cell.schema import TagTable


def prepare(options: TrackOptions) -> Start:
    """Read which tag is to be followed.

    Raises:
        InputError: if it is none.
    """
    assert options.tag is not None
    return partial(_start, options, tag_of_option(options.tag))


def _start(
    options: TrackOptions, tag: TagTable, _footage: Footage, first: FootageFrame
) -> PoseSubject:
    camera = camera_of_options(options, first)
    return PoseSubject(TagFollower(tag, camera), camera)
