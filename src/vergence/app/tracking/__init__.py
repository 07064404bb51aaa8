"""`vergence track`: an object, a tag or curves in footage of one camera."""

from vergence.app.tracking.points import track_points
from vergence.estimation.known_object.object_follower import (
    FollowRule,
    ObjectFollower,
    Sighting,
    Step,
)

__all__ = ["FollowRule", "ObjectFollower", "Sighting", "Step", "track_points"]
