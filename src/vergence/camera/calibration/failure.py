"""Why a calibration was not made."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CalibrationFailure:
    """The images or poses do not determine the calibration; evaluates to false."""

    reason: str

    def __bool__(self) -> bool:
        return False

    def __str__(self) -> str:
        return self.reason
