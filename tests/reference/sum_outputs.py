#!/usr/bin/env python3
"""Checks that meshes of Minkowski sums, differences, offsets, openings and closings are solids that other programs accept.

usage: sum_outputs.py --program LDI-OPS [--self-test] [--verbose]

Runs `minkowski`, with `--difference` and with `--reflect`, on pairs of data/reference/minkowski, and `offset` outwards and
inwards, `open` and `close` on models, each at two resolutions and in all `FORMATS`. The meshes must pass all checks that
outputs.py makes of Booleans: closed 2-manifolds by trimesh, manifold3d and their edges, and the statements of the JSON about
them. Besides,

- the JSON must count no crossing triangles and no unclosed ray;
- the volume of the mesh must be that of the images, which the JSON states with an error estimate, within the error that a surface
  of that pitch may have (`outputs.allowed_volume`);
- and it must be that of CGAL and manifold3d, where it is pinned; boxes must be the right ones, or lie within their limits.

Exits 1 with a table of the differences. `--self-test` damages meshes and falsifies the JSON and the references, and exits 1
unless the check finds every damage.
"""

import concurrent.futures
import dataclasses
import itertools
import json
import os
import sys
import time
from pathlib import Path

import harness
import numpy as np
import outputs

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "reference" / "minkowski"))
import sums  # noqa: E402

FORMATS = ("stl", "3mf", "ply")
RESOLUTIONS = (48, 96)

# Pinned sums and differences: with cavities, with parts that meet in faces, in general position, from fine meshes.
PINNED = (
    "l_l10",
    "hollow_cube_l",
    "windowed_box_bar",
    "square_ring_dumbbell",
    "star_tetrahedron",
    "star_torus",
    "tori",
    "torus_ball_closed",
    "knot_cube",
    "bone_ball",
    "hollow_cube_less_l",
    "pitted_cube_less_ring",
    "star_less_tetrahedron",
    "torus_less_ball",
    "torus_less_l",
    "knot_less_tetrahedron",
)

# A ⊕ (−B), for which no value is pinned.
REFLECTED = ("star_tetrahedron", "hollow_cube_l", "tori", "l_l10")

# Models, and the share of their longest side by which they are offset, opened and closed.
BALLS = (
    ("data/models/gyroid_sheet.stl", 0.015),
    ("data/models/cubic_lattice.stl", 0.02),
    ("data/models/bone.stl", 0.02),
    ("data/models/box.stl", 0.1),
    ("data/reference/minkowski/models/knot.obj", 0.02),
    ("data/reference/minkowski/models/star.obj", 0.03),
    ("data/reference/minkowski/models/hollow_cube.obj", 0.07),
)


# More resolutions, by operation and model: the surface after the first step has walls a hair apart there, which cross one another
# once its vertices are on the lattice.
FOLDED = {
    ("open", "knot", 48),
    ("open", "knot", 64),
    ("close", "knot", 128),
    ("open", "gyroid_sheet", 128),
    ("close", "gyroid_sheet", 128),
}


@dataclasses.dataclass(frozen=True)
class Case:
    """A command line that writes a mesh."""

    operation: str
    words: tuple
    suffix: str
    resolution: int
    # The volume by peers, where they computed it, and the box of the result, or a box that contains it.
    volume: float | None
    box: tuple
    # The distance in pitches by which the mesh may move to lose triangles; None if none is asked for.
    bound: float | None = None
    # Sums have meshes of images alone.
    method: str = "sampled"

    def arguments(self, out, told):
        words = [*self.words, "--mode", "exact", "--resolution", self.resolution, "--quiet", "--json", told, "-o", out]
        words += [] if self.bound is None else ["--surface-error", self.bound]
        return [str(word) for word in words]

    def describe(self):
        names = " ".join(Path(str(word)).stem if "/" in str(word) else str(word) for word in self.words)
        return f"{names} {self.resolution} {'full' if self.bound == 0 else 'few'} .{self.suffix}"


def box_of(points):
    return tuple(map(tuple, (points.min(axis=0), points.max(axis=0))))


