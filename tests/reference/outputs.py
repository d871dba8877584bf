#!/usr/bin/env python3
"""Checks that result meshes are solids that other programs accept, with the volume of the exact Boolean.

usage: outputs.py --program LDI-OPS [--corpus DIR | --self-test] [--verbose]

Runs `intersect`, `union`, `difference` and `xor` with `-o` on pairs of data/reference/pairs.toml, every operation in every
format and by both methods, or on pairs of the corpus of real meshes. lib3mf (3MF) or trimesh reads each written mesh, which
must be

- a closed 2-manifold: each directed edge once and its opposite once, the triangles around a vertex one fan; by trimesh
  watertight and of one winding; by manifold3d without error;
- as the JSON states: vertices, triangles, components, genus, volume;
- near manifold3d's exact Boolean of the same coordinates, or, where an input crosses itself, CGAL's: its volume within
  `allowed_volume`, its box no more than `REACH` pitches larger;
- if it is an exact mesh, of that volume, area and box to the rounding of the format, with no more crossing triangles than its
  inputs have, by CGAL's exact kernel (but for `xor` and 3MF), and, beside manifold3d's, of that number of parts and genus with
  no more than `MORE_TRIANGLES` of its triangles.

Exits 1 with a table of the differences. `--self-test` damages meshes and falsifies the JSON and the references, and exits 1
unless the check finds every damage.
"""

import concurrent.futures
import dataclasses
import functools
import itertools
import json
import os
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import harness
import manifold3d
import numpy as np
import packages
import trimesh
from igl.copyleft import cgal
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "reference"))
import manifold_reference  # noqa: E402
import pairs  # noqa: E402

# Formats, and the share of a coordinate by which they round it.
FORMATS = {"stl": 6e-8, "obj": 1e-15, "ply": 1e-15, "off": 1e-15, "glb": 6e-8, "3mf": 6e-8}

OPERATIONS = ("intersect", "union", "difference", "xor")

# Pairs in general position, and those special pairs whose results other programs represent, too.
DATA_PAIRS = (
    "spheres",
    "tori",
    "geodesic_cylinder",
    "rotated_boxes",
    "gyroid_bone",
    "cubic_lattice_bone",
    "bcc_lattice_sphere",
    "primitive_diamond",
    "thin_sheet_box",
    "nearly_equal_boxes",
    "coincident_gyroid",
    "disjoint",
    "linked_tori",
    "contained",
    "flush_boxes",
    "face_contact",
    "edge_contact",
    "box_rotated_45",
)
# The pairs whose first and third operation are also made from conservative images, and also simplified.
CONSERVATIVE_PAIRS = ("rotated_boxes", "gyroid_bone", "primitive_diamond", "contained")
SIMPLIFIED_PAIRS = ("spheres", "rotated_boxes", "gyroid_bone")
SIMPLIFY = 0.1  # pitches
# The bound of a mesh of images without --surface-error.
DEFAULT_BOUND = 0.05

# The triangles of an exact mesh, as a multiple of manifold3d's, which merges triangles of one plane.
MORE_TRIANGLES = 1.6

# The distance, in pitches, by which a mesh may exceed the exact box. A vertex belongs to a cell with a node inside; it may leave
# the cell by this distance, towards the point where the planes of its crossings meet.
REACH = 1.0

# A metre in the unit of a result; every format keeps numbers without a unit.
PER_METRE = {None: 1.0, "um": 1e6, "mm": 1e3, "cm": 1e2, "m": 1.0, "in": 1 / 0.0254, "ft": 1 / 0.3048}


@dataclasses.dataclass(frozen=True)
class Case:
    """A command line that writes a mesh, and two meshes by (file, placement or None)."""

    operation: str
    a: tuple
    b: tuple
    suffix: str
    mode: str = "exact"
    resolution: int = 128
    simplified: bool = False
    # `sampled` or `exact`; None leaves the choice to the program.
    method: str | None = "sampled"
    # Whether an input crosses itself: the fill rule is non-zero, and CGAL the reference. manifold3d's Boolean is wrong then.
    crossed: bool = False

    @property
    def bound(self):
        """The distance in pitches by which a mesh of images may move to lose triangles; None if none is asked for."""
        return SIMPLIFY if self.simplified else {"sampled": 0.0}.get(self.method)

    def arguments(self, out, told):
        """Returns the command line without the program."""
        words = [self.operation, self.a[0], self.b[0], "--mode", self.mode, "--resolution", self.resolution]
        for side, placement in (("a", self.a[1]), ("b", self.b[1])):
            words += [f"--transform-{side}", placement] if placement else []
        words += ["--surface-error", f"{self.bound}h"] if self.bound is not None else []
        words += ["--mesh", self.method] if self.method else []
        words += ["--fill", "nonzero"] if self.crossed else []
        return [str(word) for word in (*words, "--quiet", "--json", told, "-o", out)]

    def describe(self):
        names = " ".join(Path(side[0]).stem for side in (self.a, self.b))
        simplified = " simplified" if self.simplified else ""
        method = self.method or "best"
        return f"{self.operation} {names} {self.mode} {self.resolution} {method}{simplified} .{self.suffix}"


