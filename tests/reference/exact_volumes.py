#!/usr/bin/env python3
"""Compares exact volumes and areas of Booleans with manifold3d and with CGAL's exact kernel (libigl).

usage: exact_volumes.py --program LDI-OPS --bench LDI-BENCH [--corpus FOLDER] [--rows FILE] [--self-test]

Compares ∩, ∪ and − under the non-zero rule: of the pairs of data/reference, of pairs of data/models turned against each
other, and of 200 crossing struts with a box, whose values by CGAL are pinned (data/reference/struts). With `--corpus`
instead of consecutive closed models of that folder, the second moved onto the centre of the first and scaled to its size.
All programs are given the same coordinates in f32.

The tolerance is 1e-12 of the volume, or area, of both operands. CGAL is exact up to the rounding of the points of its
result; 2e-14 was seen. manifold3d computes in f64 and may move points by its epsilon, 1e-12 of the largest coordinate; 4e-15 of
the volume was seen, and 5e-13 of the area where nearly equal boxes differ by slivers. Where a program gives no value, this is
pinned: exits 1 where another case has none, where a pinned case has one, and where values differ.
"""

import dataclasses
import functools
import json
import multiprocessing
import sys
import tempfile
from pathlib import Path

import harness
import manifold3d
import numpy as np
import trimesh
from igl.copyleft import cgal

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "data" / "reference"), str(ROOT / "data" / "reference" / "struts")]
import pairs  # noqa: E402
import struts  # noqa: E402

# The least number of values that are compared, for each case.
LEAST_VALUES = 6
TOLERANCES = {"CGAL": 1e-12, "manifold3d": 1e-12}
OPERATIONS = tuple(struts.OPERATIONS)
QUANTITIES = ("volume", "area")

# Above these numbers of triangles of both operands CGAL computes the intersection alone, and nothing.
ALL_BY_CGAL = 6_000
INTERSECTION_BY_CGAL = 16_000

# The cases of which a peer's values are wrong: what a shell that crosses itself covers twice counts as more than the solid.
WRONG = {"manifold3d": {"pentagram prism"}}


@dataclasses.dataclass(frozen=True)
class Case:
    """Two solids, each points and triangles; the points are f64 that f32 can hold."""

    name: str
    meshes: tuple


def rounded(mesh):
    """Rounds points to f32, and joins those that become equal."""
    points, triangles = mesh
    points, index = np.unique(points.astype(np.float32).astype(np.float64) + 0.0, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[triangles]
    a, b, c = triangles.T
    return points, triangles[(a != b) & (b != c) & (c != a)]


def onto(mesh, other):
    """Moves a mesh onto the centre of another, and scales it to the same longest side."""
    (low, high), (start, end) = ((points.min(axis=0), points.max(axis=0)) for points in (mesh[0], other[0]))
    scale = (end - start).max() / (high - low).max()
    return (mesh[0] - (low + high) / 2) * scale + (start + end) / 2, mesh[1]


def reference_cases():
    return [Case(f"reference: {pair['name']}", tuple(map(rounded, pairs.meshes(pair)))) for pair in pairs.load()]


def model_cases():
    """Every model with the next and with the third after it."""
    models = [(path.stem, pairs.read(path)) for path in sorted((ROOT / "data" / "models").iterdir())]
    cases = []
    for step in (1, 3):
        for i, (name, a) in enumerate(models):
            other, (points, triangles) = models[(i + step) % len(models)]
            points = pairs.transform(points, f"rotate(1,{step},3,{17 * (i + 1)}) translate(1.3,-0.7,0.{i}3)")
            cases.append(Case(f"models: {name}, {other}", (rounded(a), rounded((points, triangles)))))
    return cases


def corpus_cases(folder):
    """Every closed and oriented model of the classes solid, scaffold and bone with the next one.

    Models in formats that hold scenes are left out.
    """
    entries = json.loads((folder / "meshes" / "manifest.json").read_text())
    entries = [e for e in entries if e.get("closed") and e.get("oriented") and e["cls"] != "nasty"]
    entries = [e for e in entries if Path(e["name"]).suffix.lower() in (".stl", ".off", ".obj", ".ply")]
    models = []
    for entry in sorted(entries, key=lambda entry: entry["name"]):
        path = folder / "meshes" / entry["name"]
        if path.suffix == ".obj":
            mesh = pairs.read(path)
        else:
            loaded = trimesh.load(path, force="mesh", process=False)
            mesh = np.array(loaded.vertices, dtype=float), np.array(loaded.faces)
        models.append((entry["name"], mesh))
    return [
        Case(f"corpus: {name}, {other}", (rounded(a), rounded(onto(b, a))))
        for (name, a), (other, b) in zip(models, models[1:])
    ]


def strut_case():
    return Case("struts", tuple((points.astype(float), triangles) for points, triangles in struts.meshes()))


def crossed_case():
    """A prism over a pentagram, one shell that crosses itself, with a box about its middle."""
    angles = np.arange(5) * 4 * np.pi / 5
    points = [[np.cos(angle), np.sin(angle), z] for z in (0, 1) for angle in angles] + [[0, 0, 0], [0, 0, 1]]
    triangles = []
    for i in range(5):
        j = (i + 1) % 5
        triangles += [[i, j, 5 + j], [i, 5 + j, 5 + i], [10, j, i], [11, 5 + i, 5 + j]]
    corners, sides = struts.meshes(1)[1]
    star = rounded((np.array(points), np.array(triangles)))
    return Case("pentagram prism", (star, rounded((corners / 5 - 1.03, sides))))


def write_stl(path, mesh):
    points, triangles = mesh
    records = np.zeros(len(triangles), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]))
    records["corners"] = points[triangles]
    path.write_bytes(bytes(80) + np.uint32(len(triangles)).tobytes() + records.tobytes())