def requests():
    """Yields (operation, words, volume, box) of all requests, those of one operation one after another."""
    pinned = {case.name: case for case in sums.load(sorted({*PINNED, *REFLECTED}))}

    def words_of(case):
        placement = ["--transform-b", case.transform_b] if case.transform_b else []
        return ("minkowski", sums.pairs.ROOT / case.a, sums.pairs.ROOT / case.b, *placement)

    for operation in sums.OPERATIONS:
        for case in (pinned[name] for name in PINNED if pinned[name].operation == operation):
            results = json.loads(sums.result_path(case.name).read_text())["results"]
            box = next(result["box"] for result in results if "box" in result)
            words = words_of(case) + (("--difference",) if operation == "difference" else ())
            yield operation, words, results[0]["volume"], box
    for case in (pinned[name] for name in REFLECTED):
        (a, _), (b, _) = case.meshes()
        box = (a.min(axis=0) - b.max(axis=0), a.max(axis=0) - b.min(axis=0))
        yield "reflected", (*words_of(case), "--reflect"), None, box
    for operation, outwards in (("grown", 1), ("shrunk", -1), ("open", 0), ("close", 0)):
        for file, share in BALLS:
            low, high = box_of(sums.pairs.read(sums.pairs.ROOT / file)[0])
            low, high = np.array(low), np.array(high)
            distance = float(share * (high - low).max())
            words = (operation, sums.pairs.ROOT / file, "--radius", distance)
            if outwards:
                words = ("offset", sums.pairs.ROOT / file, "--distance", outwards * distance)
            yield operation, words, None, (low - outwards * distance, high + outwards * distance)


def cases():
    """Yields all requests at all resolutions, with the formats in turn; the lowest resolution with all triangles."""
    suffixes = itertools.cycle(FORMATS)
    for operation, words, volume, box in requests():
        others = {folded[2] for folded in FOLDED if folded[:2] == (operation, Path(words[1]).stem)}
        for resolution in sorted({*RESOLUTIONS, *others}):
            bound = 0.0 if resolution == RESOLUTIONS[0] else None
            yield Case(operation, words, next(suffixes), resolution, volume, tuple(map(tuple, box)), bound)


def right_of(case, mesh, told):
    """Returns the expected values; without a peer's volume, the mesh's own volume, which `complaints` compares with the
    images."""
    if mesh is None:
        return dataclasses.replace(outputs.EMPTY, volume=case.volume or 0.0)
    volume = told["surface"]["volume"] if case.volume is None else case.volume
    return dataclasses.replace(outputs.measure(mesh), volume=volume, bounds=np.array(case.box))


def complaints(case, mesh, told, right):
    """Returns the faults of the written file as (name, expected, found); `mesh` is None where there is no file."""
    rows = outputs.complaints(case, mesh, told, right)
    surface, images = told["surface"], told["volume"]
    volume = 0.0 if mesh is None else outputs.signed_volume(mesh)
    allowed = outputs.allowed_volume(right, told, case) + images["estimate_error"]
    if not abs(volume - images["value"]) <= allowed:
        rows.append(("volume of the images", f"{volume} ± {allowed:.3g}", images["value"]))
    for name, found in (("crossing_pairs", surface["crossing_pairs"]), ("unclosed_rays", told["unclosed_rays"])):
        if found != 0:
            rows.append((f"JSON {name}", 0, found))
    return rows


@dataclasses.dataclass
class Finding:
    """The outcome of a case: complaints, triangles (None: no file), and the errors against the images and the pinned volume."""

    case: Case
    rows: list
    triangles: int | None = None
    off_images: float = 0.0
    off_pinned: float | None = None
    share_of_bound: float | None = None
    is_refused: bool = False