@dataclasses.dataclass(frozen=True)
class Mesh:
    """Points in f64 and triangles, as a reader returned them."""

    points: np.ndarray
    faces: np.ndarray


@dataclasses.dataclass(frozen=True)
class Reference:
    """The expected values: volume, area, the sum over edges of length × dihedral angle, and the box (None: empty); triangles,
    components and genus, where they are known."""

    volume: float
    area: float
    bending: float
    bounds: np.ndarray | None
    triangles: int | None = None
    topology: tuple | None = None


# Reading


def read(path):
    """Returns the mesh of a file by the file's own indices, except for STL, whose corners of equal coordinates become one."""
    if path.suffix == ".3mf":
        package = packages.read(path)
        if not package.is_manifold:
            raise ValueError("lib3mf does not take the object for manifold and oriented")
        return Mesh(package.points, package.faces)
    if path.suffix.lower() == ".stl":
        return Mesh(*pairs.read(path))
    mesh = trimesh.load(path, force="mesh", process=False)
    return Mesh(np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64))


# Measuring


def signed_volume(mesh):
    if len(mesh.faces) == 0:
        return 0.0
    points = mesh.points - mesh.points.mean(axis=0)
    a, b, c = (points[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def directed_edges(faces):
    """Returns all edges, each as one number, and the opposite edges; edge e belongs to triangle e % len(faces)."""
    start, end = faces.T.reshape(-1), np.roll(faces, -1, axis=1).T.reshape(-1)
    count = int(faces.max()) + 1
    return start * count + end, end * count + start


def opposites(faces):
    """Returns the opposite of each directed edge; None unless every edge occurs once in each direction."""
    edges, reverse = directed_edges(faces)
    order = np.argsort(edges)
    placed = edges[order]
    if (placed[1:] == placed[:-1]).any():
        return None
    at = np.minimum(np.searchsorted(placed, reverse), len(placed) - 1)
    return order[at] if (placed[at] == reverse).all() else None


def measure(mesh):
    """Returns volume, area, bending and box of a closed mesh."""
    corners = mesh.points[mesh.faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(doubled, axis=1)
    normals = doubled / np.where(sizes > 0, sizes, 1)[:, None]
    twin, count = opposites(mesh.faces), len(mesh.faces)
    here = np.arange(3 * count) % count
    there = twin % count
    lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).T.reshape(-1)
    angles = np.arccos(np.clip(np.einsum("ij,ij->i", normals[here], normals[there]), -1, 1))
    # A triangle without area has no normal.
    angles[(sizes[here] == 0) | (sizes[there] == 0)] = 0
    # Each edge was counted twice.
    bending = float((lengths * angles).sum() / 2)
    used = mesh.points[np.unique(mesh.faces)]
    return Reference(signed_volume(mesh), float(sizes.sum() / 2), bending, np.array([used.min(0), used.max(0)]))


EMPTY = Reference(0.0, 0.0, 0.0, None)


def of_manifold(solid):
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"manifold3d refuses: {solid.status().name}")
    if solid.is_empty():
        return EMPTY
    mesh = solid.to_mesh64()
    found = Mesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts).astype(np.int64))
    return dataclasses.replace(measure(found), triangles=len(found.faces), topology=components_and_genus(found))


@functools.cache
def welded(file):
    """Reads a file. Equal points become one, as in a soup; GLB splits vertices where normals differ."""
    mesh = read(Path(file))
    points, index = np.unique(mesh.points + 0.0, axis=0, return_inverse=True)
    faces = index.reshape(-1)[mesh.faces]
    a, b, c = faces.T
    return Mesh(points, faces[(a != b) & (b != c) & (c != a)])


@functools.cache
def placed(file, placement):
    """Returns manifold3d's solid of a file."""
    mesh = welded(file)
    return manifold_reference.solid((pairs.transform(mesh.points, placement) if placement else mesh.points, mesh.faces))


