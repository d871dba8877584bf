#!/usr/bin/env python3
"""Small solids built of convex pieces: writes models/<name>.obj.

usage: data/reference/minkowski/models.py

Every solid is a list of convex pieces that meet face to face, so that a sum of two is known as the union of the sums of
their pieces. Coordinates are integers, of which only the finished model is divided by a power of two: coplanar triangles are exactly
coplanar, and exact programs take them for one face.
"""

import itertools
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "models"

# Directions of integer length 65 around the circle, nearly evenly spread: sixteen of a turn.
AROUND = [(63, 16), (56, 33), (33, 56), (16, 63)]
CIRCLE = [(x, y) for x, y in AROUND] + [(-y, x) for x, y in AROUND]
CIRCLE += [(-x, -y) for x, y in CIRCLE]


class Solid:
    """Points, outward triangles between them, and the points of each convex piece."""

    def __init__(self, points, triangles, pieces):
        used, index = np.unique(triangles, return_inverse=True)
        self.points = np.array(points, dtype=np.float64)[used]
        self.triangles = index.reshape(-1, 3)
        self.pieces = [np.array(piece, dtype=np.float64) for piece in pieces]

    def mapped(self, matrix, divisor=1):
        """By an integer matrix of positive determinant, over a power of two."""
        matrix = np.array(matrix, dtype=np.float64)
        return Solid(
            self.points @ matrix.T / divisor, self.triangles, [piece @ matrix.T / divisor for piece in self.pieces]
        )


def volume6(a, b, c, d):
    """Six times the signed volume of a tetrahedron, positive where abc turns left seen from d's far side."""
    return int(round(np.linalg.det(np.array([b, c, d], dtype=np.float64) - np.array(a))))


def of_tetrahedra(points, tetrahedra):
    """What is left of their faces where each that two of them share is inside."""
    faces = {}
    for tetrahedron in tetrahedra:
        a, b, c, d = tetrahedron
        turn = volume6(*(points[i] for i in tetrahedron))
        if turn == 0:
            raise ValueError(f"a flat tetrahedron: {tetrahedron}")
        if turn < 0:
            a, b = b, a
        # Facing outwards, as d lies on the left of abc.
        for face in ((a, c, b), (a, b, d), (b, c, d), (a, d, c)):
            key = frozenset(face)
            if faces.pop(key, None) is None:
                faces[key] = face
    return Solid(points, list(faces.values()), [[points[i] for i in t] for t in tetrahedra])


def of_cells(planes, inside):
    """Cells between the planes x, y and z = planes[i], those for which `inside` says so of their indices (i, j, k)."""
    index, points = {}, []

    def corner(*ijk):
        if ijk not in index:
            index[ijk] = len(points)
            points.append([planes[axis][i] for axis, i in enumerate(ijk)])
        return index[ijk]

    cells = {c for c in itertools.product(*(range(len(p) - 1) for p in planes)) if inside(*c)}
    triangles, pieces = [], []
    for cell in sorted(cells):
        corners = list(itertools.product(*((i, i + 1) for i in cell)))
        pieces.append([[planes[axis][i] for axis, i in enumerate(c)] for c in corners])
        for axis, side in itertools.product(range(3), range(2)):
            beyond = tuple(i + (2 * side - 1 if n == axis else 0) for n, i in enumerate(cell))
            if beyond in cells:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            quad = []
            for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
                ijk = list(cell)
                ijk[axis] += side
                ijk[u] += du
                ijk[v] += dv
                quad.append(corner(*ijk))
            a, b, c, d = quad if side else quad[::-1]
            triangles += [(a, b, c), (a, c, d)]
    return Solid(points, triangles, pieces)


def of_box(low, high):
    return of_cells([[a, b] for a, b in zip(low, high)], lambda *_: True)


def ring_of(section, directions):
    """A section, points (r, z) around a convex polygon counter-clockwise, carried around the z axis in flat sectors."""
    around, across = len(directions), len(section)
    points = [(r * x, r * y, z) for x, y in directions for r, z in section]
    triangles, pieces = [], []
    for i in range(around):
        here, there = i * across, (i + 1) % around * across
        pieces.append([points[n + k] for n in (here, there) for k in range(across)])
        for k in range(across):
            a, b = here + k, here + (k + 1) % across
            c, d = there + (k + 1) % across, there + k
            triangles += [(a, d, c), (a, c, b)]
    return Solid(points, triangles, pieces)


