"""Images that nobody rendered: those of Debian's package visp-images-data, and how they are spoilt.

`scripts/ensure-test-images` installs them.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.geometry import se3, so3_exp
from vergence.vision.known_object import ObjectModel

IMAGES = Path("/usr/share/visp-images-data/ViSP-images")
PACKAGE = "visp-images-data"
INSTALL = f"real images not installed (apt install {PACKAGE})"
PERIOD_S = 0.04


def read_grey(path: Path) -> ImageArray:
    import cv2

    return np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)


def sequence(name: str) -> list[ImageArray]:
    """The images of a folder, in order; none if they are not installed."""
    return [read_grey(path) for path in sorted((IMAGES / name).glob("*.p?m"))]


@dataclass(frozen=True)
class KnownObject:
    """An object that a sequence shows, with ViSP's own files of it."""

    name: str
    folder: str  # of the images
    config: str  # ViSP's settings
    cao: str  # ViSP's model
    camera: Camera
    start: str  # ViSP's pose in the first image, or the folder of the true poses
    rendered: bool = False

    @property
    def model(self) -> ObjectModel:
        return read_cao(IMAGES / self.cao)

    def images(self) -> list[ImageArray]:
        return sequence(self.folder)

    def true_poses(self) -> list[FloatArray] | None:
        """T_camera_target (4, 4) of each image; None where nobody knows."""
        if not self.rendered:
            return None
        return [np.loadtxt(path) for path in sorted((IMAGES / self.start).glob("*.txt"))]

    def first_pose(self) -> FloatArray:
        """T_camera_target (4, 4) in the first image."""
        poses = self.true_poses()
        return read_pose(IMAGES / self.start) if poses is None else poses[0]


CUBE = KnownObject(
    "cube on a table", "mbt/cube", "mbt/cube.xml", "mbt/cube.cao",
    Camera(640, 480, 547.737, 542.074, 338.704, 234.508), "mbt/cube.0.pos",
)  # fmt: skip
CASTLE = KnownObject(
    "castle", "mbt-depth/castel/castel", "mbt-depth/castel/chateau.xml",
    "mbt-depth/castel/chateau.cao",
    Camera(640, 480, 615.167, 615.168, 312.189, 243.437), "mbt-depth/castel/chateau.0.pos",
)  # fmt: skip
# Its file puts the principal point at (320, 240), the corner between four pixels; with centres at
# integers, the middle of a rendered image of 640 × 480 is (319.5, 239.5).
RENDERED_CASTLE = KnownObject(
    "castle, rendered", "mbt-depth/Castle-simu/Images", "mbt-depth/Castle-simu/Config/chateau.xml",
    "mbt-depth/Castle-simu/Models/chateau.cao",
    Camera(640, 480, 700.0, 700.0, 319.5, 239.5), "mbt-depth/Castle-simu/CameraPose",
    rendered=True,
)  # fmt: skip


def read_pose(path: Path) -> FloatArray:
    """ViSP's pose file: t, and the rotation vector."""
    values = np.loadtxt(path)
    T: FloatArray = se3(so3_exp(values[3:].copy()), values[:3].copy())
    return T


def read_cao(path: Path) -> ObjectModel:
    """ViSP's model file, of faces by points."""
    points: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    _add_cao(path, points, triangles)
    return ObjectModel.from_mesh(path.stem, points, triangles)


def _add_cao(path: Path, points: list[list[float]], triangles: list[tuple[int, int, int]]) -> None:
    text = re.sub(r"#.*|name=\S+", "", path.read_text())
    for part in re.findall(r'load\("(.*)"\)', text):
        _add_cao(path.parent / part, points, triangles)
    lines = iter(line for line in map(str.strip, text.splitlines()) if re.match(r"[-+.\d]", line))
    first = len(points)
    points += [[float(word) for word in next(lines).split()] for _ in range(int(next(lines)))]
    if int(next(lines)) or int(next(lines)):
        raise ValueError(f"{path}: lines, and faces of them, are not read")
    for _ in range(int(next(lines))):
        count, *corners = map(int, next(lines).split())
        fan = pairwise(corners[1:count])
        triangles += [(first + corners[0], first + a, first + b) for a, b in fan]


Spoil = Callable[[ImageArray, int], ImageArray]
"""What a worse camera or scene would have made of an image, by its number in the sequence."""


def blurred(sigma_px: float) -> Spoil:
    """Out of focus."""
    import cv2

    return lambda image, _: np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.uint8)


def smeared(length_px: int) -> Spoil:
    """In motion along the rows while the shutter is open."""
    import cv2

    line = np.full((1, length_px), 1.0 / length_px, np.float32)
    return lambda image, _: np.asarray(cv2.filter2D(image, -1, line), np.uint8)


def darkened(share: float, noise_grey: float = 2.0) -> Spoil:
    """In so much of the light, with the noise that is left."""

    def spoil(image: ImageArray, number: int) -> ImageArray:
        random = np.random.default_rng(number)
        noisy = share * image + noise_grey * random.normal(size=image.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)

    return spoil


def unspoilt(image: ImageArray, _: int) -> ImageArray:
    return image


SPOILS: Mapping[str, Spoil] = {
    "clean": unspoilt,
    "blurred, σ 2 px": blurred(2.0),
    "smeared, 9 px": smeared(9),
    "a fifth of the light": darkened(0.2),
}


def spoilt(images: Sequence[ImageArray], spoil: Spoil) -> list[ImageArray]:
    return [spoil(image, number) for number, image in enumerate(images)]
