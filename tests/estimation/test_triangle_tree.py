"""Nested boxes around the triangles of a surface."""

import numpy as np
import pytest

from vergence.estimation.triangle_tree import is_cut, ray_hits, triangle_tree


def one_by_one(triangles: np.ndarray, origin: np.ndarray, point: np.ndarray, touching: float):
    short_of = touching / np.linalg.norm(point - origin)
    return any(ray_hits(origin, point, triangle, short_of) for triangle in triangles)


def surfaces() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1.0, 1.0, (300, 1, 3))
    flat = rng.uniform(-1.0, 1.0, (200, 3, 3))
    flat[:, :, 2] = 0.5
    same = np.repeat(rng.uniform(-1.0, 1.0, (1, 3, 3)), 40, axis=0)
    return {
        "small": corners + 0.1 * rng.normal(size=(300, 3, 3)),
        "large": rng.uniform(-1.0, 1.0, (30, 3, 3)),
        "flat": flat,
        "all the same": same,
        "one": same[:1],
        "points": np.repeat(corners[:20], 3, axis=1),
    }


@pytest.mark.parametrize("kind", surfaces())
def test_a_segment_is_cut_where_one_of_the_triangles_cuts_it(kind: str) -> None:
    triangles, rng = surfaces()[kind], np.random.default_rng(6)
    tree, cut = triangle_tree(triangles), 0
    for k in range(400):
        origin, point = rng.uniform(-1.5, 1.5, (2, 3))
        if k % 4 == 1:
            point = triangles[k % len(triangles)].mean(axis=0)  # it ends on the surface
        if k % 4 == 2:
            point = origin + np.eye(3)[k % 3] * rng.uniform(-3.0, 3.0)  # along an axis
        touching = 1e-6 if k % 3 else 0.05
        expected = one_by_one(triangles, origin, point, touching)
        assert is_cut(tree, origin, point, touching) == expected
        cut += expected
    assert (cut > 0) == (kind != "points")


def test_every_triangle_is_in_the_boxes_around_it() -> None:
    triangles = surfaces()["small"]
    tree = triangle_tree(triangles)
    assert sorted(map(tuple, tree.triangles.reshape(-1, 9))) == sorted(
        map(tuple, triangles.reshape(-1, 9))
    )
    for box in range(len(tree.after)):
        inside = range(box, tree.after[box])
        for leaf in inside:
            corners = tree.triangles[tree.first[leaf] : tree.end[leaf]]
            assert (corners >= tree.low[box]).all()
            assert (corners <= tree.high[box]).all()
    assert (tree.end - tree.first).max() <= 8
    assert (tree.end - tree.first).sum() == len(triangles)


def test_nothing_cuts_a_segment_without_triangles() -> None:
    assert not is_cut(triangle_tree(np.empty((0, 3, 3))), np.zeros(3), np.ones(3), 0.0)
