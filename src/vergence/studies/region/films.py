"""Films of an object in clutter and changing light, something passing before it; with truth."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.cell.schema import CameraTable
from vergence.geometry import matrix_to_quaternion, se3, so3_exp
from vergence.simulation.renderer import offscreen
from vergence.simulation.row_weights import row_weights
from vergence.simulation.sensor import Sensor
from vergence.studies.region.objects import Mesh

WIDTH, HEIGHT, FOCAL_PX = 640, 480, 600.0
CAMERA = Camera(WIDTH, HEIGHT, FOCAL_PX, FOCAL_PX, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)
RATE_HZ = 30.0
_SHAPE = HEIGHT, WIDTH, 3
_NOISE = 2.0  # grey values
_MOMENTS = 8  # of one image whose shutter is open for a while
_CLUTTER = 45  # bodies behind the object
_DISTANCE = 0.45  # of the object, m
_NEARER = 0.75  # of the object's distance, at which the occluder passes
_OBJECT, _OCCLUDER = 0, 1  # which of the bodies that are moved


class FilmFrame(NamedTuple):
    """One image, and what is true of it."""

    image: ImageArray  # (height, width, 3) blue, green, red
    T_camera_target: FloatArray  # (4, 4)
    hidden: float  # share of the object's pixels behind the occluder
    time: float  # s, of exposure


def film(
    mesh: Mesh, seed: int, count: int, hidden: float, light: float, imaging: str | None = None
) -> Iterator[FilmFrame]:
    """Yield the images of a film.

    The camera is fixed at the world's origin and looks along z; y points down.

    Args:
        mesh: of the object.
        seed: of its colours, clutter and motion.
        count: images, with those that are dropped.
        hidden: how much of the object's width the occluder covers, 0 … 1; it passes over it.
        light: by which share the light changes, 0 … 1.
        imaging: of the camera, see `ImagingTable`; ideal with noise if None.
    """
    random = np.random.default_rng(seed)
    width = float(np.median(np.ptp(mesh[0], axis=0)))
    model = _world(mesh, random, 0.5 * hidden * width)
    stage = _Stage(model, _swing(random), width, count / RATE_HZ, light)
    camera = _BadCamera(seed, imaging) if imaging is not None else None
    renderer = offscreen(model, HEIGHT, WIDTH)
    try:
        for k in range(count):
            t = k / RATE_HZ
            if camera is None:
                image = stage.render(renderer, t) + random.normal(0.0, _NOISE, _SHAPE)
                pixels = np.clip(np.rint(image), 0, 255).astype(np.uint8)
            elif camera.drops():
                continue
            else:
                pixels = camera.take(partial(stage.render, renderer), t)
            T = stage.at(t)
            yield FilmFrame(pixels, T, _hidden_share(renderer, model, stage.data), t)
    finally:
        renderer.close()


class _Stage:
    """The scene at any time of the film."""

    def __init__(
        self, model: Any, swing: FloatArray, width: float, length_s: float, light: float
    ) -> None:
        import mujoco

        self.data = mujoco.MjData(model)
        self._model, self._swing, self._width = model, swing, width
        self._length_s, self._light = length_s, light
        self._lamps = model.light_diffuse.copy(), model.vis.headlight.ambient.copy()

    def at(self, t: float) -> FloatArray:
        """Move everything to where it is at a time; return the object's pose, (4, 4)."""
        import mujoco

        T = _pose(t, self._swing)
        self.data.mocap_pos[_OBJECT] = T[:3, 3]
        self.data.mocap_quat[_OBJECT] = matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))
        self.data.mocap_pos[_OCCLUDER] = _passing(t / self._length_s, T, self._width)
        bright = 1.0 + self._light * np.sin(2.5 * t)
        self._model.light_diffuse[:] = bright * self._lamps[0]
        self._model.vis.headlight.ambient[:] = bright * self._lamps[1]
        mujoco.mj_forward(self._model, self.data)
        return T

    def render(self, renderer: Any, t: float) -> ImageArray:
        """Return what an ideal camera sees at a time, (height, width, 3)."""
        self.at(t)
        renderer.update_scene(self.data, "camera")
        image: ImageArray = renderer.render()[:, :, ::-1]
        return image


