#!/usr/bin/env python3
"""Compares offsets of scaffolds by a ball with libigl's distances to their meshes, thin walls and closing pores included.

usage: offsets.py --program LDI-OPS [--self-test] [--verbose]

Makes small scaffolds, has each offset outwards and inwards at 512 rays, and compares volumes with those of {distance < d}, where
libigl computes the signed distance to the same mesh with its own tree of boxes and with signs by pseudonormals. The scaffold is
turned one way for the program and another way for the reference, so that no part of it lies along rays or cells.

A distance changes by at most the length of a step, so a cell is wholly in or out if its middle is further from the level than its
corners are from its middle. Cells that are neither, at the finest level of an octree, are cut by the plane that the distance at
the middle and its gradient there give. That misses the curvature of a level within a cell, and the creases where it meets the
medial axis. Both errors are of second order: a third of the change from cutting a cell as a whole to cutting it as eight remains
for still smaller cells, and is added. This addition is also the stated error of the reference, which is checked against volumes
in closed form. It is an estimate: on a gyroid, where curvatures of both signs cancel, it came out too small, with the reference
4e-5 off.

Exits 1 with a table of the differences: a volume by more than `TOLERANCE` of it (or, where next to nothing is left, by more than
the error of the reference), anything left where no point is as deep as d, nothing left where some point is, or a reference whose
error is too large. `--self-test` falsifies each of these and exits 1 unless the check finds every falsehood.
"""

import concurrent.futures
import dataclasses
import itertools
import json
import math
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import harness
import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "reference"))
import pairs  # noqa: E402

TOLERANCE = 0.002
RESOLUTION = 512

# The largest allowed error of the reference, as a share of its volume, or of the solid's where less is left.
SURE = 0.001

# The rotation of the reference relative to its cells.
REFERENCE_PLACEMENT = "rotate(0.3,-1,0.7,50)"

# The number of cells along the longest side of the box at the root level of the octree.
FIRST_CELLS = 16

# A crease is where a distance changes between neighbouring cells differently from its gradient, by this share of the step; and
# the number of times by which cells become finer on creases.
CREASE = 0.3
FINER_CREASES = 4


@dataclasses.dataclass(frozen=True)
class Scaffold:
    """A model solid: its words for `generate`, its offset distances, and its rotation for the program."""

    words: str
    distances: tuple
    placement: str
    # The number of cells of the octree along the longest side of the box.
    cells: int = 64
    # The volume by distance, where there is a closed form; it may return None.
    known: Callable | None = None

    def name(self):
        return self.words.replace("--", "")


def grown_box(side, distance):
    """Returns the volume of a cube grown by a ball, by Steiner's formula."""
    return side**3 + 6 * side**2 * distance + 3 * math.pi * side * distance**2 + 4 / 3 * math.pi * distance**3


def hollow_box(distance, outer=20.0, inner=10.0):
    """Returns the volume of the offset of a box in a box while its walls exist and its hollow is not partly filled; else None."""
    if distance >= 0:
        return grown_box(outer, distance) - max(inner - 2 * distance, 0) ** 3
    if -2 * distance <= (outer - inner) / 2:
        return (outer + 2 * distance) ** 3 - grown_box(inner, -distance)
    return None


SCAFFOLDS = (
    # Walls are 2 thick on average, so that half of them vanish near −1, where distances lie on both sides of it; pores are 3 wide
    # and are closed at 2.4.
    Scaffold(
        "gyroid --cells 1 --wall 2 --resolution 16",
        (0.4, 1.0, 1.6, 2.4, -0.3, -0.6, -0.9, -1.05, -1.5),
        "rotate(1,2,3,31)",
    ),
    Scaffold("gyroid --cells 2 --wall 1.5 --resolution 14", (0.6, -0.4), "rotate(2,-1,3,48)", cells=128),
    Scaffold("gyroid --part network --fraction 0.4 --cells 1 --resolution 16", (0.7, -0.7), "rotate(3,1,2,17)"),
    # Windows between struts close at 3 and leave cavities, which close at 5.07. Struts vanish at −2, except for their joints.
    Scaffold("cubic --cells 2 --radius 2 --resolution 12", (1.0, 2.9, 3.2, 4.9, 5.2, -1.0, -1.9, -2.1), "rotate(1,0.3,2,23)"),
    # Inwards, walls vanish at 2.5, the bars along its edges at 2.93 and its corners at 3.17. Its hollow closes at 5.
    Scaffold(
        "hollow-box --size 20,20,20 --hollow 10,10,10",
        (1.0, 4.9, 5.1, -1.0, -2.4, -2.6, -3.1, -3.7),
        "rotate(1,2,-1,40)",
        known=hollow_box,
    ),
)


