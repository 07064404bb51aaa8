"""Topic names in the bags that vergence writes."""

INFO, TEXT = "vergence.info", "vergence.text"  # keys of the run information


def joint_states(arm: str, count: int) -> str:
    """Return the topic of an arm's joints, which has ROS's usual name if there is only one arm."""
    return "/joint_states" if count == 1 else f"/{arm}/joint_states"


def setpoints(arm: str) -> str:
    """Return the topic of an arm's set-points."""
    return f"/{arm}/setpoints"


def image(camera: str) -> str:
    """Return the topic of a camera's images."""
    return f"/{camera}/image_raw/compressed"


def camera_info(camera: str) -> str:
    """Return the topic of a camera's intrinsic parameters."""
    return f"/{camera}/camera_info"