def by_program(bench, folder, case):
    """Returns {operation: {"volume", "area"} or None}, and the reasons for None."""
    files = [folder / f"{side}.stl" for side in "ab"]
    for file, mesh in zip(files, case.meshes):
        write_stl(file, mesh)
    told = json.loads(harness.run([bench, "exact-properties", *files]))
    return {name: None if "not_exact" in values else values for name, values in told.items()}


def by_manifold(case):
    solids = []
    for points, triangles in case.meshes:
        solids.append(manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64))))
    if any(solid.status() != manifold3d.Error.NoError for solid in solids):
        return dict.fromkeys(OPERATIONS)
    a, b = solids
    results = {"intersection": a ^ b, "union": a + b, "difference": a - b}
    return {name: {"volume": solid.volume(), "area": solid.surface_area()} for name, solid in results.items()}


def by_cgal(case, operations):
    (points_a, triangles_a), (points_b, triangles_b) = case.meshes
    results = {}
    for name in operations:
        operation = struts.OPERATIONS[name]
        points, triangles = cgal.mesh_boolean(points_a, triangles_a, points_b, triangles_b, operation)[:2]
        results[name] = dict(zip(QUANTITIES, struts.volume_and_area(points, triangles)))
    return results


def examine(bench, case):
    """Returns the values of all programs: {"scale": …, program: {operation: {quantity: value} or None}}."""
    sums = [struts.volume_and_area(*mesh) for mesh in case.meshes]
    found = {"scale": {name: sum(abs(values[i]) for values in sums) for i, name in enumerate(QUANTITIES)}}
    with tempfile.TemporaryDirectory(prefix="exact_") as folder:
        found["ldi-ops"] = by_program(bench, Path(folder), case)
    if case.name == "struts":
        pinned = json.loads(struts.PINNED.read_text())
        if pinned["sha256"] != struts.digest(struts.meshes()[0]):
            raise ValueError(f"{struts.PINNED.name} is of other struts: run data/reference/struts/struts.py")
        return found | {"CGAL": {name: pinned[name] for name in OPERATIONS}}
    found["manifold3d"] = by_manifold(case)
    triangles = sum(len(mesh[1]) for mesh in case.meshes)
    if triangles <= INTERSECTION_BY_CGAL:
        found["CGAL"] = by_cgal(case, OPERATIONS if triangles <= ALL_BY_CGAL else OPERATIONS[:1])
    return found


def comparisons(found):
    """Yields (peer, operation, quantity, peer's value, value, difference as a share of the operands)."""
    for peer in TOLERANCES:
        for operation, values in found.get(peer, {}).items():
            own = found["ldi-ops"][operation]
            for quantity in QUANTITIES if own and values else ():
                share = abs(own[quantity] - values[quantity]) / found["scale"][quantity]
                yield peer, operation, quantity, values[quantity], own[quantity], share


def complaints(name, found):
    """Returns the faults of one case as rows of text."""
    rows = []
    for row in comparisons(found):
        agrees, is_wrong = row[-1] <= TOLERANCES[row[0]], name in WRONG.get(row[0], ())
        if not agrees and not is_wrong:
            rows.append((name, *row))
        elif agrees and is_wrong:
            rows.append((name, *row, "is expected to be wrong"))
    for program in ("ldi-ops", *TOLERANCES):
        values = found.get(program, {})
        if values and any(value is None for value in values.values()):
            rows.append((name, program, "gives no value"))
    return rows