# The reference


@dataclasses.dataclass(frozen=True)
class Reference:
    """The volume of {distance < d} and its error, and two flags: it is certainly not empty, or certainly empty."""

    volume: float
    error: float
    has_some: bool
    is_empty: bool


def cut_share(normals, levels):
    """Returns the shares of unit cubes around the origin where normal · x < level.

    With mᵢ the sizes of the normal's parts and α the depth of the deepest corner below the plane, a share is
    (α³ − Σ (α − mᵢ)³ + Σ (α − mᵢ − mⱼ)³ − (α − m₁ − m₂ − m₃)³) / (6 m₁ m₂ m₃), with differences below zero left out.
    """
    sizes = np.abs(normals)
    # A zero component would be a divisor. A small slant about the middle of a face leaves the share as it is.
    sizes = np.maximum(sizes, 1e-3)
    depth = levels + sizes.sum(axis=1) / 2
    total = np.zeros(len(levels))
    for corner in itertools.product((0, 1), repeat=3):
        total += (-1) ** sum(corner) * np.maximum(depth - sizes @ np.array(corner, dtype=float), 0) ** 3
    return np.clip(total / (6 * sizes.prod(axis=1)), 0, 1)


def cut_volumes(is_cut, below, gradients, side):
    """Returns the volume below each level in the cells that are marked for it, from the depths of their middles."""
    cells = [np.flatnonzero(column) for column in is_cut.T]
    return side**3 * np.array([cut_share(gradients[at], below[at, i] / side).sum() for i, at in enumerate(cells)])


def distances_of(mesh, points):
    """Returns signed distances, below zero inside, and their gradients."""
    found, _, nearest, normals = igl.signed_distance(points, *mesh, igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL)
    with np.errstate(invalid="ignore", divide="ignore"):
        gradients = (points - nearest) / found[:, None]
    on_mesh = np.abs(found) < 1e-9
    gradients[on_mesh] = normals[on_mesh]
    return found, gradients


def creased(places, found, gradients, side):
    """Marks cells where the distance bends sharply between their middle and a neighbour's; `places` are integer positions."""
    stride = int(places.max()) + 2
    keys = (places[:, 0] * stride + places[:, 1]) * stride + places[:, 2]
    order = np.argsort(keys)
    placed = keys[order]
    is_creased = np.zeros(len(keys), dtype=bool)
    for axis, step in enumerate((stride * stride, stride, 1)):
        at = np.minimum(np.searchsorted(placed, keys + step), len(keys) - 1)
        one = np.flatnonzero(placed[at] == keys + step)
        other = order[at[one]]
        rise = found[other] - found[one]
        bend = np.maximum(abs(rise - side * gradients[one, axis]), abs(rise - side * gradients[other, axis]))
        is_creased[one[bend > CREASE * side]] = True
        is_creased[other[bend > CREASE * side]] = True
    return is_creased


