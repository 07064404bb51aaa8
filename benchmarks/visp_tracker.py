"""ViSP's model-based tracker on the images of a known object: `peers/visp_track.cpp`."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np

from peer_programs import BUILT, Program
from real_images import IMAGES, KnownObject
from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.geometry import se3, so3_exp, so3_log

PROGRAM = BUILT / "visp_track"


class Followed(NamedTuple):
    """What a pass through the images gave."""

    seconds: float  # CPU time an image
    poses: list[FloatArray]  # T_camera_target, (4, 4) each
    lost: BoolArray  # (N,) whether it says so


class VispTracker:
    """The running program, with images in its memory; it ends with the context."""

    def __init__(self, known: KnownObject, images: Sequence[ImageArray]) -> None:
        import cv2

        self._folder = tempfile.TemporaryDirectory()
        folder, names = Path(self._folder.name), []
        for number, image in enumerate(images):
            names.append(str(folder / f"{number:04d}.pgm"))
            cv2.imwrite(names[-1], image)
        T = known.first_pose()
        turn = so3_log(np.ascontiguousarray(T[:3, :3]))
        np.savetxt(folder / "start.pos", np.concatenate((T[:3, 3], turn)))
        given = IMAGES / known.config, IMAGES / known.cao, folder / "start.pos"
        self._program = Program((str(PROGRAM), "serve", *map(str, given), *names))
        self.name = self._program.name

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._program.end()
        self._folder.cleanup()

    def follow(self, case: str, step: int = 1) -> Followed:
        """One pass through every so many images; the case is `edges` or `edges_points`."""
        seconds, *numbers = map(float, self._program.ask(f"{case} {step}").split())
        rows = np.reshape(numbers, (-1, 7))
        poses = [se3(so3_exp(row[3:6].copy()), row[:3].copy()) for row in rows]
        return Followed(seconds, poses, rows[:, 6] > 0.0)
