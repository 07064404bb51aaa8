"""The outline of a mesh at a pose: rendered as a mask with depth, and traced.

An outline rendered at the predicted pose is exact for that pose and needs no viewpoint templates,
which would be some degrees off and take seconds to prepare.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.camera.lens import HEIGHT, WIDTH, pixel_of
from vergence.vision.known_object.projection import in_camera

MOST_CELLS = 240  # along a side of the mask: an object of 120 px has two cells per pixel
LEAST_CELL_PX = 0.5
WALK_PX = 24.0  # distance from an outline up to which its surroundings are examined
_LEAST_CONTOUR = 16  # cells around; a smaller contour is ignored
_TANGENT = 7  # cells to either side that determine the direction of the outline
_AVERAGED = 3  # cells to either side over which positions are averaged, since they lie on a grid
_DEEPER = 3.0  # cells inward, where depth is read again
_SAME_PART = 0.01  # relative change of depth from cell to cell along an outline
_NEAR = 1e-6


class Grid(NamedTuple):
    """Cells of the normalized image plane."""

    x: float  # normalized coordinates of the centre of cell (0, 0)
    y: float
    cell: float  # side of a cell, normalized
    columns: int
    rows: int


class Outline(NamedTuple):
    """Places on the outline of an object at a pose."""

    points: FloatArray  # (N, 3) object's frame, m
    points_px: FloatArray  # (N, 2)
    normals: FloatArray  # (N, 2) unit normals in the image, away from the object
    inside_px: FloatArray  # (N,) extent of the object inward along the normal, WALK_PX at most
    outside_px: FloatArray  # (N,) distance outward to another part of the object


def outline_of(
    T: FloatArray,
    lens: FloatArray,
    vertices: FloatArray,
    triangles: IntArray,
    closed: bool,
    count: int,
    most_cells: int = MOST_CELLS,
) -> Outline | None:
    """Return places evenly spaced on the outline; None if the object is not in front of the camera.

    Args:
        T: pose of the object in the camera, (4, 4).
        lens: packed camera, (11,).
        vertices: of the mesh, (V, 3), m.
        triangles: vertices of each, (F, 3), counter-clockwise from outside.
        closed: whether the mesh encloses a volume, so that back faces can be ignored.
        count: approximate number of places.
        most_cells: along a side of the mask.
    """
    import cv2

    projected, box = np.empty((len(vertices), 3)), np.empty(4)
    if not project_vertices(T, vertices, projected, box):
        return None
    grid = _grid_around(box, lens, most_cells)
    if grid is None:
        return None
    nearness = draw_nearness(projected, triangles, grid, closed)
    mask = (nearness > 0.0).view(np.uint8)
    contours, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    traced = [np.asarray(c[:, 0], dtype=np.int64) for c in contours if len(c) >= _LEAST_CONTOUR]
    if not traced:
        return None
    ends = np.cumsum([len(contour) for contour in traced])
    outline: Outline = places_along(T, lens, nearness, grid, np.concatenate(traced), ends, count)
    return outline


def _grid_around(box: FloatArray, lens: FloatArray, most_cells: int) -> Grid | None:
    """Return cells for the part of a box (4,) in the image plane that the camera may see."""
    focal = float(max(lens[0], lens[1]))
    # A distorted lens sees more or less than its pinhole model, so a larger area is rendered.
    left, top = -1.3 * lens[2] / lens[0], -1.3 * lens[3] / lens[1]
    right = 1.3 * (lens[WIDTH] - lens[2]) / lens[0]
    bottom = 1.3 * (lens[HEIGHT] - lens[3]) / lens[1]
    x, y = max(float(box[0]), left), max(float(box[1]), top)
    width, height = min(float(box[2]), right) - x, min(float(box[3]), bottom) - y
    if not (width > 0.0 and height > 0.0):
        return None
    cell = max(LEAST_CELL_PX / focal, max(width, height) / most_cells)
    return Grid(x - 2 * cell, y - 2 * cell, cell, int(width / cell) + 6, int(height / cell) + 6)


@njit(cache=True)
def project_vertices(
    T: FloatArray, vertices: FloatArray, projected: FloatArray, box: FloatArray
) -> bool:
    """Fill projected (V, 3) with normalized x, y and 1/z; return whether all are in front.

    The bounding box (4,) is filled as well: smallest x and y, largest x and y.
    """
    box[:2], box[2:] = np.inf, -np.inf
    for n in range(len(vertices)):
        x, y, z = in_camera(T, vertices[n])
        if z <= _NEAR:
            return False
        x, y = x / z, y / z
        projected[n, 0], projected[n, 1], projected[n, 2] = x, y, 1.0 / z
        box[0], box[1] = min(box[0], x), min(box[1], y)
        box[2], box[3] = max(box[2], x), max(box[3], y)
    return True


@njit(cache=True, error_model="numpy")
def draw_nearness(
    projected: FloatArray, triangles: IntArray, grid: Grid, front_only: bool
) -> FloatArray:
    """Return 1/z of the nearest face in each cell, (rows, columns), 0 where there is none.

    Unlike z, 1/z is linear in the image, and so are the barycentric coordinates w of a triangle.

    Args:
        projected: x, y, 1/z of each vertex, (V, 3).
        triangles: vertices of each, (F, 3).
        grid: the cells.
        front_only: whether back faces are ignored, as a closed mesh allows.
    """
    nearness = np.zeros((grid.rows, grid.columns))
    scale = 1.0 / grid.cell
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay = (projected[a, 0] - grid.x) * scale, (projected[a, 1] - grid.y) * scale
        bx, by = (projected[b, 0] - grid.x) * scale - ax, (projected[b, 1] - grid.y) * scale - ay
        cx, cy = (projected[c, 0] - grid.x) * scale - ax, (projected[c, 1] - grid.y) * scale - ay
        area = bx * cy - cx * by
        if abs(area) < 1e-12 or (front_only and area > 0.0):
            continue
        top = max(int(np.ceil(ay + min(0.0, by, cy))), 0)
        bottom = min(int(np.floor(ay + max(0.0, by, cy))), grid.rows - 1)
        # Per column and row: the barycentric coordinates of b, c and a.
        across = (cy / area, -by / area, (by - cy) / area)
        down = (-cx / area, bx / area, (cx - bx) / area)
        near = projected[a, 2]
        to_b, to_c = projected[b, 2] - near, projected[c, 2] - near
        slope = across[0] * to_b + across[1] * to_c
        for row in range(top, bottom + 1):
            below = row - ay
            left, right = -ax, grid.columns - 1 - ax
            for k in range(3):
                share = down[k] * below + (1.0 if k == 2 else 0.0)
                if across[k] > 0.0:
                    left = max(left, -share / across[k])
                elif across[k] < 0.0:
                    right = min(right, -share / across[k])
                elif share < 0.0:
                    right = left - 1.0
            first, last = int(np.ceil(left + ax)), int(np.floor(right + ax))
            value = near + below * (down[0] * to_b + down[1] * to_c) + (first - ax) * slope
            for column in range(first, last + 1):
                if value > nearness[row, column]:
                    nearness[row, column] = value
                value += slope
    return nearness


@njit(cache=True)
def places_along(
    T: FloatArray,
    lens: FloatArray,
    nearness: FloatArray,
    grid: Grid,
    cells: IntArray,
    ends: IntArray,
    count: int,
) -> Outline:
    """Return places evenly spaced along traced contours.

    Args:
        T: pose of the object in the camera, (4, 4).
        lens: packed camera, (11,).
        nearness: as rendered.
        grid: its cells.
        cells: (column, row) of the outermost cells of the object, (P, 2), contour after contour.
        ends: end index of each contour, (C,).
        count: number of places.
    """
    spacing = max(len(cells) / count, 1.0)
    most = int(len(cells) / spacing) + len(ends)
    points, pixels, normals = np.empty((most, 3)), np.empty((most, 2)), np.empty((most, 2))
    inside, outside = np.empty(most), np.empty(most)
    filled, first = 0, 0
    normal = np.empty(2)
    steps = int(WALK_PX / (grid.cell * lens[0])) + 1
    for e in range(len(ends)):
        length = ends[e] - first
        for k in range(int(length / spacing)):
            here = int(k * spacing)
            column, row = cells[first + here, 0], cells[first + here, 1]
            if not _normal_at(nearness, cells, first, length, here, normal):
                continue
            # Cells whose centres are covered lie inside, by half a cell on average.
            shift = 0.5 * max(abs(normal[0]), abs(normal[1]))
            x = grid.x + grid.cell * (column + shift * normal[0])
            y = grid.y + grid.cell * (row + shift * normal[1])
            z = _depth_near(nearness, cells, first, length, here, normal, shift)
            _to_object(T, x * z, y * z, z, points[filled])
            u, v = pixel_of(lens, x, y)
            du, dv = pixel_of(lens, x - grid.cell * normal[1], y + grid.cell * normal[0])
            du, dv = du - u, dv - v
            size = np.sqrt(du * du + dv * dv)
            pixels[filled, 0], pixels[filled, 1] = u, v
            normals[filled, 0], normals[filled, 1] = dv / size, -du / size
            px = size  # size of one cell
            inside[filled] = px * _walk(nearness, column, row, -normal, steps, True)
            outside[filled] = px * _walk(nearness, column, row, normal, steps, False)
            filled += 1
        first = ends[e]
    return Outline(
        points[:filled], pixels[:filled], normals[:filled], inside[:filled], outside[:filled]
    )


@njit(cache=True)
def _normal_at(
    nearness: FloatArray, cells: IntArray, first: int, length: int, here: int, normal: FloatArray
) -> bool:
    """Fill normal (2,), outward, in cells; return whether the contour has a direction here."""
    along_x, along_y = 0.0, 0.0
    for k in range(_TANGENT - _AVERAGED, _TANGENT + _AVERAGED + 1):
        after, before = first + (here + k) % length, first + (here - k) % length
        along_x += cells[after, 0] - cells[before, 0]
        along_y += cells[after, 1] - cells[before, 1]
    size = np.sqrt(along_x * along_x + along_y * along_y)
    if size < 1.0:
        return False
    normal[0], normal[1] = along_y / size, -along_x / size
    column, row = cells[first + here, 0], cells[first + here, 1]
    if _covered(nearness, column + 2.0 * normal[0], row + 2.0 * normal[1]):
        normal[0], normal[1] = -normal[0], -normal[1]
    return not _covered(nearness, column + 2.0 * normal[0], row + 2.0 * normal[1])


@njit(cache=True)
def _covered(nearness: FloatArray, column: float, row: float) -> bool:
    c, r = int(np.floor(column + 0.5)), int(np.floor(row + 0.5))
    if not (0 <= r < nearness.shape[0] and 0 <= c < nearness.shape[1]):
        return False
    filled: bool = nearness[r, c] > 0.0
    return filled


@njit(cache=True)
def _depth_near(
    nearness: FloatArray,
    cells: IntArray,
    first: int,
    length: int,
    here: int,
    normal: FloatArray,
    shift: float,
) -> float:
    """Return the mean depth of the outline around one of its cells, within one part of it."""
    middle = _depth_at(nearness, cells[first + here, 0], cells[first + here, 1], normal, shift)
    total, count = middle, 1
    for k in range(-_AVERAGED, _AVERAGED + 1):
        n = first + (here + k) % length
        z = _depth_at(nearness, cells[n, 0], cells[n, 1], normal, shift)
        if k != 0 and abs(z - middle) < _SAME_PART * middle:
            total += z
            count += 1
    return total / count


@njit(cache=True)
def _depth_at(
    nearness: FloatArray, column: int, row: int, normal: FloatArray, shift: float
) -> float:
    """Return the depth of the outline next to a cell.

    A round surface recedes from its outline as √d at a distance d inward; two depths determine it.
    """
    near: float = 1.0 / nearness[row, column]
    c, r = (
        int(np.floor(column - _DEEPER * normal[0] + 0.5)),
        int(np.floor(row - _DEEPER * normal[1] + 0.5)),
    )
    if not (0 <= r < nearness.shape[0] and 0 <= c < nearness.shape[1]) or nearness[r, c] <= 0.0:
        return near
    steepness = (near - 1.0 / nearness[r, c]) / (np.sqrt(shift + _DEEPER) - np.sqrt(shift))
    far: float = near + max(steepness, 0.0) * np.sqrt(shift)
    return far


@njit(cache=True)
def _to_object(T: FloatArray, x: float, y: float, z: float, point: FloatArray) -> None:
    dx, dy, dz = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    for i in range(3):
        point[i] = T[0, i] * dx + T[1, i] * dy + T[2, i] * dz


@njit(cache=True)
def _walk(
    nearness: FloatArray, column: int, row: int, direction: FloatArray, steps: int, covered: bool
) -> int:
    """Return for how many cells from an outline in a direction the object extends, or is absent."""
    for k in range(1, steps + 1):
        k_column, k_row = column + k * direction[0], row + k * direction[1]
        if _covered(nearness, k_column, k_row) != covered:
            return k - 1
    return steps