def references(mesh, levels, cells):
    """Returns the reference at each level of the distance to a mesh.

    The octree goes down to `cells` along the longest side, on creases to `FINER_CREASES` times as many. Each cell of the finest
    level, a leaf, is cut as a whole and once more as eight.
    """
    levels = np.array(levels)
    points, _ = mesh
    margin = max(levels.max(), 0)
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    side = (high - low).max() / FIRST_CELLS
    counts = np.ceil((high - low) / side - 1e-9).astype(int)
    places = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    eighths = np.array(list(itertools.product((0, 1), repeat=3)))

    # The levels that may pass through a cell, and the kind of leaf that it is an eighth of: smooth, creased, or none.
    is_open = np.ones((len(places), len(levels)), dtype=bool)
    leaf = np.full(len(places), -1)
    certain = np.zeros(len(levels))
    whole, eight = np.zeros((2, len(levels))), np.zeros((2, len(levels)))
    has_some, may_have = np.zeros((2, len(levels)), dtype=bool)
    count = FIRST_CELLS
    while len(places) > 0:
        found, gradients = distances_of(mesh, low + side * (places + 0.5))
        below = levels - found[:, None]
        has_some |= (below > 0).any(axis=0)
        for kind in range(2):
            eight[kind] += cut_volumes(is_open & (leaf == kind)[:, None], below, gradients, side)
        reach = side * math.sqrt(3) / 2
        may_have |= (is_open & (below > -reach))[leaf >= 0].any(axis=0)
        is_open[leaf >= 0] = False
        certain += side**3 * (is_open & (below >= reach)).sum(axis=0)
        is_open &= abs(below) < reach
        leaf = np.full(len(places), -1)
        if count >= cells:
            is_creased = creased(places, found, gradients, side)
            leaf[~is_creased] = 0
            if count == cells * FINER_CREASES:
                leaf[is_creased] = 1
            for kind in range(2):
                whole[kind] += cut_volumes(is_open & (leaf == kind)[:, None], below, gradients, side)
        goes_on = is_open.any(axis=1)
        places = (2 * places[goes_on, None] + eighths).reshape(-1, 3)
        is_open, leaf = (np.repeat(each[goes_on], len(eighths), axis=0) for each in (is_open, leaf))
        side /= 2
        count *= 2
    added = (eight - whole) / 3
    volumes, errors = certain + (eight + added).sum(axis=0), abs(added).sum(axis=0)
    every = zip(volumes, errors, has_some, ~has_some & ~may_have, strict=True)
    return [Reference(0.0 if none else float(v), float(e), bool(some), bool(none)) for v, e, some, none in every]


# Judging


@dataclasses.dataclass(frozen=True)
class Finding:
    """An offset by the program, and its reference."""

    scaffold: str
    distance: float
    solid_volume: float
    told: dict
    right: Reference
    known: float | None

    def complaints(self):
        """Returns complaints as (what, expected, found)."""
        rows = []
        volume, right = self.told["volume"]["value"], self.right
        allowed = max(TOLERANCE * right.volume, right.error)
        if not abs(volume - right.volume) <= allowed:
            rows.append(("volume", f"{right.volume:.6g} ± {allowed:.2g}", volume))
        is_empty = any(warning["code"] == "empty" for warning in self.told["warnings"])
        if is_empty != (volume == 0):
            rows.append(("warning that nothing is left", volume == 0, is_empty))
        if right.is_empty and volume != 0 or right.has_some and not volume > 0:
            rows.append(("something left", right.has_some, volume))
        grid = self.told["grid"]["rays"]
        if max(grid) != RESOLUTION:
            rows.append(("rays", RESOLUTION, grid))
        if self.told["mode"] != "exact" or self.told["steps"][0]["distance"] != self.distance:
            rows.append(("offset", f"exact, {self.distance}", f"{self.told['mode']}, {self.told['steps'][0]['distance']}"))
        if not right.error <= SURE * max(right.volume, self.solid_volume):
            rows.append(("reference that is sure", f"{SURE} of it", right.error))
        if self.known is not None and not abs(right.volume - self.known) <= right.error + 1e-9 * self.known:
            rows.append(("reference", self.known, f"{right.volume} ± {right.error:.2g}"))
        return rows

    def describe(self):
        return f"{self.scaffold} by {self.distance:+}"

    def off(self):
        """Returns the difference as a share of the reference; 0 where the reference is empty."""
        return self.told["volume"]["value"] / self.right.volume - 1 if self.right.volume else 0.0


def told_of(program, path, placement, distance):
    """Returns the JSON of one offset."""
    words = [program, "offset", path, "--distance", distance, "--transform-a", placement, "--resolution", RESOLUTION]
    words += ["--mode", "exact", "--quiet", "--json", "-"]
    return json.loads(harness.run(words))