def tube_of(rings):
    """Triangles one after the other and around: between two of them three tetrahedra, by the order of their corners."""
    points = [corner for ring in rings for corner in ring]
    tetrahedra = []
    for i in range(len(rings)):
        a, b = ([3 * n + k for k in range(3)] for n in (i, (i + 1) % len(rings)))
        tetrahedra += [(a[0], a[1], a[2], b[2]), (a[0], a[1], b[1], b[2]), (a[0], b[0], b[1], b[2])]
    signs = {volume6(*(points[i] for i in t)) > 0 for t in tetrahedra[1::3]}
    if len(signs) != 1:
        raise ValueError("a tube that turns inside out")
    return of_tetrahedra(points, tetrahedra)


def cone_over(points, triangles):
    """The star from the origin over a surface of triangles."""
    points = [*points, (0, 0, 0)]
    return of_tetrahedra(points, [(a, b, c, len(points) - 1) for a, b, c in triangles])


def l_solid():
    """The unit cube but for a quarter: of volume 3/4."""
    return of_cells([[0, 1, 2], [0, 1, 2], [0, 2]], lambda i, j, _: i + j < 2).mapped(np.eye(3), 2)


def hollow_cube():
    return of_cells([[-4, -2, 2, 4]] * 3, lambda *c: c != (1, 1, 1))


def nested_cubes():
    """A hollow cube within a hollow cube: two solids, and a cavity around the one in the other's and one in it."""
    return of_cells([[-9, -7, -3, -1, 2, 4, 7, 9]] * 3, lambda *c: shell(c, 0, 6) or shell(c, 2, 4))


def shell(cell, low, high):
    """Whether a cell lies on the surface of the cube of cells from low to high."""
    return all(low <= i <= high for i in cell) and any(i in (low, high) for i in cell)


def windowed_box():
    """A hollow cube with a window of 1 by 2 in one wall: no cavity yet."""
    planes = [[-4, -3, 3, 4], [-4, -3, -1, 0, 3, 4], [-4, -3, 0, 2, 3, 4]]
    return of_cells(planes, lambda i, j, k: (i != 1 or j in (0, 4) or k in (0, 4)) and (i, j, k) != (2, 2, 2))


def pitted_cube():
    """A cavity small against the cube, which a ring can go around."""
    return of_cells([[-10, -1, 1, 10]] * 3, lambda *c: c != (1, 1, 1))


def square_ring():
    """A square hole through a slab."""
    return of_cells([[-4, -2, 2, 4], [-4, -2, 2, 4], [0, 2]], lambda i, j, _: (i, j) != (1, 1))


def dumbbell():
    """Two plates and a bar between them, away from their middles and from the origin."""
    planes = [[10, 13, 14, 17], [20, 22, 23, 26], [-31, -30, -22, -21]]
    return of_cells(planes, lambda i, j, k: k != 1 or (i, j) == (1, 1))


def wedge_ball():
    """48 corners, all permutations and signs of (2, 5, 7), and their hull's 26 faces: convex."""
    corners = [
        tuple(s * x for s, x in zip(signs, order))
        for order in itertools.permutations((2, 5, 7))
        for signs in itertools.product((-1, 1), repeat=3)
    ]
    return hull_of(corners)


def hull_of(corners):
    """Faces by their planes, in integers: every plane through three corners that has none beyond it."""
    points = np.array(corners)
    planes = {}
    for a, b, c in itertools.combinations(range(len(points)), 3):
        normal = np.cross(points[b] - points[a], points[c] - points[a])
        if not normal.any():
            continue
        normal //= np.gcd.reduce(normal)
        heights = points @ normal
        for outward in (normal, -normal):
            if (points @ outward <= points[a] @ outward).all():
                planes[tuple(outward)] = np.flatnonzero(heights == heights[a])
    triangles = []
    for normal, face in planes.items():
        middle = points[face].mean(axis=0)
        u = points[face[0]] - middle
        v = np.cross(normal, u) / np.linalg.norm(normal)
        order = sorted(face, key=lambda i: np.arctan2((points[i] - middle) @ v, (points[i] - middle) @ u))
        triangles += [(order[0], order[i], order[i + 1]) for i in range(1, len(order) - 1)]
    return Solid(corners, triangles, [corners])


