"""A photograph of where to go, as another camera would have taken it."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.camera.files import read_camera, write_camera
from vergence.camera.grey_levels import grey_levels, grey_values, white_level
from vergence.camera.image_file import read_image_file
from vergence.camera.pinhole import Camera
from vergence.errors import InputError
from vergence.tables import numbers, read_tables, require_known

_EXIF, _FOCAL_35MM = 0x8769, 0xA405  # tags of the Exif standard
_DIAGONAL_35MM = float(np.hypot(36.0, 24.0))  # mm
_LEAST_SHOWN = 0.2  # of the camera's image, that a photograph has to cover


class Photograph(NamedTuple):
    """What the arm's camera would have seen from where a photograph was taken."""

    image: ImageArray  # (height, width) grey, of the arm's camera
    shown: BoolArray | None  # (height, width) what the photograph covers; all of it if None
    joints_deg: dict[str, FloatArray]  # by arm, when it was taken; empty if not known
    distance_m: float | None  # from the camera to what it shows, if known
    lens: Camera  # that took it

    def in_image(self, points_px: FloatArray, camera: Camera) -> FloatArray:
        """Return where points (N, 2) of the photograph are in `image`, of the arm's camera."""
        rays = self.lens.normalize(points_px)
        return camera.project(np.column_stack((rays, np.ones(len(rays)))))


def read_photograph(path: Path, camera: Camera) -> Photograph:
    """Read a photograph, with what is kept beside it.

    Beside ``goal.png`` may lie ``goal.camera.yaml``, a camera file of what took it, and
    ``goal.toml`` with joints_deg by arm and distance_m. Without a camera file it was taken by the
    arm's camera if it is of the same size; else its Exif data have to state the focal length.

    Args:
        path: of the image.
        camera: the arm's.

    Raises:
        InputError: if it cannot be read, or nothing says by which camera it was taken.
    """
    values = grey_values(read_image_file(path), str(path))
    image = grey_levels(values, white_level(values))
    lens = _lens(path, image, camera)
    joints, distance = _notes(path)
    if _same(lens, camera):
        return Photograph(image, None, joints, distance, lens)
    seen, shown = _as_seen_by(camera, lens, image)
    if shown.mean() < _LEAST_SHOWN:
        given = f"a photograph that covers {100 * shown.mean():.0f} % of what the camera sees"
        raise InputError(str(path), "", given, f"{100 * _LEAST_SHOWN:.0f} % or more")
    return Photograph(seen, None if shown.all() else shown, joints, distance, lens)


def write_photograph(
    path: Path,
    image: ImageArray,
    camera: Camera,
    joints_deg: dict[str, FloatArray],
    distance_m: float | None = None,
) -> None:
    """Write an image of the arm's camera as a photograph, with what is known beside it."""
    import cv2

    path.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(path), image):
        raise InputError(str(path), "", "a name that OpenCV cannot write", ".png or .jpg")
    write_camera(camera, _camera_file(path))
    lines = [] if distance_m is None else [f"distance_m = {distance_m:.6g}"]
    lines.append("\n[joints_deg]  # metres for sliding joints")
    for arm, joints in joints_deg.items():
        lines.append(f'"{arm}" = [' + ", ".join(f"{angle:.6f}" for angle in joints) + "]")
    path.with_suffix(".toml").write_text("\n".join(lines).lstrip() + "\n")


def _camera_file(path: Path) -> Path:
    return path.with_name(path.stem + ".camera.yaml")


def _lens(path: Path, image: ImageArray, camera: Camera) -> Camera:
    """Return the camera that took a photograph."""
    height, width = image.shape
    if (file := _camera_file(path)).is_file():
        return read_camera(file, width, height)
    if (height, width) == (camera.height, camera.width):
        return camera
    focal_mm = _focal_35mm(path)
    if focal_mm is None:
        given = f"an image of {width} x {height} by an unknown camera"
        allowed = (
            f"{camera.width} x {camera.height}, as the arm's camera; or a camera file "
            f"{_camera_file(path).name} beside it; or Exif data with the focal length"
        )
        raise InputError(str(path), "", given, allowed)
    return Camera(width, height, focal_mm / _DIAGONAL_35MM * float(np.hypot(width, height)))


def _same(lens: Camera, camera: Camera) -> bool:
    """Return whether two cameras see alike, to a thousandth of a pixel; files are rounded."""
    size = (lens.width, lens.height) == (camera.width, camera.height)
    matrix = np.allclose(lens.matrix, camera.matrix, rtol=0.0, atol=1e-3)
    return size and matrix and np.allclose(lens.distortion, camera.distortion, rtol=0.0, atol=1e-6)


def _focal_35mm(path: Path) -> float | None:
    """Return the focal length for a 35 mm film from the Exif data, mm; None without one."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as opened:
            value: Any = opened.getexif().get_ifd(_EXIF).get(_FOCAL_35MM)
            focal = float(value) if value is not None else 0.0
    except (UnidentifiedImageError, OSError, ValueError, TypeError, SyntaxError):
        return None
    return focal if 1.0 <= focal <= 5000.0 else None


def _notes(path: Path) -> tuple[dict[str, FloatArray], float | None]:
    """Return joints in degrees by arm, and the distance, from the file beside a photograph."""
    file = path.with_suffix(".toml")
    if not file.is_file():
        return {}, None
    (table,) = read_tables(file, "a photograph's notes", (".toml",))
    source = str(file)
    require_known(table, ("joints_deg", "distance_m"), source)
    distance = None
    if "distance_m" in table:
        distance = float(numbers(table, "distance_m", (), source))
        if not distance > 0:
            raise InputError(source, "distance_m", distance, "metres above zero")
    joints = table.get("joints_deg", {})
    if not isinstance(joints, dict):
        raise InputError(source, "joints_deg", joints, "a table of lists by arm")
    return {arm: numbers(joints, arm, (None,), source) for arm in joints}, distance


def _as_seen_by(camera: Camera, lens: Camera, image: ImageArray) -> tuple[ImageArray, BoolArray]:
    """Return what a camera in the same place would have seen, and which pixels are known."""
    import cv2

    v, u = np.indices((camera.height, camera.width))
    rays = camera.normalize(np.column_stack((u.ravel(), v.ravel())).astype(np.float64))
    points = np.column_stack((rays, np.ones(len(rays))))
    seen = lens.in_view(points)
    places = np.full((len(rays), 2), -10.0)
    places[seen] = lens.project(points[seen])
    ratio = float(np.mean(lens.focal_px) / np.mean(camera.focal_px))
    if ratio > 1.2:  # finer than the camera: its pixels are means
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.5 * np.sqrt(ratio**2 - 1.0)))
    grid = places.reshape(camera.height, camera.width, 2).astype(np.float32)
    taken = cv2.remap(image, grid[..., 0], grid[..., 1], cv2.INTER_LINEAR)
    return np.ascontiguousarray(taken, dtype=np.uint8), seen.reshape(camera.height, camera.width)