def examine(program, scaffold):
    """Returns the findings of a scaffold, and the seconds that the program's offsets took."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scaffold.obj"
        harness.run([program, "generate", *scaffold.words.split(), "--quiet", "-o", path])
        told = [told_of(program, path, scaffold.placement, distance) for distance in scaffold.distances]
        points, triangles = pairs.read(path)
    right = references((pairs.transform(points, REFERENCE_PLACEMENT), triangles), scaffold.distances, scaffold.cells)
    solid_volume = told[0]["inputs"][0]["volume"]
    rows = zip(scaffold.distances, told, right, strict=True)
    known = scaffold.known or (lambda distance: None)
    found = [Finding(scaffold.name(), d, solid_volume, t, r, known(d)) for d, t, r in rows]
    return found, sum(each["seconds"]["total"] for each in told)


def check(program, verbose):
    start = time.monotonic()
    # The costliest scaffolds first, so that none is left for the end.
    order = sorted(SCAFFOLDS, key=lambda each: -len(each.distances) * each.cells**2)
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        every = list(pool.map(examine, itertools.repeat(program), order))
    findings = [finding for found, _ in every for finding in found]
    if verbose:
        print(f"{'':74}{'of solid':>10}{'volume':>14}{'off':>10}{'reference ±':>13}")
        for finding in findings:
            share, error = finding.right.volume / finding.solid_volume, finding.right.error / (finding.right.volume or 1)
            numbers = f"{share:10.5f}{finding.told['volume']['value']:14.4f}{finding.off():+10.1e}{error:13.1e}"
            print(f"{finding.describe():74}{numbers}")
    rows = [(finding.describe(), *row) for finding in findings for row in finding.complaints()]
    harness.print_rows(rows)
    sure = [finding for finding in findings if finding.right.error <= TOLERANCE * finding.right.volume]
    worst = max((abs(finding.off()) for finding in sure), default=float("nan"))
    nothing = sum(finding.right.is_empty for finding in findings)
    offset_seconds = sum(seconds for _, seconds in every)
    print(
        f"{len(findings)} offsets, {len(rows)} complaints; {len(sure)} with a sure reference off by up to {100 * worst:.3f} %, "
        f"{nothing} with nothing left; {time.monotonic() - start:.0f} s, offsets {offset_seconds:.0f} s"
    )
    return not rows and len(sure) > 0 and nothing > 0


# Showing that a check can fail


def falsehoods(finding):
    """Yields (what, finding) for every possible fault."""

    def told(**values):
        return dataclasses.replace(finding, told={**finding.told, **values})

    def volume(value):
        return told(volume={**finding.told["volume"], "value": value})

    def right(**values):
        return dataclasses.replace(finding, right=dataclasses.replace(finding.right, **values))

    if finding.right.is_empty:
        yield "something left", volume(1e-6)
    else:
        allowed = max(TOLERANCE * finding.right.volume, finding.right.error)
        for sign in (1, -1):
            yield "another volume", volume(finding.right.volume + sign * 1.01 * allowed)
        yield "nothing left", dataclasses.replace(
            volume(0.0), told={**volume(0.0).told, "warnings": [{"code": "empty", "message": ""}]}
        )
        yield "a volume below zero", volume(-finding.told["volume"]["value"])
    yield "no number", volume(float("nan"))
    yield "a reference that is no number", right(volume=float("nan"))
    yield "a reference that is not sure", right(error=1.01 * SURE * max(finding.right.volume, finding.solid_volume))
    is_empty = any(warning["code"] == "empty" for warning in finding.told["warnings"])
    yield "a false warning", told(warnings=[] if is_empty else [{"code": "empty", "message": ""}])
    yield "fewer rays", told(grid={**finding.told["grid"], "rays": [RESOLUTION // 2] * 3})
    yield "another mode", told(mode="over")
    yield "another distance", told(steps=[{**finding.told["steps"][0], "distance": -finding.distance}])
    if finding.known:
        known = finding.right.volume + 1.01 * (finding.right.error + 1e-9 * finding.known)
        yield "a reference that is off", dataclasses.replace(finding, known=known)


def self_test(program):
    """Returns whether the check finds every falsehood, for a solid with a rest and one without, and a program that fails."""
    scaffold = dataclasses.replace(SCAFFOLDS[-1], distances=(1.0, -1.0, -3.7))
    findings, _ = examine(program, scaffold)
    found = harness.Falsehoods()
    found.expect_error("a program that fails", lambda: told_of(Path(sys.executable), Path("none.obj"), "scale(1)", 1.0))
    for finding in findings:
        found.vary(finding.describe(), (finding,), Finding.complaints, falsehoods)
    # Each offset with the volume of another.
    for one, other in itertools.permutations(findings, 2):
        false = dataclasses.replace(one, told={**one.told, "volume": other.told["volume"]})
        found.expect(f"{one.describe()}: the volume by {other.distance}", false.complaints())
    return found.report()


def main():
    parser = harness.parser(__doc__)
    parser.add_argument("--verbose", action="store_true", help="a line for every result")
    given = parser.parse_args()
    harness.leave(self_test(given.program) if given.self_test else check(given.program, given.verbose))


if __name__ == "__main__":
    main()