def tetrahedron():
    """No two edges alike, and the origin on no plane of it."""
    return of_tetrahedra([(-3, -2, -2), (4, -1, -3), (-1, 5, -1), (1, 1, 4)], [(0, 1, 2, 3)])


def star():
    """A spike, no two alike, on every face of a cube."""
    cube = list(itertools.product((-5, 5), repeat=3))
    spikes = [(-19, 1, 2), (17, -2, 1), (1, -18, -1), (-2, 20, 1), (2, 1, -17), (-1, -2, 19)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [
        (8 + f, face[i], face[(i + 1) % 4]) for f, face in enumerate(faces) for i in range(4)
    ]
    return cone_over([*cube, *spikes], triangles)


def hexagon_torus(directions, middle, half):
    """Around the circle with a section of six corners, `half` of `middle` wide."""
    r, s = middle, half
    section = [(r + s, 0), (r + s // 2, 7 * 65 * s // 8), (r - s // 2, 7 * 65 * s // 8)]
    section += [(r - s, 0), (r - s // 2, -7 * 65 * s // 8), (r + s // 2, -7 * 65 * s // 8)]
    return ring_of(section, directions)


# Three times a rotation, all of whose entries are integers.
TURN = [[2, -1, 2], [2, 2, -1], [-1, 2, 2]]


def torus():
    return hexagon_torus(CIRCLE[::2], 64, 16).mapped(np.eye(3), 1024)


def turned_torus():
    return hexagon_torus(CIRCLE[::2], 64, 16).mapped(TURN, 4096)


def trefoil(segments):
    """A tube of triangular section along the trefoil knot, its corners rounded to 32nds."""
    turn = 2 * np.pi * np.arange(segments) / segments

    def curve(t):
        return np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=-1)

    middle = curve(turn)
    ahead = curve(turn + 1e-3) - curve(turn - 1e-3)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    # A frame that returns to itself: the knot lies on a torus, and its direction outwards is never along it.
    outward = middle * [1, 1, 0]
    outward -= (outward * ahead).sum(axis=1)[:, None] * ahead
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    side = np.cross(ahead, outward)
    corners = [outward * np.cos(p) + side * np.sin(p) for p in 2 * np.pi * np.arange(3) / 3]
    rings = np.stack([middle + 0.35 * corner for corner in corners], axis=1)
    corners = np.rint(rings * 32).astype(int).tolist()
    return tube_of([[tuple(corner) for corner in ring] for ring in corners]).mapped(np.eye(3), 32)


MODELS = {
    "l_solid": l_solid,
    "cube": lambda: of_box([-1] * 3, [1] * 3),
    "turned_cube": lambda: of_box([-1] * 3, [1] * 3).mapped(TURN, 4),
    "large_cube": lambda: of_box([-3] * 3, [3] * 3),
    "bar": lambda: of_box([5, -1, -1], [6, 2, 1]),
    "hollow_cube": hollow_cube,
    "nested_cubes": nested_cubes,
    "windowed_box": windowed_box,
    "pitted_cube": pitted_cube,
    "square_ring": square_ring,
    "dumbbell": dumbbell,
    "ball": lambda: wedge_ball().mapped(np.eye(3), 16),
    "tetrahedron": tetrahedron,
    "star": star,
    "torus": torus,
    "turned_torus": turned_torus,
    "knot": lambda: trefoil(24),
    "long_knot": lambda: trefoil(60),
}


def write_obj(path, solid):
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in solid.points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in solid.triangles.tolist()]
    path.write_text("".join(lines))


def main():
    FOLDER.mkdir(exist_ok=True)
    for name, make in MODELS.items():
        solid = make()
        write_obj(FOLDER / f"{name}.obj", solid)
        print(f"{name}: {len(solid.triangles)} triangles, {len(solid.pieces)} pieces")


if __name__ == "__main__":
    main()
