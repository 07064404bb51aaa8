"""What a calibration found."""

from typing import NamedTuple

from vergence.app.calibration.dataset import Dataset
from vergence.app.calibration.estimates import Estimate, lens_estimates, mounting_estimates
from vergence.app.calibration.synthetic import Truth
from vergence.camera import Camera
from vergence.camera.calibration import BadImage, LensFit, MountingFit


class Calibration(NamedTuple):
    """Data, what they may be compared with, and what was estimated from them."""

    data: Dataset
    truth: Truth | None
    lens: LensFit
    mounting: MountingFit | None

    @property
    def camera(self) -> Camera:
        """The camera as far as all data tell."""
        return self.lens.camera if self.mounting is None else self.mounting.camera

    @property
    def bad(self) -> tuple[BadImage, ...]:
        """All images that were left out."""
        more = () if self.mounting is None else self.mounting.bad
        return self.data.blank + self.lens.bad + more

    @property
    def warnings(self) -> list[str]:
        """What to know before trusting it."""
        return self.lens.warnings + ([] if self.mounting is None else self.mounting.warnings)

    @property
    def estimates(self) -> list[Estimate]:
        """The numbers of the result."""
        if self.mounting is None:
            return lens_estimates(self.lens, self.truth)
        return [
            *lens_estimates(self.mounting, self.truth),
            *mounting_estimates(self.mounting, self.truth),
        ]
