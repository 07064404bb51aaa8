"""`vergence track --model`: what to follow an object with, by the options."""

from dataclasses import replace
from functools import partial

from vergence.app.options.track import Modality, TrackOptions
from vergence.app.tracking.footage import Footage, FootageFrame
from vergence.app.tracking.intrinsics import camera_of_options
from vergence.app.tracking.pose_subject import PoseSubject
from vergence.app.tracking.start import starting_poses
from vergence.app.tracking.track_subject import Start
from vergence.errors import NOTHING, InputError
from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import (
    LEAST_SHARE,
    OUTLINE_RULE,
    FollowRule,
)
from vergence.estimation.known_object.object_tracker import ObjectTracker
from vergence.vision.known_object import (
    EdgeTracker,
    ObjectModel,
    SilhouetteTracker,
    load_object_model,
    shown_by_edges,
)

_CONTRAST, _JOLT_PX = 5.0, 3.0  # grey levels of an edge; motion not predicted, per image


def prepare(options: TrackOptions) -> Start:
    """Read the object that is to be followed.

    Raises:
        InputError: if it cannot be read, or there is no start.
    """
    assert options.model is not None
    if options.start is None:
        raise InputError(
            "vergence track", "--start", NOTHING, "the object's pose in the first image"
        )
    return partial(_start, options, load_object_model(options.model, options.scale))


def _start(
    options: TrackOptions, model: ObjectModel, footage: Footage, first: FootageFrame
) -> PoseSubject:
    camera = camera_of_options(options, first)
    contrast = _CONTRAST if options.contrast is None else options.contrast
    jolt_px = _JOLT_PX if options.jolt is None else options.jolt
    for key, value, low, high in (
        ("--contrast", contrast, 0.01, 255),
        ("--jolt", jolt_px, 0.01, 1e3),
    ):
        if not low <= value <= high:
            raise InputError("vergence track", key, value, f"from {low:g} to {high:g}")
    share = options.share
    if share is not None and not LEAST_SHARE <= share <= 1.0:
        reason = "with less, an object cannot be distinguished from its background"
        allowed = f"{LEAST_SHARE} … 1: {reason}"
        raise InputError("vergence track", "--share", share, allowed)
    assert options.start is not None
    starts = starting_poses(options.start, camera)
    tracker, usual = _tracker(options.by, model, contrast, first)
    rule = replace(usual, jolt_px=jolt_px)
    if share is not None:
        rule = rule.with_least_share(share)
    period = 1.0 / footage.rate_hz
    return PoseSubject(HypothesisFollower(tracker, camera, starts, 0.0, period, rule), camera)


def _tracker(
    by: Modality, model: ObjectModel, contrast: float, first: FootageFrame
) -> tuple[ObjectTracker, FollowRule]:
    """Return what measures the object, chosen by its model, and when an image counts."""
    by_edges = by is Modality.EDGES or (by is Modality.AUTO and shown_by_edges(model))
    if by_edges:
        return EdgeTracker(model, contrast=contrast), FollowRule()
    return SilhouetteTracker(model, 1 if first.color is None else 3), OUTLINE_RULE
