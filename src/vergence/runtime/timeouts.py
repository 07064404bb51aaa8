"""The longest holds of the loop."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Timeouts:
    """How long the loop holds the arm before it ends the run, and how fast a command decays."""

    image_s: float = 0.5  # without a new image
    target_s: float = 0.2  # with images in which no feature is found
    robot_s: float = 10.0  # while the robot is stopped or does not follow
    decay_s: float = 0.1  # from when an image is due until the commanded rates are zero

    def __post_init__(self) -> None:
        if not self.decay_s > 0.0:
            raise ValueError(f"decay_s is {self.decay_s}; it must be positive")