def examine(program, case):
    try:
        mesh, told = outputs.run(program, case)
        if outputs.is_refused(mesh, told):
            return Finding(case, [], is_refused=True)
        right = right_of(case, mesh, told)
        finding = Finding(case, complaints(case, mesh, told, right))
    except Exception as error:  # whatever a program or a reader throws is a finding
        return Finding(case, [("error", "", error)])
    if mesh is not None:
        volume = outputs.signed_volume(mesh)
        finding.triangles = len(mesh.faces)
        finding.off_images = volume / (told["volume"]["value"] or float("nan")) - 1
        if case.volume:
            finding.off_pinned = volume / case.volume - 1
            finding.share_of_bound = abs(volume - case.volume) / outputs.allowed_volume(right, told, case)
    return finding


def check(program, verbose):
    start = time.monotonic()
    every_case = list(cases())
    with concurrent.futures.ProcessPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        every = list(pool.map(examine, itertools.repeat(program), every_case))
    if verbose:
        print(f"{'':84}{'triangles':>10}{'off images':>12}{'off pinned':>12}{'÷ bound':>9}")
        for found in every:
            if found.triangles is not None:
                pinned = "" if found.off_pinned is None else f"{found.off_pinned:+12.1e}{found.share_of_bound:9.3f}"
                print(f"{found.case.describe():84}{found.triangles:10}{found.off_images:+12.1e}{pinned}")
    rows = [(finding.case.describe(), *row) for finding in every for row in finding.rows]
    harness.print_rows(rows)
    written = [finding for finding in every if finding.triangles is not None]
    pinned = [found for found in written if found.off_pinned is not None]
    worst = max((abs(found.off_pinned) for found in pinned if found.case.resolution == RESOLUTIONS[-1]), default=float("nan"))
    share = max((found.share_of_bound for found in pinned), default=float("nan"))
    print(
        f"{len(every)} results, {len(rows)} complaints; pinned volumes missed by up to "
        f"{100 * worst:.3f} % at {RESOLUTIONS[-1]} rays and {share:.2f} of their bounds; "
        f"{time.monotonic() - start:.0f} s"
    )
    seen = {(finding.case.operation, finding.case.suffix) for finding in written}
    wanted = set(itertools.product({case.operation for case in every_case}, FORMATS))
    for operation, suffix in sorted(wanted - seen):
        print(f"no .{suffix} of {operation} was seen")
    refused = [finding.case.describe() for finding in every if finding.is_refused]
    print(f"refused as far from the volume: {', '.join(refused) or 'none'}")
    return not rows and wanted == seen and len(refused) <= 0.02 * len(every)


# Showing that a check can fail


def falsehoods(case, mesh, told, right):
    """Yields (what, case, mesh, told, right) for every possible fault."""
    yield from outputs.falsehoods(case, mesh, told, right)
    allowed = outputs.allowed_volume(right, told, case) + told["volume"]["estimate_error"]
    for value in (1.01 * allowed, -1.01 * allowed, float("nan")):
        volume = {**told["volume"], "value": outputs.signed_volume(mesh) + value}
        yield "another volume of the images", case, mesh, {**told, "volume": volume}, right
    yield "triangles that cross", case, mesh, {**told, "surface": {**told["surface"], "crossing_pairs": 1}}, right
    yield "a ray that did not close", case, mesh, {**told, "unclosed_rays": 1}, right


def self_test(program):
    """Returns whether the check finds every falsehood in a pinned result of each format, and a program that fails."""
    pinned = [case for case in cases() if case.volume is not None]
    found = harness.Falsehoods()
    # Python takes the operation for a script, which does not exist.
    found.expect("a program that fails", examine(Path(sys.executable), pinned[0]).rows)
    for suffix in FORMATS:
        case = next(case for case in pinned if case.suffix == suffix)
        mesh, told = outputs.run(program, case)
        found.vary(case.describe(), (case, mesh, told, right_of(case, mesh, told)), complaints, falsehoods)
    return found.report()


def main():
    parser = harness.parser(__doc__, self_test="damage results and see that it shows")
    parser.add_argument("--verbose", action="store_true", help="a line for every result")
    given = parser.parse_args()
    harness.leave(self_test(given.program) if given.self_test else check(given.program, given.verbose))


if __name__ == "__main__":
    main()
