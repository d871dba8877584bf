#!/usr/bin/env python3
"""Checks the error (±) that the program prints against the true error.

Runs the program on random cases whose volumes are known from other sources (divergence sums of meshes that do not cross
themselves, manifold3d's exact Booleans, hulls of vertex sums, Steiner's formula) and compares the true error with the printed ±:
it must be within ± in at least 97 % of the cases, and within three times ± in all. A printed bound must hold. Prints a table by
family, axis and mode; exits 1 where a share is missed. `--self-test` also falsifies what the program said, and exits 1 unless
each falsehood is noticed.

  estimates.py --program target/release/ldi-ops --cases 5000 [--seed 1] [--rows FILE] [--only FAMILY] [--self-test]
"""

import argparse
import collections
import json
import math
import multiprocessing
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import manifold3d
import numpy as np
from scipy.spatial import ConvexHull

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "reference"))
import pairs  # noqa: E402

DATA = Path(__file__).resolve().parents[2] / "data" / "models"
AXES = ("all", "x", "y", "z")
MODES = ("exact", "over", "under")
TIMEOUT = 300


# Meshes: (positions, triangles), both numpy arrays.

def volume_of(mesh):
    """Returns the volume of a mesh by its divergence sum."""
    p, t = mesh
    p = p - p.mean(axis=0)
    a, b, c = p[t[:, 0]], p[t[:, 1]], p[t[:, 2]]
    return math.fsum(np.einsum("ij,ij->i", a, np.cross(b, c))) / 6.0


def write_obj(path, mesh):
    with open(path, "w") as file:
        for x, y, z in mesh[0].tolist():
            file.write(f"v {x!r} {y!r} {z!r}\n")
        for a, b, c in (mesh[1] + 1).tolist():
            file.write(f"f {a} {b} {c}\n")


def box(size, at=(0.0, 0.0, 0.0)):
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    triangles = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
                 [1, 3, 5], [3, 7, 5]]
    return corners * np.array(size, dtype=float) + np.array(at, dtype=float), np.array(triangles)


def hull(points):
    """Returns the convex hull, facing outwards."""
    points = np.asarray(points, dtype=float)
    found = ConvexHull(points)
    middle, triangles = points[found.vertices].mean(axis=0), []
    for triangle in found.simplices:
        a, b, c = points[triangle]
        outwards = np.dot(np.cross(b - a, c - a), a - middle) > 0
        triangles.append(triangle if outwards else triangle[::-1])
    used, triangles = np.unique(np.array(triangles), return_inverse=True)
    return points[used], triangles.reshape(-1, 3)


def turned(mesh, rng):
    """Turns a mesh at random about the middle of its box."""
    q = np.array([rng.gauss(0, 1) for _ in range(4)])
    w, x, y, z = q / np.linalg.norm(q)
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    middle = (mesh[0].min(axis=0) + mesh[0].max(axis=0)) / 2
    return (mesh[0] - middle) @ turn.T + middle, mesh[1]


def moved(mesh, by):
    return mesh[0] + np.asarray(by), mesh[1]


def sized(mesh, size):
    """Scales a mesh to a longest side and moves it to the origin."""
    low, high = mesh[0].min(axis=0), mesh[0].max(axis=0)
    return (mesh[0] - (low + high) / 2) * (size / (high - low).max()), mesh[1]


def solid(mesh):
    made = manifold3d.Manifold(manifold3d.Mesh64(vert_properties=np.ascontiguousarray(mesh[0]),
                                                 tri_verts=np.ascontiguousarray(mesh[1], dtype=np.uint64)))
    if made.status() != manifold3d.Error.NoError:
        raise ValueError(str(made.status()))
    return made


def mesh_of(made):
    found = made.to_mesh64()
    return np.array(found.vert_properties)[:, :3], np.array(found.tri_verts).astype(int)


# Cases: (arguments, meshes, truth).

def models():
    names = ("bcc_lattice", "bone", "cubic_lattice", "cylinder", "diamond_network", "gyroid_sheet", "primitive_sheet",
             "sphere", "torus")
    return {name: sized(pairs.read(DATA / f"{name}.stl"), 10.0) for name in names}


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def random_box(rng):
    return box([log_uniform(rng, 0.5, 10) for _ in range(3)])


def plate(rng):
    thin = [10.0, rng.choice([10.0, 10.0 * rng.random() + 0.1]), log_uniform(rng, 1e-3, 1.0)]
    rng.shuffle(thin)
    return box(thin)


def needle(rng):
    thin = [10.0, log_uniform(rng, 1e-3, 0.5), log_uniform(rng, 1e-3, 0.5)]
    rng.shuffle(thin)
    return box(thin)


