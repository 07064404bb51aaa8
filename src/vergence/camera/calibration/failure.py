"""Why a calibration was not made."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CalibrationFailure:
    """The images or poses cannot tell what is asked; never true."""

    reason: str

    def __bool__(self) -> bool:
        return False

    def __str__(self) -> str:
        return self.reason
