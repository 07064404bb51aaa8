"""A square marker on the target, as a table of a cell file."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from vergence.cell.schema.base import Placement, Text
from vergence.errors import InputError
from vergence.tag_families import tag_family


class TagTable(Placement):
    """An AprilTag or ArUco marker on the target; its placement is in the target's frame.

    In the marker's own frame x points right, y up, and z at the viewer, from its middle. Its four
    corners, clockwise from the top left, are the target's features.
    """

    dictionary: Text = "apriltag_36h11"  # dictionary of the marker, such as aruco_4x4_50
    id: Annotated[int, Field(ge=0, le=9999)]  # number of the marker
    # Side of the marker with its black border, without the white around it.
    size_m: Annotated[float, Field(ge=1e-3, le=10)]

    @model_validator(mode="after")
    def _known(self) -> "TagTable":
        count = tag_family(self.dictionary, "").markers
        if self.id >= count:
            allowed = f"0 to {count - 1} in {self.dictionary}"
            raise InputError("", "id", self.id, allowed)
        return self

    @property
    def corners(self) -> tuple[tuple[float, float, float], ...]:
        """The corners in the target's frame, clockwise from the marker's top left, m."""
        from vergence.geometry import rpy_to_matrix

        half = self.size_m / 2
        own = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
        roll, pitch, yaw = np.deg2rad(self.rotation_rpy_deg)
        R = rpy_to_matrix(np.array([yaw, pitch, roll]))
        return tuple((x, y, z) for x, y, z in (own @ R.T + self.position_m).tolist())
