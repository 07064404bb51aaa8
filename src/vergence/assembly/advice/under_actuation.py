"""What an arm of fewer than six joints cannot do for its task, in a sentence."""

from vergence.assembly.law_context import LawContext
from vergence.robot import unserved_directions

_LENGTH_M = 0.5  # where no depth is known


def under_actuation(context: LawContext) -> str:
    """Return which directions the task's arm cannot serve at the start; empty with six joints."""
    arm, name = context.arm, context.cell.task.arm
    if arm.joint_count >= 6:
        return ""
    distance = context.distance_m or _LENGTH_M
    unserved = unserved_directions(arm.jacobian(context.joints[name]), distance)
    moved = "the target" if context.is_fixed else f"camera {context.camera_name}"
    return (
        f"With its {arm.joint_count} joints, arm {name} cannot move {moved} in every "
        f"direction: at the start it {unserved} (axes of {moved}). "
        "Errors that need such a motion remain."
    )