def lattice(rng, cells):
    """Returns the struts of a cubic lattice, square or round, along the axes."""
    side = 10.0 / cells
    radius = side * rng.uniform(0.08, 0.3)
    struts = []
    round_struts = rng.random() < 0.5
    for axis in range(3):
        for i in range(cells):
            for j in range(cells):
                if round_struts:
                    strut = manifold3d.Manifold.cylinder(10.0, radius, radius, 12)
                    strut = strut.translate((i * side + side / 2, j * side + side / 2, 0.0))
                else:
                    strut = manifold3d.Manifold.cube((2 * radius, 2 * radius, 10.0))
                    strut = strut.translate((i * side + side / 2 - radius, j * side + side / 2 - radius, 0.0))
                if axis == 0:
                    strut = strut.transform(np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0]], dtype=float))
                elif axis == 1:
                    strut = strut.transform(np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0]], dtype=float))
                struts.append(strut)
    return manifold3d.Manifold.batch_boolean(struts, manifold3d.OpType.Add)


def some_part(rng, parts):
    kind = rng.random()
    if kind < 0.6:
        return parts[rng.choice(sorted(parts))]
    if kind < 0.8:
        return random_box(rng)
    return hull([[rng.gauss(0, 3) for _ in range(3)] for _ in range(rng.randint(4, 30))])


def posed(mesh, rng):
    kind = rng.random()
    if kind < 0.6:
        mesh = turned(mesh, rng)
    return mesh


def boolean_truth(operation, a, b):
    a, b = solid(a), solid(b)
    common = (a ^ b).volume()
    va, vb = a.volume(), b.volume()
    return {"intersect": common, "union": va + vb - common, "difference": va - common, "xor": va + vb - 2 * common}[operation]


def case_part(rng, parts):
    mesh = posed(some_part(rng, parts), rng)
    return ["volume", 0], [mesh], volume_of(mesh)


def case_boolean(rng, parts):
    a, b = posed(some_part(rng, parts), rng), posed(some_part(rng, parts), rng)
    b = moved(b, [rng.uniform(-4, 4) for _ in range(3)])
    operation = rng.choice(["intersect", "union", "difference", "xor"])
    return [operation, 0, 1], [a, b], boolean_truth(operation, a, b)


def case_thin(rng, parts):
    a = plate(rng) if rng.random() < 0.5 else needle(rng)
    if rng.random() < 0.4:
        a = turned(a, rng)
    if rng.random() < 0.3:
        return ["volume", 0], [a], volume_of(a)
    b = random_box(rng) if rng.random() < 0.5 else plate(rng)
    b = moved(b, [rng.uniform(-1, 3) for _ in range(3)])
    if rng.random() < 0.3:
        b = turned(b, rng)
    operation = rng.choice(["intersect", "union", "difference", "xor"])
    return [operation, 0, 1], [a, b], boolean_truth(operation, a, b)


def case_in_step(rng, parts):
    cells = rng.choice([2, 3, 4, 5, 6, 8])
    a = lattice(rng, cells)
    rays = cells * rng.choice([8, 10, 12, 16, 20, 24, 32, 40, 48, 64])
    if rng.random() < 0.3:
        return ["volume", 0], [mesh_of(a)], a.volume(), rays
    other = rng.choice(["box", "sphere", "shifted"])
    if other == "box":
        b = solid(box([10.0, 10.0, 10.0 * rng.uniform(0.3, 1.0)]))
    elif other == "sphere":
        b = manifold3d.Manifold.sphere(rng.uniform(3, 5), 64).translate((5, 5, 5))
    else:
        b = a.translate([rng.uniform(0, 10.0 / cells) for _ in range(3)])
    operation = rng.choice(["intersect", "union", "difference", "xor"])
    a, b = mesh_of(a), mesh_of(b)
    return [operation, 0, 1], [a, b], boolean_truth(operation, a, b), rays


def case_sum(rng, parts):
    if rng.random() < 0.5:
        a = posed(random_box(rng), rng)
    else:
        a = hull([[rng.gauss(0, 3) for _ in range(3)] for _ in range(rng.randint(4, 20))])
    if rng.random() < 0.3:
        b = posed(box([log_uniform(rng, 0.1, 3) for _ in range(3)]), rng)
    else:
        b = hull([[rng.gauss(0, 0.7) for _ in range(3)] for _ in range(rng.randint(4, 20))])
    if rng.random() < 0.3:
        # Boxes that touch or overlap: their sum with a box is the union of their sums.
        pieces = [box([log_uniform(rng, 0.5, 5) for _ in range(3)], [rng.uniform(0, 4) for _ in range(3)]) for _ in range(4)]
        b = box([log_uniform(rng, 0.1, 2) for _ in range(3)])
        a = manifold3d.Manifold.batch_boolean([solid(piece) for piece in pieces], manifold3d.OpType.Add)
        size = b[0].max(axis=0) - b[0].min(axis=0)
        grown = [(np.where(p[0] > p[0].mean(axis=0), p[0] + size, p[0]), p[1]) for p in pieces]
        total = manifold3d.Manifold.batch_boolean([solid(piece) for piece in grown], manifold3d.OpType.Add)
        return ["minkowski", 0, 1], [mesh_of(a), b], total.volume()
    sums = (a[0][:, None, :] + b[0][None, :, :]).reshape(-1, 3)
    return ["minkowski", 0, 1], [a, b], ConvexHull(sums).volume


