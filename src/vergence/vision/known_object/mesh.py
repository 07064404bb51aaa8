"""Sharp edges and corners of triangle meshes."""

import numpy as np

from vergence.arrays import FloatArray, IntArray

SAME_PLACE = 1e-5  # relative to the mesh's size: vertices this close are one
STRAIGHT_COSINE = np.cos(np.deg2rad(2.0))  # two edges at a smaller angle form one line
CORNER_SINE = np.sin(np.deg2rad(20.0))  # smallest angle at a corner


def merge_vertices(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Return vertices and triangles with coincident vertices merged and slivers removed."""
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    grid = np.round(vertices / max(SAME_PLACE * size, 1e-300)).astype(np.int64)
    _, first, number = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    merged = number.reshape(-1)[triangles]
    distinct = (
        (merged[:, 0] != merged[:, 1])
        & (merged[:, 1] != merged[:, 2])
        & (merged[:, 2] != merged[:, 0])
    )
    return vertices[first], merged[distinct]


def triangle_normals(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the unit normals of triangles, (F, 3); zero for one without area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    normals: FloatArray = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0.0)
    return normals


def sharp_edges(
    vertices: FloatArray, triangles: IntArray, normals: FloatArray, sharp_rad: float
) -> tuple[IntArray, FloatArray]:
    """Return the end vertices of each sharp edge (E, 2), and the normals on both sides (E, 2, 3).

    An edge is sharp if the normals on its sides differ by more than an angle, or if it does not
    have two sides. At a border the second normal is the opposite of the first, so one of them is
    always visible.
    """
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    solid = np.linalg.norm(normals, axis=1)[owner] > 0.0
    pairs, owner = pairs[solid], owner[solid]
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    pairs, owner = pairs[order], owner[order]
    new = np.ones(len(pairs), dtype=bool)
    new[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    start = np.flatnonzero(new)
    count = np.diff(np.append(start, len(pairs)))
    first = normals[owner[start]]
    second = np.where(
        (count > 1)[:, None], normals[owner[start + np.minimum(count, 2) - 1]], -first
    )
    sharp = (count != 2) | (np.einsum("ij,ij->i", first, second) < np.cos(sharp_rad))
    return _straightened(vertices, pairs[start][sharp], np.stack((first, second), axis=1)[sharp])


def _straightened(
    vertices: FloatArray, pairs: IntArray, sides: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Join the edges that continue each other in a straight line."""
    around: dict[int, list[int]] = {}
    for edge, (a, b) in enumerate(pairs.tolist()):
        around.setdefault(a, []).append(edge)
        around.setdefault(b, []).append(edge)
    ends, kept, used = [], [], np.zeros(len(pairs), dtype=bool)
    for edge in range(len(pairs)):
        if used[edge]:
            continue
        used[edge] = True
        a, b = (_end_of_line(vertices, pairs, around, used, edge, int(v)) for v in pairs[edge])
        ends.append((a, b))
        kept.append(edge)
    return np.array(ends, dtype=np.int64).reshape(-1, 2), sides[kept].reshape(-1, 2, 3)


def _end_of_line(
    vertices: FloatArray,
    pairs: IntArray,
    around: dict[int, list[int]],
    used: np.typing.NDArray[np.bool_],
    edge: int,
    vertex: int,
) -> int:
    """Follow a line from an edge past one of its vertices; mark the edges; return its end."""
    while len(around[vertex]) == 2:
        following = next((e for e in around[vertex] if e != edge), edge)
        before = int(pairs[edge].sum()) - vertex
        after = int(pairs[following].sum()) - vertex
        d = vertices[vertex] - vertices[before]
        f = vertices[after] - vertices[vertex]
        if used[following] or d @ f < STRAIGHT_COSINE * np.linalg.norm(d) * np.linalg.norm(f):
            break
        used[following] = True
        edge, vertex = following, after
    return vertex


def corner_table(vertices: FloatArray, ends: IntArray) -> tuple[IntArray, IntArray]:
    """Return the vertices that are corners (C,), and the edges at each (C, K), padded with -1."""
    around: dict[int, list[int]] = {}
    for edge, pair in enumerate(ends.tolist()):
        for vertex in pair:
            around.setdefault(vertex, []).append(edge)
    corners = [v for v in sorted(around) if _turns(vertices, ends, v, around[v])]
    most = max((len(around[v]) for v in corners), default=1)
    table = np.full((len(corners), most), -1, dtype=np.int64)
    for row, vertex in zip(table, corners, strict=True):
        row[: len(around[vertex])] = around[vertex]
    return np.array(corners, dtype=np.int64), table


def _turns(vertices: FloatArray, ends: IntArray, vertex: int, edges: list[int]) -> bool:
    """Return whether two of the edges at a vertex differ in direction."""
    far = vertices[ends[edges].sum(axis=1) - vertex] - vertices[vertex]
    directions = far / np.linalg.norm(far, axis=1, keepdims=True)
    return bool(
        np.linalg.norm(np.cross(directions[:, None], directions), axis=2).max() > CORNER_SINE
    )


def is_closed(triangles: IntArray) -> bool:
    """Return whether every edge has two triangles that run along it in opposite directions."""
    start = triangles.reshape(-1)
    end = np.roll(triangles, -1, axis=1).reshape(-1)
    count = int(triangles.max()) + 1
    forward, backward = np.unique(start * count + end), np.unique(end * count + start)
    return len(forward) == len(start) and np.array_equal(forward, backward)


def clustered(
    vertices: FloatArray, triangles: IntArray, step: float
) -> tuple[FloatArray, IntArray]:
    """Return a mesh whose vertices in each cube of a grid are merged into their mean.

    Args:
        vertices: (V, 3), m.
        triangles: vertices of each, (F, 3).
        step: side of the cubes, m.
    """
    cubes = np.floor(vertices / step).astype(np.int64)
    _, number, members = np.unique(cubes, axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    means = np.zeros((len(members), 3))
    np.add.at(means, number, vertices)
    merged = number[triangles]
    apart = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    return means / members[:, None], merged[apart]
