"""Offscreen pictures of the world, as its cameras would take them."""

import importlib
import os
import sys
from ctypes.util import find_library
from typing import Any

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera import Camera
from vergence.errors import RenderingError

_CHOICE = "mujoco.rendering.classic.gl_context"  # where MuJoCo settles on it, when imported
_NOISE_POOL = 256  # rows and columns by which the pool of noise exceeds the picture


def choose_renderer(needed: bool = True) -> None:
    """Choose how MuJoCo draws without a screen: EGL, else OSMesa, unless MUJOCO_GL says.

    Where MuJoCo has been imported already, it is made to choose again.

    Raises:
        RenderingError: if neither library is there and a renderer is needed.
    """
    if "MUJOCO_GL" in os.environ or sys.platform != "linux":
        return
    for name, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if find_library(library):
            os.environ["MUJOCO_GL"] = name
            if "mujoco" in sys.modules and _CHOICE in sys.modules:
                importlib.reload(sys.modules[_CHOICE])
            return
    if not needed:
        return
    raise RenderingError(
        "no offscreen renderer: install libegl1 and libgl1-mesa-dri, or libosmesa6 "
        "(Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri)"
    )


class CameraRenderer:
    """Takes grey pictures with one camera of a world, with sensor noise.

    Shadows and multisampling stay off: a picture then costs a few milliseconds on a CPU.
    """

    def __init__(
        self, model: Any, name: str, camera: Camera, noise_grey: float, rng: np.random.Generator
    ) -> None:
        import mujoco

        try:
            self._renderer = mujoco.Renderer(model, camera.height, camera.width)
        except Exception as error:  # whatever the graphics library throws
            raise RenderingError(
                f"the offscreen renderer does not start ({error}); "
                "Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri"
            ) from None
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[flag] = 0
        self._name = name
        self._rng = rng
        shape = (camera.height + _NOISE_POOL, camera.width + _NOISE_POOL)
        self._noise = rng.normal(0, noise_grey, shape).astype(np.int16) if noise_grey else None

    def take(self, data: Any, blind: bool = False) -> ImageArray:
        """Return the picture (height, width) of the world as it stands, black if blind."""
        import cv2

        if blind:
            grey = np.zeros((self._renderer.height, self._renderer.width), dtype=np.uint8)
        else:
            self._renderer.update_scene(data, self._name)
            grey = cv2.cvtColor(self._renderer.render(), cv2.COLOR_RGB2GRAY)
        if self._noise is not None:
            # A fresh window of one pool: drawing normal deviates would cost more than the picture.
            row, column = self._rng.integers(0, _NOISE_POOL, 2)
            window = self._noise[row : row + grey.shape[0], column : column + grey.shape[1]]
            grey = cv2.add(grey, window, dtype=cv2.CV_8U)
        image: ImageArray = np.asarray(grey, dtype=np.uint8)
        image.flags.writeable = False
        return image

    def close(self) -> None:
        """Free the graphics context."""
        self._renderer.close()
