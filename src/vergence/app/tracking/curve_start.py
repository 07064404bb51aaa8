"""`vergence track --curve`: which curves to follow, by the options."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from vergence.app.options.track import TrackOptions
from vergence.app.tracking.curve_follower import CurveFollower
from vergence.app.tracking.curve_kinds import KINDS, CurveKind
from vergence.app.tracking.curve_subject import CurveSubject
from vergence.app.tracking.footage import Footage, FootageFrame
from vergence.app.tracking.track_subject import Start
from vergence.arrays import FloatArray
from vergence.errors import InputError, nearest

_HOW = f"KIND:U,V,U,V,… in pixels, with KIND one of {', '.join(KINDS)}"


class _Named(NamedTuple):
    """A curve as an option names it."""

    text: str
    name: str  # of its kind
    kind: CurveKind
    points_px: FloatArray  # (M, 2)
    part: Any


def prepare(options: TrackOptions) -> Start:
    """Read which curves are to be followed.

    Raises:
        InputError: if one is none, or an option applies to none of them.
    """
    assert options.curve is not None
    named = [_read(text, options) for text in options.curve]
    for option in ("jolt", "contrast", "share"):
        value = getattr(options, option)
        if value is not None and not any(option in one.kind.options for one in named):
            fitting = [name for name, kind in KINDS.items() if option in kind.options]
            allowed = f"only with --curve {' or '.join(fitting)}"
            raise InputError("vergence track", f"--{option}", value, allowed)
    return partial(_start, named)


def _read(text: str, options: TrackOptions) -> _Named:
    name, colon, numbers = text.partition(":")
    if not colon:
        raise InputError("vergence track", "--curve", text, _HOW)
    if name not in KINDS:
        raise InputError("vergence track", "--curve", f"{text}: kind {name}", nearest(name, KINDS))
    try:
        flat = np.array([float(word) for word in numbers.replace(",", " ").split()])
    except ValueError:
        flat = np.empty(0)
    if not len(flat) or len(flat) % 2 or not np.isfinite(flat).all():
        raise InputError("vergence track", "--curve", text, _HOW)
    kind, points_px = KINDS[name], flat.reshape(-1, 2)
    if not kind.counts(len(points_px)):
        count = f"{len(points_px)} point" + "s" * (len(points_px) > 1)
        raise InputError(
            "vergence track", "--curve", f"{text}: {count}", f"for {name}: {kind.points}"
        )
    return _Named(text, name, kind, points_px, _part(kind, options))


def _part(kind: CurveKind, options: TrackOptions) -> Any:
    given = {field: getattr(options, option) for option, field in kind.options.items()}
    try:
        return kind.part(**{field: value for field, value in given.items() if value is not None})
    except InputError as error:
        option = next(key for key, field in kind.options.items() if field == error.key)
        raise InputError("vergence track", f"--{option}", error.given, error.allowed) from None


def _start(named: Sequence[_Named], _footage: Footage, first: FootageFrame) -> CurveSubject:
    height, width = first.image.shape
    followers = []
    for number, one in enumerate(named, 1):
        high = np.array([width, height]) - 1.0
        outside = ((one.points_px < 0.0) | (one.points_px > high)).any(axis=1)
        if outside.any():
            u, v = one.points_px[outside][0]
            given = f"{one.text}: point {u:g},{v:g} outside the image"
            allowed = f"0,0 to {width - 1},{height - 1}"
            raise InputError("vergence track", "--curve", given, allowed)
        follower = CurveFollower(number, one.name, one.kind)
        reason = follower.begin(one.part, first.image, one.points_px)
        if reason:
            given = f"{one.text}: {reason} in the first image"
            raise InputError(
                "vergence track", "--curve", given, f"for {one.name}: {one.kind.points}"
            )
        followers.append(follower)
    return CurveSubject(followers)
