"""Where a camera of a cell is, for laws."""

from vergence.assembly.law_context import LawContext
from vergence.control import CameraMounting
from vergence.geometry import se3_inverse


def mounting_of(context: LawContext, name: str) -> CameraMounting:
    """Return where a camera is: the task's at the arm's tip unless it is fixed."""
    camera = context.camera(name)
    fixed = context.T_world_camera(name)
    if fixed is not None:
        return CameraMounting(camera, T_world_camera=fixed)
    if name == context.camera_name:
        return CameraMounting(camera)
    q = context.joints[context.cell.task.arm]
    T_world_tip = context.arm.forward_kinematics(q)
    T_world_camera = context.arm_to_camera(name).forward_kinematics(q)
    return CameraMounting(camera, T_tip_camera=se3_inverse(T_world_tip) @ T_world_camera)
