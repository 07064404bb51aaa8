"""Offscreen images of the world as seen by its cameras."""

import importlib
import os
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from ctypes.util import find_library
from typing import Any, TypeVar
from weakref import finalize

import numpy as np

from vergence.arrays import BoolArray, DepthArray, Float32Array, FloatArray, ImageArray
from vergence.camera import Camera
from vergence.cell.schema import CameraTable, DepthTable
from vergence.errors import RenderingError
from vergence.simulation.sensor import Sensor

# With this option Mesa's software renderer reads one mipmap level per pixel instead of blending
# two: an image takes two thirds of the time, and a tracked point drifts by 0.028 px instead of
# 0.024 (root mean square, the Puma's cell). Other renderers ignore the option.
_SOFTWARE = ("LP_PERF", "no_mip_linear")
_CHOICE = "mujoco.rendering.classic.gl_context"  # where MuJoCo makes the choice, on import
_T = TypeVar("_T")
_BLOTCH_PX = 24  # side of a blotch without depth


def choose_renderer(needed: bool = True) -> None:
    """Choose how MuJoCo renders without a screen: EGL, else OSMesa, unless MUJOCO_GL is set.

    If MuJoCo has already been imported, it is made to choose again.

    Raises:
        RenderingError: if neither library is installed and a renderer is needed.
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


def offscreen(model: Any, height: int, width: int) -> Any:
    """Return MuJoCo's renderer of a model, without shadows and reflections, which cost the most.

    It can be used only by the thread that calls this function.
    """
    import mujoco

    model.vis.quality.shadowsize = 0  # else MuJoCo allocates a map of 4096 x 4096 that is not used
    renderer = mujoco.Renderer(model, height, width)
    for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
        renderer.scene.flags[flag] = 0
    return renderer


class CameraRenderer:
    """Takes grey images with one camera of a world, with lens distortion and sensor effects.

    Shadows and multisampling are off, so an image takes a few milliseconds on a CPU. MuJoCo renders
    without distortion an image wide enough for everything that the camera sees; each pixel of the
    camera's image is then interpolated in that one. The sky, which costs a tenth of an image and
    more, is drawn from the first image on that has a black pixel.

    A thread of its own renders in parallel with physics and the loop, since a graphics context
    belongs to one thread. Images come out in the order in which they were requested, and are the
    same as without the thread.

    Args:
        model: MuJoCo's model.
        name: of the camera in it.
        camera: its intrinsics.
        table: of the camera in its cell.
        rng: generator of the noise.
    """

    def __init__(
        self, model: Any, name: str, camera: Camera, table: CameraTable, rng: np.random.Generator
    ) -> None:
        import mujoco

        self._thread = ThreadPoolExecutor(1, "renderer")
        self._last: Future[ImageArray] | None = None  # the last image requested
        try:
            drawn = camera.undistorted()
            os.environ.setdefault(*_SOFTWARE)
            self._renderer = self._in_thread(offscreen, model, drawn.height, drawn.width)
        except Exception as error:  # the graphics library may raise anything
            raise RenderingError(
                f"the offscreen renderer does not start ({error}); "
                "Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri"
            ) from None
        self._end = finalize(self, _close_in, self._thread, self._renderer)
        self._end.atexit = False
        self._name, self._shape = name, (camera.height, camera.width)
        self._sky = int(mujoco.mjtRndFlag.mjRND_SKYBOX)
        self._renderer.scene.flags[self._sky] = 0  # until an image may show it
        self._lookup = _lookup(camera, drawn) if camera.distorted else None
        self._rng = rng
        self._sensor = Sensor(self._shape, table, rng)

    def take(self, data: Any, blind: bool = False, settled: bool = True) -> ImageArray:
        """Return the image (height, width) of the world in its present state, black if blind.

        Args:
            data: MuJoCo's state of the world.
            blind: whether no light reaches the sensor.
            settled: whether the automatic exposure has adapted to the scene, see `Sensor.read`.
        """
        return self.begin(data, blind, settled).result()

    def begin(self, data: Any, blind: bool = False, settled: bool = True) -> Future[ImageArray]:
        """Begin to take an image of the present world, which may change meanwhile.

        Arguments and result are those of `take`.
        """
        if not blind:
            self._show(data)
        self._last = self._thread.submit(self._image, blind, settled)
        return self._last

    def _image(self, blind: bool, settled: bool) -> ImageArray:
        light = np.zeros(self._shape, dtype=np.uint8) if blind else self._drawn()
        return self._sensor.read(light, settled)

    def take_moving(
        self, world_at: Callable[[float], Any], moments: FloatArray, weights: FloatArray
    ) -> ImageArray:
        """Return the image (height, width) of a moving world.

        Args:
            world_at: returns MuJoCo's state of the world at a moment.
            moments: those to render, (J,).
            weights: the weight of each in each row, (J, height).
        """
        light: Float32Array = np.zeros(self._shape, dtype=np.float32)
        for moment, rows in zip(moments.tolist(), weights, strict=True):
            light += rows.astype(np.float32)[:, None] * self.draw(world_at(moment))
        return self._sensor.read(light, settled=False)

    def draw(self, data: Any) -> ImageArray:
        """Return the light (height, width) of the world in its present state, in grey levels."""
        self._show(data)
        return self._in_thread(self._drawn)

    def _show(self, data: Any) -> None:
        """Set the present world as the next to be rendered."""
        if self._last is not None:
            wait((self._last,))  # it is rendered from the same scene
        self._renderer.update_scene(data, self._name)

    def _drawn(self) -> ImageArray:
        import cv2

        grey = cv2.cvtColor(self._renderer.render(), cv2.COLOR_RGB2GRAY)
        flags = self._renderer.scene.flags
        if not flags[self._sky] and not grey.min():  # perhaps nothing is drawn there
            flags[self._sky] = 1
            grey = cv2.cvtColor(self._renderer.render(), cv2.COLOR_RGB2GRAY)
        if self._lookup is not None:
            grey = cv2.remap(grey, *self._lookup, cv2.INTER_LINEAR)
        return np.asarray(grey, dtype=np.uint8)

    def depth(self, data: Any, sensor: DepthTable) -> DepthArray:
        """Return the depth (height, width), m, of the present world; NaN where unknown."""
        import cv2

        self._show(data)
        self._renderer.enable_depth_rendering()
        try:
            drawn = self._in_thread(self._renderer.render)
        finally:
            self._renderer.disable_depth_rendering()
        z = drawn if self._lookup is None else cv2.remap(drawn, *self._lookup, cv2.INTER_NEAREST)
        return self._measured(np.array(z, dtype=np.float32), sensor)

    def _measured(self, z: DepthArray, sensor: DepthTable) -> DepthArray:
        """Return true depth (height, width) as a sensor measures it, in place."""
        least, most = sensor.range_m
        z[(z < least) | (z > most)] = np.nan
        if sensor.noise_m:
            z += np.float32(sensor.noise_m) * z**2 * self._rng.standard_normal(z.shape, np.float32)
        if sensor.holes:
            z[self._blotches(sensor.holes)] = np.nan
        return z

    def _blotches(self, share: float) -> BoolArray:
        """Return a mask (height, width) of blotches that cover a given fraction of the image."""
        import cv2

        height, width = self._shape
        coarse = self._rng.random((-(-height // _BLOTCH_PX), -(-width // _BLOTCH_PX))) < share
        size = coarse.shape[1] * _BLOTCH_PX, coarse.shape[0] * _BLOTCH_PX
        fine = cv2.resize(coarse.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
        mask: BoolArray = fine[:height, :width] > 0
        return mask

    def close(self) -> None:
        """Free the graphics context."""
        self._end()
        self._thread.shutdown()

    def _in_thread(self, function: Callable[..., _T], *arguments: Any) -> _T:
        """Return the result of a function called in the rendering thread."""
        return self._thread.submit(function, *arguments).result()


def _close_in(thread: ThreadPoolExecutor, renderer: Any) -> None:
    """Free a graphics context in its own thread, without waiting for it."""
    thread.submit(renderer.close)
    thread.shutdown(wait=False)


def _lookup(camera: Camera, drawn: Camera) -> tuple[Any, Any]:
    """Return the position of each pixel of a camera in the rendered image, for OpenCV's remap."""
    import cv2

    v, u = np.mgrid[: camera.height, : camera.width]
    places = drawn.to_pixels(camera.normalize(np.column_stack((u.ravel(), v.ravel()))))
    across, down = (
        places.reshape(camera.height, camera.width, 2).astype(np.float32).transpose(2, 0, 1)
    )
    return cv2.convertMaps(across.copy(), down.copy(), cv2.CV_16SC2)
