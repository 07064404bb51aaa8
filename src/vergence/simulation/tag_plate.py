"""A marker as a simulated camera sees it: its bits on a thin white plate."""

from typing import Any

import mujoco
import numpy as np

from vergence.cell.schema import TagTable
from vergence.geometry import matrix_to_quaternion
from vergence.simulation.motion import placement_pose
from vergence.tag_families import TAG_FAMILIES

_CELL_TEXELS = 48  # per bit
_QUIET = 1  # width of the white margin, in bits
_PLATE_M = 1e-3  # thickness
_FACE_M = 2e-5  # offset of the face in front of the plate


def add_tag(spec: Any, tag: TagTable) -> None:
    """Add a marker to the world of a description, at its placement.

    Args:
        spec: MuJoCo's description of the target alone.
        tag: the marker.
    """
    image, bits = tag_image(tag)
    half = 0.5 * tag.size_m * (bits + 2 * _QUIET) / bits
    T = placement_pose(tag)
    place = {"pos": T[:3, 3], "quat": matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))}
    body = spec.worldbody.add_body(name="tag", **place)
    texture = spec.add_texture(
        name="tag", type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3,
        width=image.shape[1], height=image.shape[0],
    )  # fmt: skip
    texture.data = np.repeat(image[:, :, None], 3, axis=2).tobytes()
    material = spec.add_material(name="tag", specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tag"
    corners = [(-half, half), (half, half), (half, -half), (-half, -half)]
    spec.add_mesh(
        name="tag face",
        uservert=[x for u, v in corners for x in (u, v, 0.0)],
        userface=[0, 3, 2, 0, 2, 1],
        usertexcoord=[0, 0, 1, 0, 1, 1, 0, 1],
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    seen = {"contype": 0, "conaffinity": 0, "mass": 0.0}
    body.add_geom(
        name="tag plate", type=mujoco.mjtGeom.mjGEOM_BOX, size=[half, half, _PLATE_M / 2],
        pos=[0.0, 0.0, -_PLATE_M / 2 - _FACE_M], rgba=[0.95, 0.95, 0.95, 1.0], **seen,
    )  # fmt: skip
    body.add_geom(
        name="tag face", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="tag face", material="tag",
        **seen,
    )  # fmt: skip


def tag_image(tag: TagTable) -> tuple[Any, int]:
    """Return a marker with its white margin, (N, N) grey, and the number of bits along a side."""
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_FAMILIES[tag.dictionary][0]))
    bits = known.markerSize + 2
    marker = cv2.aruco.generateImageMarker(known, tag.id, bits * _CELL_TEXELS)
    quiet = _QUIET * _CELL_TEXELS
    return np.pad(marker, quiet, constant_values=255), bits