@functools.cache
def reference(operation, a, b):
    """Measures manifold3d's result of an operation; the two halves of an xor touch, and are measured separately."""
    a, b = placed(*a), placed(*b)
    if operation == "xor":
        one, other = of_manifold(a - b), of_manifold(b - a)
        bounds = [half.bounds for half in (one, other) if half.bounds is not None]
        box = np.array([np.min(bounds, axis=0)[0], np.max(bounds, axis=0)[1]]) if bounds else None
        return Reference(one.volume + other.volume, one.area + other.area, one.bending + other.bending, box)
    return of_manifold({"intersect": a.__xor__, "union": a.__add__, "difference": a.__sub__}[operation](b))


@functools.cache
def non_zero(file, placement):
    """Returns the solid of a file under the non-zero rule by CGAL, which keeps what a mesh winds around forwards: the parts that
    it winds around forwards, and those that it winds around backwards."""
    mesh = welded(file)
    points = pairs.transform(mesh.points, placement) if placement else mesh.points
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    forwards, backwards = (by_cgal("union", Mesh(points, faces), nothing) for faces in (mesh.faces, mesh.faces[:, ::-1]))
    both = np.vstack([forwards.faces, backwards.faces + len(forwards.points)])
    return Mesh(np.vstack([forwards.points, backwards.points]), both)


def by_cgal(operation, a, b):
    """Returns CGAL's Boolean of two meshes."""
    sides = (part for mesh in (a, b) for part in (mesh.points, np.ascontiguousarray(mesh.faces)))
    points, faces, *_ = cgal.mesh_boolean(*sides, {"difference": "minus"}.get(operation, operation))
    return Mesh(np.array(points), np.array(faces, dtype=np.int64))


@functools.cache
def crossed_reference(operation, a, b):
    """Returns volume, area and box of CGAL's result, which is exact until its points are rounded."""
    mesh = by_cgal(operation, non_zero(*a), non_zero(*b))
    area = trimesh.Trimesh(mesh.points, mesh.faces, process=False).area
    return signed_volume(mesh), area, np.array([mesh.points.min(axis=0), mesh.points.max(axis=0)])


def components_and_genus(mesh):
    """Returns the number of components, and the genus of all together by Euler's formula."""
    vertices, faces = len(mesh.points), mesh.faces
    links = coo_array((np.ones(faces.size), (faces.reshape(-1), np.roll(faces, 1, axis=1).reshape(-1))), (vertices,) * 2)
    components = connected_components(links, directed=False)[0]
    euler = vertices - 3 * len(faces) // 2 + len(faces)
    return components, components - euler // 2


