"""A goal that stays."""

from vergence.planning.reference import Reference


class FixedReference:
    """Hands out the same reference at every instant.

    Args:
        reference: the goal; its time is replaced.
    """

    def __init__(self, reference: Reference) -> None:
        self._goal = reference

    def reference(self, time: float) -> Reference:
        """Return the goal, stamped with the time."""
        goal = self._goal
        return Reference(time, goal.points_px, goal.velocity_px, goal.depth_m, goal.T_camera_target)
