"""`vergence track`: a known object in footage of one camera."""

from vergence.app.tracking.follower import FollowRule, ObjectFollower, Sighting, Step
from vergence.app.tracking.points import track_points

__all__ = ["FollowRule", "ObjectFollower", "Sighting", "Step", "track_points"]