def steiner(mesh, distance):
    """Returns the volume of a convex polyhedron grown by a ball."""
    p, t = mesh
    normals = np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]])
    area = np.linalg.norm(normals, axis=1).sum() / 2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    edges = collections.defaultdict(list)
    for i, triangle in enumerate(t.tolist()):
        for j in range(3):
            edges[tuple(sorted((triangle[j], triangle[(j + 1) % 3])))].append(i)
    bend = 0.0
    for (u, v), (i, j) in edges.items():
        angle = math.atan2(np.linalg.norm(np.cross(normals[i], normals[j])), float(np.dot(normals[i], normals[j])))
        bend += np.linalg.norm(p[u] - p[v]) * angle
    return volume_of(mesh) + area * distance + bend * distance ** 2 / 2 + 4 / 3 * math.pi * distance ** 3


def case_offset(rng, parts):
    kind = rng.random()
    if kind < 0.25:
        size = [log_uniform(rng, 0.5, 10) for _ in range(3)]
        distance = -rng.uniform(0.02, 0.45) * min(size)
        return ["offset", 0, "--distance", repr(distance)], [box(size)], math.prod(s + 2 * distance for s in size)
    if kind < 0.5:
        mesh = needle(rng) if rng.random() < 0.5 else plate(rng)
    elif kind < 0.75:
        mesh = random_box(rng)
    else:
        mesh = hull([[rng.gauss(0, 3) for _ in range(3)] for _ in range(rng.randint(4, 20))])
    mesh = posed(mesh, rng)
    distance = log_uniform(rng, 0.02, 3)
    return ["offset", 0, "--distance", repr(distance)], [mesh], steiner(mesh, distance)


FAMILIES = {"part": case_part, "boolean": case_boolean, "thin": case_thin, "in-step": case_in_step, "sum": case_sum,
            "offset": case_offset}
SHARES = {"part": 0.14, "boolean": 0.28, "thin": 0.18, "in-step": 0.16, "sum": 0.12, "offset": 0.12}


def make(seed, family):
    rng = random.Random(seed)
    found = FAMILIES[family](rng, PARTS)
    command, meshes, truth = found[:3]
    rays = found[3] if len(found) > 3 else round(log_uniform(rng, 16, 2048 if rng.random() < 0.1 else 400))
    axis, mode = rng.choice(AXES) if rng.random() < 0.7 else "all", rng.choice(MODES)
    return command, meshes, truth, rays, axis, mode


def run(task):
    program, seed, family = task
    try:
        command, meshes, truth, rays, axis, mode = make(seed, family)
    except ValueError as error:
        return {"seed": seed, "family": family, "skipped": str(error)}
    with tempfile.TemporaryDirectory() as folder:
        paths = [str(Path(folder) / f"{'ab'[i]}.obj") for i in range(len(meshes))]
        for path, mesh in zip(paths, meshes):
            write_obj(path, mesh)
        arguments = [paths[part] if isinstance(part, int) else part for part in command]
        line = [program, *arguments, "--unit", "mm", "--json", "-", "--quiet"]
        # Sums and offsets have no exact volume.
        estimate = ["--estimate"] if command[0] in EXACT_COMMANDS else []
        raster = ["--axis", axis, "--mode", mode, "--resolution", str(rays), *estimate]
        row = {"seed": seed, "family": family, "command": command[0], "axis": axis, "mode": mode, "rays": rays, "truth": truth}
        try:
            ran = subprocess.run([*line, *raster], capture_output=True, text=True, timeout=TIMEOUT)
            exact = subprocess.run(line, capture_output=True, text=True, timeout=TIMEOUT) if estimate else None
        except subprocess.TimeoutExpired:
            return {**row, "skipped": "timeout"}
    if ran.returncode not in (0, 1):
        return {**row, "skipped": ran.stderr.strip().splitlines()[-1][:200] if ran.stderr.strip() else "?"}
    row["volume"] = json.loads(ran.stdout)["volume"]
    if exact and exact.returncode == 0:
        found = json.loads(exact.stdout)["volume"]
        row["exact"] = found if found["method"] == "exact" else None
    return row


PARTS = models()

