"""Where the cameras of a cell are, by the joints that carry them."""

from vergence.arrays import FloatArray
from vergence.assembly.law_context import LawContext
from vergence.estimation import CameraPose, Joints
from vergence.robot import forward_kinematics


def camera_poses(context: LawContext) -> CameraPose:
    """Return the function from a camera's name and joints at the exposure to T_world_camera."""
    cameras = context.cell.cameras
    fixed = {n: context.model.camera_pose(n) for n, t in cameras.items() if t.arm is None}
    carried = {
        n: (t.arm, context.arm_to_camera(n).chain) for n, t in cameras.items() if t.arm is not None
    }

    def pose(camera: str, joints: Joints) -> FloatArray:
        if camera in fixed:
            return fixed[camera]
        arm, chain = carried[camera]
        T_world_camera: FloatArray = forward_kinematics(chain, joints[arm])
        return T_world_camera

    return pose
