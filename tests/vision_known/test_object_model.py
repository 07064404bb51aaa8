"""Corners and sharp edges come from the geometry itself, whatever the file."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from known_scene import HALF, OBJ, SIGNS, box_model

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.vision.known_object import ObjectModel, load_object_model, object_model_of
from vergence.vision.known_object.primitives import capsule, cylinder, ellipsoid

BOX_XML = (
    "<mujoco><worldbody><body name='b' pos='1 2 3' euler='10 20 30'>{}</body></worldbody></mujoco>"
)


def sorted_rows(points: FloatArray) -> FloatArray:
    rounded = np.round(points, 6) + 0.0
    return rounded[np.lexsort(rounded.T)]


def ascii_stl(model: ObjectModel) -> str:
    facets = []
    for triangle in model.surface:
        corners = "".join(f"vertex {x} {y} {z}\n" for x, y, z in triangle)
        facets.append(f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    return "solid box\n" + "".join(facets) + "endsolid box\n"


def binary_stl(model: ObjectModel) -> bytes:
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("bits", "<u2")])
    facets = np.zeros(len(model.surface), record)
    facets["corners"] = model.surface
    return bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()


def test_a_box_has_eight_corners_of_three_edges_each() -> None:
    model = box_model()
    assert len(model.corners) == 8
    assert len(model.edges) == 12
    assert (np.sort(np.bincount(model.corner_edges.ravel())) == 2).all()
    lengths = np.linalg.norm(model.edges[:, 1] - model.edges[:, 0], axis=1)
    np.testing.assert_allclose(np.sort(lengths), np.repeat(np.sort(2 * HALF), 4))


def test_normals_point_outwards() -> None:
    model = box_model()
    assert (np.einsum("ij,ij->i", model.normals, model.surface.mean(axis=1)) > 0).all()
    middle = model.edges.mean(axis=1)
    assert (np.einsum("ijk,ik->ij", model.edge_normals, middle) > 0).all()


@pytest.mark.parametrize("kind", ["obj", "stl", "xml"])
def test_every_kind_of_file_gives_the_same_corners(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"box.{kind}"
    if kind == "obj":
        path.write_text(OBJ)
    elif kind == "stl":
        path.write_bytes(binary_stl(box_model()))
    else:
        half = " ".join(map(str, HALF))
        path.write_text(f"<mujoco><worldbody><geom type='box' size='{half}'/></worldbody></mujoco>")
    model = load_object_model(path)
    np.testing.assert_allclose(sorted_rows(model.corners), sorted_rows(SIGNS * HALF), atol=1e-6)
    assert len(model.edges) == 12


def test_a_mesh_away_from_its_origin_keeps_its_place(tmp_path: Path) -> None:
    path = tmp_path / "moved.obj"
    moved = SIGNS * HALF + (0.3, -0.2, 0.1)
    lines = "".join(f"v {x} {y} {z}\n" for x, y, z in moved)
    path.write_text(lines + "".join(line + "\n" for line in OBJ.splitlines() if line[0] == "f"))
    np.testing.assert_allclose(
        sorted_rows(load_object_model(path).corners), sorted_rows(moved), atol=1e-6
    )


def test_a_scale_turns_millimetres_into_metres(tmp_path: Path) -> None:
    path = tmp_path / "box.obj"
    path.write_text(OBJ)
    assert load_object_model(path, 0.001).size == pytest.approx(0.001 * box_model().size)


def test_a_body_of_a_scene_is_an_object_in_its_own_frame() -> None:
    half = " ".join(map(str, HALF))
    compiled = mujoco.MjModel.from_xml_string(BOX_XML.format(f"<geom type='box' size='{half}'/>"))
    corners = object_model_of(compiled, "b").corners
    np.testing.assert_allclose(sorted_rows(corners), sorted_rows(SIGNS * HALF), atol=1e-9)


def test_edges_of_many_pieces_in_one_line_are_one() -> None:
    """A plate of 5 × 5 squares has four edges and four corners."""
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij")
    vertices = np.column_stack((x.ravel(), y.ravel(), np.zeros(36)))
    triangles = []
    for i in range(5):
        for j in range(5):
            a, b, c, d = 6 * i + j, 6 * i + j + 6, 6 * i + j + 7, 6 * i + j + 1
            triangles += [(a, b, c), (a, c, d)]
    model = ObjectModel.from_mesh("plate", vertices, triangles)
    assert (len(model.edges), len(model.corners)) == (4, 4)
    np.testing.assert_allclose(model.edge_normals.sum(axis=1), 0.0)


def test_vertices_at_one_place_are_one() -> None:
    model = box_model()
    doubled = ObjectModel.from_mesh("loose", model.surface.reshape(-1, 3), np.arange(36))
    assert len(doubled.vertices) == 8
    assert len(doubled.edges) == 12


def test_the_rims_of_a_cylinder_are_sharp_but_have_no_corners() -> None:
    model = ObjectModel.from_mesh("can", *cylinder(0.03, 0.05))
    assert (len(model.edges), len(model.corners)) == (96, 0)
    low, high = model.boxed().corners.min(axis=0), model.boxed().corners.max(axis=0)
    np.testing.assert_allclose(
        [low, high], 0.5 * np.array([[-0.03] * 2 + [-0.05], [0.03] * 2 + [0.05]]), atol=1e-3
    )


@pytest.mark.parametrize(
    "mesh", [cylinder(0.03, 0.05), ellipsoid((0.1, 0.1, 0.05)), capsule(0.02, 0.1)]
)
def test_round_primitives_are_closed_and_face_outward(mesh: tuple[np.ndarray, np.ndarray]) -> None:
    model = ObjectModel.from_mesh("round", *mesh)
    assert model.closed
    assert (np.einsum("fi,fi->f", model.surface.mean(axis=1), model.normals) > 0.0).all()


def test_parts_of_a_model_stay_together(tmp_path: Path) -> None:
    path = tmp_path / "parts.xml"
    path.write_text(
        "<mujoco><worldbody><geom type='box' size='.05 .04 .01'/>"
        "<geom type='cylinder' size='.02 .03' pos='0 0 .04'/>"
        "<geom type='box' size='1 1 1' group='3'/></worldbody></mujoco>"
    )
    model = load_object_model(path)
    assert len(model.corners) == 8
    assert len(model.edges) == 12 + 96


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("gone.obj", None, "no such file"),
        ("notes.txt", "", "a file of kind .txt"),
        ("broken.obj", "v 0 0\nf 1 2 3\n", "geometry that MuJoCo reads"),
        ("empty.obj", "", "refuses: at least 4 vertices required; allowed: geometry"),
        ("broken.xml", "<mujoco><nonsense/></mujoco>", "a model that MuJoCo reads"),
        (
            "flat.xml",
            "<mujoco><worldbody><geom type='plane' size='1 1 1'/></worldbody></mujoco>",
            "one of mesh, box, cylinder",
        ),
    ],
)
def test_a_file_that_is_no_model_is_named(
    tmp_path: Path, name: str, text: str | None, words: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words) as error:
        load_object_model(tmp_path / name)
    assert str(tmp_path / name) in str(error.value)


def test_geometry_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="not finite"):
        ObjectModel.from_mesh("m", [[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [(0, 1, 2)])
    with pytest.raises(InputError, match="vertex 0 … 3"):
        ObjectModel.from_mesh("m", np.eye(3), [(0, 1, 3)])
    with pytest.raises(InputError, match="at least one point"):
        ObjectModel.from_corners("m", np.zeros((0, 3)))


def test_a_list_of_features_is_a_model_without_edges() -> None:
    model = ObjectModel.from_corners("marks", SIGNS * HALF)
    assert len(model.corners) == 8
    assert not len(model.edges)


def test_a_coarsened_ball_is_still_one() -> None:
    vertices, triangles = ellipsoid((0.1, 0.1, 0.1))
    ball = ObjectModel.from_mesh("ball", vertices, triangles)
    coarse = ball.coarsened(1500)
    assert 300 < len(coarse.triangles) <= 1500
    radius = np.linalg.norm(coarse.vertices[coarse.triangles].reshape(-1, 3), axis=1)
    assert radius.min() > 0.097
    assert radius.max() <= 0.1 + 1e-9
    assert ball.coarsened(10**6) is ball