def through_the_command_line(program, case, found):
    """Returns complaints where the command line states other volumes than the library."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="exact_") as folder:
        files = [Path(folder) / f"{side}.stl" for side in "ab"]
        for file, mesh in zip(files, case.meshes):
            write_stl(file, mesh)
        for command, operation in zip(("intersect", "union", "difference"), OPERATIONS):
            words = [program, command, *files, "--fill", "nonzero", "--exact", "--unit", "mm", "--quiet", "--json", "-"]
            volume = json.loads(harness.run(words))["volume"]
            if volume["value"] != found["ldi-ops"][operation]["volume"] or volume["method"] != "exact":
                rows.append((case.name, command, volume["value"], found["ldi-ops"][operation]["volume"]))
    return rows


def falsify(name, found):
    """Yields (what, name, values) for values that are off by a little more than the tolerance, or missing."""
    for peer, operation, quantity, *_ in comparisons(found):
        for sign in (1, -1):
            false = json.loads(json.dumps(found))
            false[peer][operation][quantity] += sign * 2.5 * TOLERANCES[peer] * found["scale"][quantity]
            yield f"{operation}, {quantity} of {peer}", name, false
        false = json.loads(json.dumps(found))
        false["ldi-ops"][operation][quantity] = float("nan")
        yield f"{operation}, {quantity} not a number", name, false
    for program in found.keys() - {"scale"}:
        false = json.loads(json.dumps(found))
        false[program]["union" if "union" in false[program] else "intersection"] = None
        yield f"no value of {program}", name, false


def self_test(bench):
    falsehoods = harness.Falsehoods()
    wanted = ("reference: tori", "reference: face_contact")
    for case in [case for case in reference_cases() if case.name in wanted] + [strut_case()]:
        falsehoods.vary(case.name, (case.name, examine(bench, case)), complaints, falsify)
    return falsehoods.report()


def check(program, bench, corpus, rows_file):
    cases = corpus_cases(corpus) if corpus else [strut_case(), crossed_case(), *reference_cases(), *model_cases()]
    # Long ones first, so that no processor waits at the end.
    cases.sort(key=lambda case: -sum(len(mesh[1]) for mesh in case.meshes))
    with multiprocessing.Pool() as pool:
        results = pool.map(functools.partial(examine, bench), cases, chunksize=1)
    rows, compared, largest, named = [], 0, {}, []
    for case, found in zip(cases, results):
        rows += complaints(case.name, found)
        for peer, operation, quantity, theirs, own, share in comparisons(found):
            if case.name in WRONG.get(peer, ()):
                continue
            compared += 1
            largest[peer, quantity] = max(largest.get((peer, quantity), 0.0), share)
            named.append((f"{share:.1e}", peer, quantity, operation, case.name, repr(theirs), repr(own)))
    by_name = dict(zip((case.name for case in cases), zip(cases, results)))
    for name in {"struts", "reference: tori"} & by_name.keys():
        rows += through_the_command_line(program, *by_name[name])
    harness.print_rows(rows)
    for (peer, quantity), share in sorted(largest.items()):
        print(f"largest difference of {quantity} to {peer}: {share:.1e} of the operands")
    for peer, names in WRONG.items():
        wrong = sorted(names & by_name.keys())
        print(f"wrong values of {peer}, as pinned: {len(wrong)} cases: {', '.join(wrong)}")
    print(f"{len(cases)} cases, {compared} values compared, {len(rows)} complaints")
    # A check that finds no peers or no meshes must not pass.
    enough = compared >= LEAST_VALUES * len(cases)
    if not enough:
        print(f"fewer than {LEAST_VALUES} values compared for each case")
    if rows_file:
        Path(rows_file).write_text("".join("  ".join(row) + "\n" for row in named))
    return not rows and enough


def main():
    parser = harness.parser(__doc__)
    parser.add_argument("--bench", type=lambda path: Path(path).resolve(), required=True, help="the built ldi-bench")
    parser.add_argument("--corpus", type=Path, help="compare pairs of the closed models in this folder")
    parser.add_argument("--rows", metavar="FILE", help="write every difference, a line each")
    given = parser.parse_args()
    passed = self_test(given.bench) if given.self_test else check(given.program, given.bench, given.corpus, given.rows)
    harness.leave(passed)


if __name__ == "__main__":
    main()