class _BadCamera:
    """Takes images as a real camera does."""

    def __init__(self, seed: int, imaging: str) -> None:
        values = {"focal_px": (FOCAL_PX, FOCAL_PX), "rate_hz": RATE_HZ, "noise_grey": _NOISE}
        table = CameraTable.model_validate({**values, "imaging": imaging})
        assert table.imaging is not None
        self._imaging, self._fresh = table.imaging, True
        self._random = np.random.default_rng([seed, 1])
        self._sensor = Sensor(_SHAPE, table, self._random)

    def drops(self) -> bool:
        """Return whether an image is lost; never the first."""
        lost = bool(self._random.random() < self._imaging.dropped)
        return lost and not self._fresh

    def take(self, render: Callable[[float], ImageArray], t: float) -> ImageArray:
        """Return the image (height, width, 3) exposed about a time."""
        half = self._imaging.open_s / 2
        moments = np.linspace(-half, half, _MOMENTS) if half else np.zeros(1)
        weights = row_weights(moments, HEIGHT, self._imaging).astype(np.float32)
        light = np.zeros(_SHAPE, dtype=np.float32)
        for moment, rows in zip(moments.tolist(), weights, strict=True):
            light += rows[:, None, None] * render(t + moment)
        settled, self._fresh = self._fresh, False
        return self._sensor.read(light, settled)


def _world(mesh: Mesh, random: np.random.Generator, half: float) -> Any:
    """Return the compiled scene; the occluder is a post of half a width."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
    spec.visual.headlight.ambient = [0.35] * 3
    spec.visual.headlight.diffuse = [0.25] * 3
    shape = spec.add_mesh(
        name="object", uservert=mesh[0].ravel().tolist(), userface=mesh[1].ravel().tolist()
    )
    shape.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    target = spec.worldbody.add_body(name="object", mocap=True)
    target.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object", rgba=[*random.uniform(0.15, 0.9, 3), 1]
    )
    post = spec.worldbody.add_body(name="occluder", mocap=True)
    post.add_geom(
        name="occluder",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[max(_NEARER * half, 1e-4), 1.0, 1e-3],
        rgba=[*random.uniform(0.05, 1.0, 3), 1],
    )
    kinds = (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID)
    for k in range(_CLUTTER):
        q = random.normal(size=4)
        spec.worldbody.add_geom(
            type=kinds[k % 2],
            size=random.uniform(0.02, 0.09, 3),
            pos=random.uniform((-0.6, -0.45, 0.75), (0.6, 0.45, 1.1)),
            quat=q / np.linalg.norm(q),
            rgba=[*random.uniform(0.05, 1.0, 3), 1],
        )
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[2.0, 2.0, 0.01],
        pos=[0.0, 0.0, 1.2],
        rgba=[*random.uniform(0.2, 0.8, 3), 1],
    )
    spec.worldbody.add_camera(
        name="camera",
        quat=[0.0, 1.0, 0.0, 0.0],
        fovy=float(np.rad2deg(2.0 * np.arctan(0.5 * HEIGHT / FOCAL_PX))),
    )
    spec.worldbody.add_light(
        dir=random.uniform((-0.8, 0.2, 0.4), (0.8, 0.9, 1.0)),
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.45] * 3,
    )
    return spec.compile()


def _swing(random: np.random.Generator) -> FloatArray:
    """Return amplitude, rate and phase of x, y, z and the turns about them, (6, 3)."""
    amplitude = np.array((0.06, 0.04, 0.07, 0.5, 0.5, 0.7))
    rate = random.uniform(0.7, 1.4, 6)
    return np.column_stack((amplitude, rate, random.uniform(0.0, 2 * np.pi, 6)))


def _pose(t: float, swing: FloatArray) -> FloatArray:
    """Return the object's pose in the camera at a time, (4, 4)."""
    moved = swing[:, 0] * np.sin(swing[:, 1] * t + swing[:, 2])
    R = so3_exp(np.ascontiguousarray(moved[3:])) @ so3_exp(np.array((1.1, 0.0, 0.0)))
    T: FloatArray = se3(np.ascontiguousarray(R), moved[:3] + (0.0, 0.0, _DISTANCE))
    return T


def _passing(share: float, T: FloatArray, width: float) -> FloatArray:
    """Return where the occluder is: it passes over the object in the middle half of the film."""
    aside = 2.0 * width * np.clip(4.0 * (share - 0.5), -1.0, 1.0)
    return np.array((_NEARER * (T[0, 3] + aside), 0.0, _NEARER * T[2, 3]))


def _hidden_share(renderer: Any, model: Any, data: Any) -> float:
    """Return which share of the object's pixels is behind the occluder."""
    import mujoco

    target = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "object")
    number = int(model.body_geomadr[target])
    occluder = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "occluder")
    color = model.geom_rgba[occluder].copy()
    pixels = []
    renderer.enable_segmentation_rendering()
    for opacity in (color[3], 0.0):
        model.geom_rgba[occluder, 3] = opacity
        renderer.update_scene(data, "camera")
        pixels.append(int(np.count_nonzero(renderer.render()[:, :, 0] == number)))
    renderer.disable_segmentation_rendering()
    model.geom_rgba[occluder] = color
    return 1.0 - pixels[0] / max(pixels[1], 1)