def fans(faces, twin):
    """Counts the fans of triangles around vertices; a 2-manifold has as many as vertices."""
    # Corner i of a triangle starts its edge i. The corner of the neighbour that shares this vertex ends the opposite edge, and
    # therefore starts the edge after it.
    count = len(faces)
    corner = np.arange(3 * count)
    following = (twin // count + 1) % 3 * count + twin % count
    links = coo_array((np.ones(3 * count), (corner, following)), (3 * count,) * 2)
    return connected_components(links, directed=False)[0]


# Judging


def allowed_volume(right, told, case):
    """Returns the allowed difference of the volume of a mesh from the exact one.

    Dual contouring puts its vertices on the tangent planes of the crossings of a cell, so that flat faces, and straight edges and
    corners between them, are exact. It misses curvature within a cell: a curve of curvature κ lies up to κ h² / 8 from its chord,
    or from its tangents, over a pitch h. Summed over the surface this is h² / 8 ∫ κ dA, and ∫ κ dA of a polyhedron is the sum
    over its edges of length × dihedral angle. Parts between two neighbouring nodes are missed as a whole: each wall and gap that
    the JSON counts is a pixel wide, and between zero and a pitch thick, half a pitch on average. The same holds for the part that
    is cut off where a vertex had to stay in its cell, and for a node about which the images disagree. Both crossings of a wall or gap
    that it does not count are within 0.05 pitches of the mesh, as at a sharp edge, which the sum over edges covers. Simplification
    moves the surface by its bound. An exact mesh is off by the rounding of its coordinates alone, over its area; and lib3mf reads the
    coordinates of inputs in 32 bits.
    """
    pitch, surface = told["grid"]["pitch"], told["surface"]
    if surface["method"] == "exact":
        return rounding(right, case) * right.area + 1e-7 * abs(right.volume)
    lost = sum(surface["sub_resolution"].values()) + surface["blunted_vertices"] + surface["disagreements"]
    moved = bound_of(case) * pitch * right.area
    return pitch**2 / 8 * right.bending + lost * pitch**3 / 2 + moved + 1e-7 * abs(right.volume)


def bound_of(case):
    """Returns the distance in pitches by which a mesh of images may move."""
    return DEFAULT_BOUND if case.bound is None else case.bound


def rounding(right, case):
    """Returns the distance by which a format moves a coordinate of a result, and vertices move that would fall together."""
    return 0.0 if right.bounds is None else 4 * FORMATS[case.suffix] * np.abs(right.bounds).max()


def exact_complaints(case, mesh, told, right):
    """Returns the differences of an exact mesh from manifold3d's, besides its volume."""
    rows = []
    if case.method is not None and told["surface"]["method"] != case.method:
        rows.append(("method", case.method, told["surface"]["method"]))
    if told["surface"]["method"] != "exact":
        return rows
    said, found = told["volume"]["value"], signed_volume(mesh)
    if not abs(found - said) <= rounding(right, case) * right.area + told["volume"]["exact_error"]:
        rows.append(("exact volume", said, found))
    # The halves of an xor touch, and rounding moves them apart by steps; and lib3mf rounds what was written in 64 bits to 32.
    if case.operation != "xor" and case.suffix != "3mf":
        given, crossing = sum(crossings_of_file(file) for file, _ in (case.a, case.b)), crossing_pairs(mesh)
        if crossing > given:
            rows.append(("crossing pairs", given, crossing))
    # The halves of an xor may share faces, which are not part of its surface.
    area = trimesh.Trimesh(mesh.points, mesh.faces, process=False).area
    if case.operation != "xor" and not abs(area - right.area) <= 1e-6 * right.area:
        rows.append(("area", right.area, area))
    if right.topology is None:
        return rows
    if components_and_genus(mesh) != right.topology:
        rows.append(("components and genus", right.topology, components_and_genus(mesh)))
    if not len(mesh.faces) <= MORE_TRIANGLES * right.triangles + 64:
        rows.append(("triangles", f"{right.triangles} × {MORE_TRIANGLES}", len(mesh.faces)))
    return rows


def turn(a, b, c, d):
    """Returns six times the volume of a tetrahedron of rational points."""
    (x, y, z), (u, v, w), (p, q, r) = ([i - j for i, j in zip(point, a)] for point in (b, c, d))
    return x * (v * r - w * q) + y * (w * p - u * r) + z * (u * q - v * p)


def pierces(triangle, other):
    """Returns whether a side of a triangle goes through the inside of another."""
    a, b, c = other
    for p, q in itertools.permutations(triangle, 2):
        if turn(a, b, c, p) > 0 > turn(a, b, c, q):
            turns = [turn(p, q, *side) for side in ((a, b), (b, c), (c, a))]
            if min(turns) > 0 or max(turns) < 0:
                return True
    return False


def crossing_pairs(mesh):
    """Counts the pairs of triangles of which a side of one goes through the inside of the other. CGAL's exact kernel finds those
    that meet elsewhere than in corners and sides that they share; of these, rational arithmetic leaves out those that only touch or
    overlap in a plane."""
    found = cgal.remesh_self_intersections(mesh.points, mesh.faces, detect_only=True)[2]
    corners = lambda face: [[Fraction(x) for x in mesh.points[vertex].tolist()] for vertex in mesh.faces[face]]
    pairs_of_corners = ((corners(f), corners(g)) for f, g in found)
    return sum(pierces(f, g) or pierces(g, f) for f, g in pairs_of_corners)


@functools.cache
def crossings_of_file(file):
    return crossing_pairs(welded(file))


def structure_complaints(mesh):
    """Returns the defects that keep a mesh from being the boundary of a solid, as (name, expected, found)."""
    rows = []
    twin = opposites(mesh.faces)
    if twin is None:
        rows.append(("edges", "each once in each direction", "others"))
    else:
        around = fans(mesh.faces, twin)
        if around != len(mesh.points):
            rows.append(("fans around vertices", len(mesh.points), around))
    seen = trimesh.Trimesh(mesh.points, mesh.faces, process=False)
    for name in ("is_watertight", "is_winding_consistent"):
        if not getattr(seen, name):
            rows.append((f"trimesh {name}", True, False))
    status = manifold_reference.solid((mesh.points, mesh.faces)).status()
    if status != manifold3d.Error.NoError:
        rows.append(("manifold3d", "NoError", status.name))
    return rows


def said_complaints(case, mesh, told):
    """Returns the statements of the JSON about a mesh that are false."""
    surface = told["surface"]
    components, genus = components_and_genus(mesh)
    found = {"vertices": len(mesh.points), "triangles": len(mesh.faces), "components": components, "genus": genus}
    rows = [(f"JSON {name}", surface[name], value) for name, value in found.items() if surface[name] != value]
    # A coordinate that moves by a share of the size moves the volume by that share of size times area.
    size, volume = np.abs(mesh.points).max(), signed_volume(mesh)
    area = trimesh.Trimesh(mesh.points, mesh.faces, process=False).area
    if not abs(volume - surface["volume"]) <= FORMATS[case.suffix] * size * area + 1e-9 * abs(volume):
        rows.append(("JSON volume", surface["volume"], volume))
    return rows


def solid_complaints(case, mesh, told, right):
    """Returns the differences of a mesh from the expected solid."""
    rows = []
    pitch, volume = told["grid"]["pitch"], signed_volume(mesh)
    if not volume > 0:
        rows.append(("volume", "above zero", volume))
    allowed = allowed_volume(right, told, case)
    if not abs(volume - right.volume) <= allowed:
        rows.append(("volume", f"{right.volume} ± {allowed:.3g}", volume))
    if right.bounds is not None:
        bounds = np.array([mesh.points.min(axis=0), mesh.points.max(axis=0)])
        outwards = (bounds - right.bounds) * [[-1], [1]]
        # Tips that are thinner than a pixel may be lost, but whole edges must not be added.
        is_exact = told["surface"]["method"] == "exact"
        reach = rounding(right, case) + 1e-6 * np.ptp(right.bounds, axis=0).max() if is_exact else REACH * pitch
        if not outwards.max() <= reach or (is_exact and not outwards.min() >= -reach):
            rows.append(("box", right.bounds.tolist(), bounds.tolist()))
    return rows


def simplified_complaints(case, mesh, told):
    """Checks that a simplified mesh has fewer triangles, and stays within its bound."""
    simplified = told["surface"]["simplified"]
    if told["surface"]["method"] == "exact" or case.bound == 0:
        return [] if simplified is None else [("simplified", None, simplified)]
    if simplified is None:
        return [("simplified", f"within {bound_of(case)} pitches", None)]
    rows = []
    if not len(mesh.faces) < simplified["triangles_before"]:
        rows.append(("simplified", f"below {simplified['triangles_before']} triangles", len(mesh.faces)))
    bound = bound_of(case) * told["grid"]["pitch"] * (1 + 1e-9)
    if not simplified["distance"] <= bound:
        rows.append(("simplified", f"within {bound}", simplified["distance"]))
    return rows


def is_refused(mesh, told):
    """Returns whether the program refused to write a mesh far from the volume, and warned of it: there are too few rays."""
    surface, volume = told["surface"], told["volume"]["value"]
    said = any(warning["code"] == "mesh-far-from-volume" for warning in told["warnings"])
    return mesh is None and said and surface["path"] is None and abs(surface["volume"] - volume) > 0.01 * volume


def complaints(case, mesh, told, right):
    """Returns the faults of the written file as (name, expected, found); `mesh` is None where there is no file."""
    if is_refused(mesh, told):
        return []
    if mesh is None:
        rows = [] if told["surface"]["path"] is None and told["surface"]["triangles"] == 0 else [("file", "there", None)]
        # A result may be empty only if it is finer than the grid, or empty in truth.
        if not right.volume <= allowed_volume(right, told, case):
            rows.append(("volume", right.volume, "no mesh"))
        return rows
    rows = structure_complaints(mesh)
    rows += said_complaints(case, mesh, told)
    rows += simplified_complaints(case, mesh, told)
    rows += exact_complaints(case, mesh, told, right)
    return rows + solid_complaints(case, mesh, told, right)


# Cases


def data_cases():
    """Yields every operation on every pair, with the formats in turn, so that each operation occurs in each format."""
    suffixes = itertools.cycle(FORMATS)
    for pair in pairs.load(names=DATA_PAIRS):
        a, b = (str(pairs.ROOT / pair["a"]), None), (str(pairs.ROOT / pair["b"]), pair["transform_b"])
        for operation in OPERATIONS:
            suffix = next(suffixes)
            yield Case(operation, a, b, suffix)
            yield Case(operation, a, b, suffix, method="exact")
        # Four operations and six formats: without an extra step, each operation would occur in only three of them.
        next(suffixes)
        for operation in ("intersect", "difference"):
            if pair["name"] in CONSERVATIVE_PAIRS:
                yield Case(operation, a, b, next(suffixes), mode="over")
                yield Case(operation, a, b, next(suffixes), mode="under")
            if pair["name"] in SIMPLIFIED_PAIRS:
                yield Case(operation, a, b, next(suffixes), simplified=True)


# A, B, the turn of B, how far it is shifted from the middle of A, as a share of A's size, which B is scaled to, and whether one
# of the two crosses itself.
CORPUS_PAIRS = (
    ("meshes/fertility.off", "meshes/gyroid.stl", "rotate(1,2,3,41)", (0.03, 0.02, 0.01), False),
    ("meshes/bunny00.off", "meshes/gyroid.stl", "rotate(3,1,2,23)", (0.05, -0.03, 0.01), False),
    ("meshes/armadillo.obj", "meshes/TP_BCC-2.5mm.stl", "rotate(2,1,0.3,67)", (0.01, 0.04, -0.02), False),
    ("meshes/fandisk.off", "meshes/mengerSponge3.glb", "rotate(1,0.2,0.7,33)", (0.07, 0.02, 0.03), False),
    ("meshes/rocker-arm.obj", "meshes/torus.3mf", "rotate(1,0.5,0.1,52)", (0.1, 0.03, 0.02), False),
    ("meshes/femur_human.stl", "meshes/lattice_k.stl", "rotate(0.1,1,0.4,19)", (0.02, 0.01, 0.05), False),
    ("large/dragon_vrip.ply", "meshes/3holes.off", "rotate(1,1,0.2,71)", (0.02, 0.03, 0.01), True),
    ("meshes/bunny00.off", "meshes/bones.off", "rotate(1,0.3,2,29)", (0.02, 0.01, 0.03), True),
    ("meshes/fertility.off", "meshes/5cm_BCC-2.5mm.stl", "rotate(1,3,2,14)", (0.01, 0.02, 0.03), True),
)
# A and B whose place is right, and of which both cross themselves.
CORTEX = (("pia", "wm"), ("wm", "pia"))


def bounds_of(path):
    points = read(Path(path)).points
    return points.min(axis=0), points.max(axis=0)


def fitted(a, b, turn, shift):
    """Returns the placement that turns B and brings it to the size and place of A, shifted."""
    (low_a, high_a), (low_b, high_b) = bounds_of(a), bounds_of(b)
    size = np.max(high_a - low_a)

    def translate(vector):
        return f"translate({','.join(repr(float(x)) for x in vector)})"

    scale = f"scale({float(size / np.max(high_b - low_b))!r})"
    return f"{translate(-(low_b + high_b) / 2)} {turn} {scale} {translate((low_a + high_a) / 2 + np.array(shift) * size)}"


def corpus_cases(corpus):
    """Yields pairs of real meshes, brought to one place."""
    suffixes = itertools.cycle(FORMATS)
    for a, b, rotation, shift, crossed in CORPUS_PAIRS:
        a, b = str(corpus / a), str(corpus / b)
        placement = fitted(a, b, rotation, shift)
        for operation in ("intersect", "difference"):
            sides = (a, None), (b, placement)
            suffix = next(suffixes)
            for method in ("sampled", None):
                yield Case(operation, *sides, suffix, resolution=256, crossed=crossed, method=method)
    for a, b in CORTEX:
        sides = [(str(corpus / f"large/cortex_{name}_lh.ply"), None) for name in (a, b)]
        suffix = next(suffixes)
        for method in ("sampled", None):
            yield Case("difference", *sides, suffix, resolution=256, crossed=True, method=method)


# Running


def run(program, case):
    """Returns the mesh that a command line writes, and its JSON; None as the mesh where none was written."""
    with tempfile.TemporaryDirectory() as folder:
        out, told = Path(folder) / f"out.{case.suffix}", Path(folder) / "told.json"
        # A result without a mesh exits with 1; the reference decides whether that is right.
        harness.run([program, *case.arguments(out, told)], lambda code: code == (0 if out.exists() else 1))
        told = json.loads(told.read_text())
        mesh = read(out) if out.exists() else None
    if mesh is not None and case.suffix == "glb":
        # GLB is in metres, whatever the unit of the result.
        mesh = Mesh(mesh.points * PER_METRE[told["volume"]["unit"]], mesh.faces)
    return mesh, told


def right_of(case, mesh):
    """Returns the reference of a case."""
    if not case.crossed:
        return reference(case.operation, case.a, case.b)
    volume, area, bounds = crossed_reference(case.operation, case.a, case.b)
    # CGAL's mesh may meet itself in edges, where the sum over edges is not defined: the result's own does for it.
    return dataclasses.replace(measure(mesh), volume=volume, area=area, bounds=bounds)


@dataclasses.dataclass
class Finding:
    """The outcome of a case: complaints, triangles (None: no file), and the difference of the volume."""

    case: Case
    rows: list
    triangles: int | None = None
    off: float = 0.0
    off_per_area: float = 0.0
    share_of_bound: float = 0.0


def examine(program, case):
    try:
        mesh, told = run(program, case)
        right = right_of(case, mesh)
        finding = Finding(case, complaints(case, mesh, told, right))
    except Exception as error:  # whatever a program or a reader throws is a finding
        return Finding(case, [("error", "", error)])
    if mesh is not None:
        off = signed_volume(mesh) - right.volume
        finding.triangles = len(mesh.faces)
        finding.off = off / (right.volume or float("nan"))
        finding.off_per_area = off / (told["grid"]["pitch"] * right.area or float("nan"))
        finding.share_of_bound = abs(off) / allowed_volume(right, told, case)
    return finding


def examine_all(program, cases):
    """Returns the findings of cases of one pair; exact results are kept between the cases."""
    return [examine(program, case) for case in cases]


def check(program, cases, verbose):
    """Returns whether all cases are without faults, and which operations occurred in which formats."""
    start = time.monotonic()
    groups = [(program, list(group)) for _, group in itertools.groupby(cases, key=lambda case: (case.a, case.b))]
    with concurrent.futures.ProcessPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        every = [finding for group in pool.map(examine_all, *zip(*groups)) for finding in group]
    written = [finding for finding in every if finding.triangles is not None]
    if verbose:
        print(f"{'':66}{'triangles':>10}{'volume off':>12}{'÷ pitch·area':>14}{'÷ bound':>9}")
        for found in written:
            numbers = f"{found.triangles:10}{found.off:+12.1e}{found.off_per_area:+14.1e}{found.share_of_bound:9.3f}"
            print(f"{found.case.describe():66}{numbers}")
    rows = [(finding.case.describe(), *row) for finding in every for row in finding.rows]
    harness.print_rows(rows)
    empty = sum(finding.triangles is None and not finding.rows for finding in every)
    worst = max((finding.share_of_bound for finding in written), default=0.0)
    print(
        f"{len(every)} results, {empty} of them empty, {len(rows)} complaints; volumes off by up to {worst:.2f} of their "
        f"bounds; {time.monotonic() - start:.0f} s"
    )
    return not rows and len(written) > 0, {(finding.case.operation, finding.case.suffix) for finding in written}


# Showing that a check can fail


def damages(mesh):
    """Yields (what, mesh) for ways in which a mesh can be wrong."""
    points, faces = mesh.points, mesh.faces
    flipped = faces.copy()
    flipped[7] = flipped[7][::-1]
    yield "a flipped triangle", Mesh(points, flipped)
    yield "a missing triangle", Mesh(points, np.delete(faces, 7, axis=0))
    yield "a triangle twice", Mesh(points, np.vstack([faces, faces[7:8]]))
    yield "a triangle and its back", Mesh(points, np.vstack([faces, faces[7:8], faces[7:8, ::-1]]))
    yield "inside out", Mesh(points, faces[:, ::-1])
    yield "not welded", Mesh(points[faces.reshape(-1)], np.arange(faces.size).reshape(-1, 3))
    yield "a vertex that nothing uses", Mesh(np.vstack([points, points[:1]]), faces)
    # Two vertices without a common neighbour become one: each edge still has two triangles.
    far = int(np.argmax(np.linalg.norm(points - points[0], axis=1)))
    pinched = np.where(faces == far, 0, faces)
    yield "two vertices become one", Mesh(points, pinched)
    middle = points.mean(axis=0)
    yield "a hundredth too large", Mesh(middle + (points - middle) * 1.01, faces)
    yield "elsewhere", Mesh(points + np.ptp(points, axis=0) * 0.1, faces)
    away = points.copy()
    away[3] += 2 * np.ptp(points, axis=0)
    yield "a vertex far away", Mesh(away, faces)


def falsehoods(case, mesh, told, right):
    """Yields (what, case, mesh, told, right) for every possible fault: of the mesh, of the JSON, or of the reference."""
    for what, damaged in damages(mesh):
        yield what, case, damaged, told, right
    for name in ("vertices", "triangles", "components", "genus", "volume"):
        surface = dict(told["surface"])
        surface[name] = surface[name] * 1.01 + 1
        yield f"JSON of other {name}", case, mesh, {**told, "surface": surface}, right
    allowed = allowed_volume(right, told, case)
    for sign in (1, -1):
        volume = signed_volume(mesh) + sign * 1.01 * allowed
        yield "another volume", case, mesh, told, dataclasses.replace(right, volume=volume)
    yield "a volume that is no number", case, mesh, told, dataclasses.replace(right, volume=float("nan"))
    yield "no mesh", case, None, told, right
    missing = {**told, "surface": {**told["surface"], "path": None, "triangles": 0}}
    yield "no mesh, and the JSON says so", case, None, missing, right
    shrunk = right.bounds + np.array([[1.1], [-1.1]]) * (REACH + 1) * told["grid"]["pitch"]
    yield "a larger box", case, mesh, told, dataclasses.replace(right, bounds=shrunk)
    if case.method == "exact":
        other = {**told["volume"], "value": told["volume"]["value"] + 2 * rounding(right, case) * right.area + 1e-6}
        yield "another exact volume", case, mesh, {**told, "volume": other}, right
        yield "another area", case, mesh, told, dataclasses.replace(right, area=1.00001 * right.area)
        components, genus = right.topology
        yield "another genus", case, mesh, told, dataclasses.replace(right, topology=(components, genus + 1))
        yield "too many triangles", case, mesh, told, dataclasses.replace(right, triangles=len(mesh.faces) // 3)
        yield "another method", dataclasses.replace(case, method="sampled"), mesh, told, right
    if told["surface"]["simplified"] is not None:
        before = {**told["surface"]["simplified"], "triangles_before": len(mesh.faces)}
        yield "nothing simplified", case, mesh, {**told, "surface": {**told["surface"], "simplified": None}}, right
        yield "nothing simplified", case, mesh, {**told, "surface": {**told["surface"], "simplified": before}}, right
        before = {**told["surface"]["simplified"], "distance": told["grid"]["pitch"]}
        yield "simplified too far", case, mesh, {**told, "surface": {**told["surface"], "simplified": before}}, right


def self_test(program):
    """Returns whether the check finds every falsehood, in a result of each format and method, one of them simplified, and a
    program that fails."""
    pair = pairs.load(names=["spheres"])[0]
    a, b = (str(pairs.ROOT / pair["a"]), None), (str(pairs.ROOT / pair["b"]), pair["transform_b"])
    found = harness.Falsehoods()
    # Python takes the operation for a script, which does not exist.
    found.expect("a program that fails", examine(Path(sys.executable), Case(OPERATIONS[0], a, b, "stl")).rows)
    kinds = [(suffix, method) for suffix in FORMATS for method in ("sampled", "exact")]
    for i, (suffix, method) in enumerate(kinds):
        case = Case(OPERATIONS[i % 3], a, b, suffix, simplified=(suffix, method) == ("ply", "sampled"), method=method)
        mesh, told = run(program, case)
        found.vary(case.describe(), (case, mesh, told, right_of(case, mesh)), complaints, falsehoods)
    through = mesh.points.copy()
    through[3] += 2 * (mesh.points.mean(axis=0) - through[3])
    found.expect("a spike through the mesh", ["a crossing pair"] * crossing_pairs(Mesh(through, mesh.faces)))
    return found.report()


def main():
    parser = harness.parser(__doc__, self_test="damage results and see that it shows")
    parser.add_argument("--corpus", type=Path, help="check pairs of this folder of real meshes instead")
    parser.add_argument("--verbose", action="store_true", help="a line for every result")
    given = parser.parse_args()
    if given.self_test:
        harness.leave(self_test(given.program))
    cases = corpus_cases(given.corpus.resolve()) if given.corpus else data_cases()
    good, seen = check(given.program, cases, given.verbose)
    if not given.corpus and len(seen) != len(OPERATIONS) * len(FORMATS):
        print(f"only {len(seen)} of {len(OPERATIONS) * len(FORMATS)} operations and formats were seen together")
        good = False
    harness.leave(good)


if __name__ == "__main__":
    main()
