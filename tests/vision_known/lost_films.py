"""Rendered films in which an object is hidden for a while and reappears moved and turned."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import matrix_to_quaternion, se3, so3_exp
from vergence.simulation.renderer import offscreen
from vergence.studies.region.objects import OBJECTS, Mesh

WIDTH, HEIGHT, FOCAL_PX = 640, 480, 600.0
CAMERA = Camera(WIDTH, HEIGHT, FOCAL_PX, FOCAL_PX, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)
RATE_HZ, BEFORE, HIDDEN = 30.0, 3, 30
MOVED_M, TURNED_RAD = 0.05, np.deg2rad(30.0)


class Shown(NamedTuple):
    image: NDArray[np.uint8]  # (height, width, 3) blue, green, red
    T_camera_target: FloatArray | None  # (4, 4); None while it is hidden
    time: float


def hidden_for_a_second(name: str, seed: int, after: int) -> Iterator[Shown]:
    """Yield some images of an object, a second without it, and some of it elsewhere."""
    random, mesh = np.random.default_rng(seed), OBJECTS[name]()
    turn = so3_exp(random.normal(0.0, 0.3, 3)) @ so3_exp(np.array((1.1, 0.0, 0.0)))
    before = se3(np.ascontiguousarray(turn), np.array((0.0, 0.0, 0.45)))
    elsewhere = moved(before, 0.5 * (mesh[0].min(axis=0) + mesh[0].max(axis=0)), random)
    behind = se3(np.eye(3), np.array((0.0, 0.0, -9.0)))
    images = rendered(mesh, (before, behind, elsewhere), random)
    for k in range(BEFORE + HIDDEN + after):
        number = 0 if k < BEFORE else 1 if k < BEFORE + HIDDEN else 2
        noisy = images[number] + random.normal(0.0, 2.0, images[number].shape)
        T = (before, None, elsewhere)[number]
        yield Shown(np.clip(np.rint(noisy), 0, 255).astype(np.uint8), T, k / RATE_HZ)


def moved(
    T: FloatArray,
    centre: FloatArray,
    random: np.random.Generator,
    by_m: float = MOVED_M,
    by_rad: float = TURNED_RAD,
) -> FloatArray:
    """Return a pose 5 cm aside and turned by 30° about any axis."""
    axis, aside = random.normal(size=3), random.normal(size=3) * (1.0, 1.0, 0.3)
    turn = so3_exp(by_rad * axis / np.linalg.norm(axis))
    R = np.ascontiguousarray(turn @ T[:3, :3])
    place = T[:3, :3] @ centre + T[:3, 3] + by_m * aside / np.linalg.norm(aside)
    return se3(R, place - R @ centre)


def rendered(
    mesh: Mesh, poses: tuple[FloatArray, ...], random: np.random.Generator
) -> list[NDArray[np.uint8]]:
    """Return images of an object in one scene, one for each pose."""
    model = _scene(mesh, random)
    data = mujoco.MjData(model)
    renderer, images = offscreen(model, HEIGHT, WIDTH), []
    for T in poses:
        data.mocap_pos[0] = T[:3, 3]
        data.mocap_quat[0] = matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, "camera")
        images.append(renderer.render()[:, :, ::-1].copy())
    renderer.close()
    return images


def _scene(mesh: Mesh, random: np.random.Generator) -> Any:
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.35] * 3, [0.25] * 3
    shape = spec.add_mesh(
        name="object", uservert=mesh[0].ravel().tolist(), userface=mesh[1].ravel().tolist()
    )
    shape.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    target = spec.worldbody.add_body(name="object", mocap=True)
    color = [*random.uniform(0.15, 0.9, 3), 1]
    target.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object", rgba=color)
    box = mujoco.mjtGeom.mjGEOM_BOX
    for _ in range(20):
        spec.worldbody.add_geom(
            type=box,
            size=random.uniform(0.02, 0.09, 3),
            pos=random.uniform((-0.6, -0.45, 0.75), (0.6, 0.45, 1.1)),
            quat=random.normal(size=4),
            rgba=[*random.uniform(0.05, 1.0, 3), 1],
        )
    wall = [*random.uniform(0.2, 0.8, 3), 1]
    spec.worldbody.add_geom(type=box, size=[2.0, 2.0, 0.01], pos=[0.0, 0.0, 1.2], rgba=wall)
    view_deg = float(np.rad2deg(2.0 * np.arctan(0.5 * HEIGHT / FOCAL_PX)))
    spec.worldbody.add_camera(name="camera", quat=[0.0, 1.0, 0.0, 0.0], fovy=view_deg)
    spec.worldbody.add_light(
        dir=random.uniform((-0.8, 0.2, 0.4), (0.8, 0.9, 1.0)),
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.45] * 3,
    )
    return spec.compile()