# The commands whose volumes can be exact.
EXACT_COMMANDS = ("intersect", "union", "difference", "xor", "csg", "volume")


def judged(row):
    """Yields true errors in units of the printed error: of the estimate, and of the exact value."""
    volume, truth = row["volume"], row["truth"]
    # The tolerance for rounding of the true volume itself.
    slack = 1e-9 * abs(truth) + 1e-12
    stated = [("value", volume["value"], volume["estimate_error"])]
    if row.get("exact"):
        stated.append(("exact", row["exact"]["value"], row["exact"]["estimate_error"]))
    for what, value, error in stated:
        yield what, abs(value - truth) / max(error, slack), error / max(abs(truth), slack)
    if not volume["at_least"] - slack <= truth <= volume["at_most"] + slack:
        yield "bound", math.inf, math.inf


def table(rows):
    """Prints shares by group; returns whether all shares and bounds are met."""
    groups, skipped = collections.defaultdict(list), collections.Counter()
    for row in rows:
        if "skipped" in row:
            skipped[row["skipped"]] += 1
            continue
        for what, ratio, size in judged(row):
            names = ["all", row["family"], f"--axis {row['axis']}", f"--mode {row['mode']}"]
            keys = ["exact values"] if what == "exact" else names
            for key in keys:
                groups[key].append((ratio, size, what, row))
    print(f"{'cases':16}{'number':>8}{'within ±':>10}{'within 3 ×':>12}{'worst':>8}{'median error / ±':>18}{'median ±, %':>13}")
    kept = True
    for key, found in groups.items():
        ratios = sorted(ratio for ratio, *_ in found)
        sizes = sorted(size for _, size, *_ in found)
        within, thrice = (sum(ratio <= bound for ratio in ratios) / len(ratios) for bound in (1, 3))
        kept &= thrice == 1 and (within >= 0.97 or key != "all")
        middle = len(found) // 2
        print(f"{key:16}{len(found):8}{100 * within:9.2f}%{100 * thrice:11.2f}%{ratios[-1]:8.2f}{ratios[middle]:18.3f}"
              f"{100 * sizes[middle]:13.3f}")
    worst = sorted(groups["all"], key=lambda entry: -entry[0])[:8]
    print("\nworst:")
    for ratio, _, what, row in worst:
        volume = row["volume"]
        print(f"{ratio:8.2f}  seed {row['seed']} {row['command']} {row['family']} --axis {row['axis']} --mode {row['mode']} "
              f"--resolution {row['rays']}: {volume['value']:.7g} ± {volume['estimate_error']:.2g} ({what}), true {row['truth']:.7g}")
    for reason, count in skipped.most_common():
        print(f"left out {count}: {reason}")
    return kept and len(groups["all"]) > 0 and sum(skipped.values()) <= 0.02 * len(rows)


def self_test(rows):
    """Checks that the judgement finds every falsehood: an error made too small, a value moved, a bound on the wrong side."""
    import contextlib
    import copy
    import io

    def noticed(change):
        false = copy.deepcopy(rows)
        for row in false:
            if "volume" in row:
                change(row["volume"], row["truth"])
        with contextlib.redirect_stdout(io.StringIO()):
            return not table(false)

    def shrink(volume, truth):
        for part in (volume, volume["rays"] or {}):
            if "estimate_error" in part:
                part["estimate_error"] *= 1e-3

    def move(volume, truth):
        volume["value"] += 4 * volume["estimate_error"] + 1e-6 * abs(truth) + 1e-6

    def bound(volume, truth):
        volume["at_most"] = 0.99 * truth - 1e-6

    found = {change.__name__: noticed(change) for change in (shrink, move, bound)}
    print("falsehoods noticed:", found)
    return all(found.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--cases", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=sorted(FAMILIES))
    parser.add_argument("--rows", help="write every case here, a line of JSON each")
    parser.add_argument("--self-test", action="store_true", help="falsify what the program said, and see that it is noticed")
    options = parser.parse_args()
    program = str(Path(options.program).resolve())
    tasks = []
    for family, share in SHARES.items():
        if options.only in (None, family):
            count = options.cases if options.only else round(options.cases * share)
            first = options.seed * 10_000_000 + list(FAMILIES).index(family) * 1_000_000
            tasks += [(program, first + i, family) for i in range(count)]
    rows = []
    with multiprocessing.Pool() as pool:
        for row in pool.imap_unordered(run, tasks, chunksize=4):
            rows.append(row)
    rows.sort(key=lambda row: row["seed"])
    if options.rows:
        Path(options.rows).write_text("".join(json.dumps(row) + "\n" for row in rows))
    kept = table(rows)
    if options.self_test:
        kept = self_test(rows) and kept
    sys.exit(0 if kept else 1)


if __name__ == "__main__":
    main()
