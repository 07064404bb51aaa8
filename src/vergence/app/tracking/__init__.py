"""`vergence track`: a known object in footage of one camera."""

from vergence.app.tracking.follower import FollowRule, ObjectFollower, Sighting, Step

__all__ = ["FollowRule", "ObjectFollower", "Sighting", "Step"]
