#!/usr/bin/env python3
"""Times the Boolean or Minkowski sum of two STL files by every peer that is installed (see requirements.txt), with --write
to a third. Programs of voxels take part where --resolution says how many there are along the longest side; they tell the
volume of the intersection alone.

Of the peers manifold3d alone has sums, which are right where B is convex and contains the origin. B is moved until it
does, and the sum back; whether B is convex is told beside the sum, and where it is not, the sum is wrong.

Each peer runs in a process of its own, so that its peak memory is its own and a peer that fails takes no other along.
The steps are timed apart, because a caller who keeps the built solid pays for reading, welding and building once only.
Every run starts from the file; what is printed is the median of the runs, step by step.
"""

import argparse
import importlib.metadata
import json
import os
import platform
import statistics
import subprocess
import sys
import time
from pathlib import Path

SUM = "minkowski_sum"
OPERATIONS = ("intersection", "union", "difference", SUM)
STEPS = ("read", "weld", "build", "boolean", "write", "volume")


class Steps:
    """Seconds by step, and what else there is to tell; a step that a peer does not have stays None."""

    def __init__(self, resolution):
        self.resolution = resolution
        self.seconds = dict.fromkeys(STEPS)
        # Of all threads and all steps.
        self.cpu_seconds = 0.0
        self.notes = {}

    def time(self, step, work):
        start, cpu_start = time.perf_counter(), time.process_time()
        value = work()
        self.seconds[step] = time.perf_counter() - start
        self.cpu_seconds += time.process_time() - cpu_start
        return value


def read_corners(path):
    """The corners of a binary STL file, three rows a triangle, in f32."""
    import numpy as np

    raw = np.fromfile(path, np.uint8)
    count = int.from_bytes(raw[80:84].tobytes(), "little")
    if len(raw) != 84 + 50 * count:
        raise ValueError(f"{path}: not a binary STL file")
    return np.ascontiguousarray(raw[84:].reshape(count, 50)[:, 12:48]).view("<f4").reshape(-1, 3)


def weld(corners):
    """Points and triangles, where corners of equal coordinates became one point.

    Points are in the order of the file, so that neighbours lie near each other in memory.
    """
    import numpy as np

    corners = corners + np.float32(0)  # −0 equals 0 but has other bits
    bits = corners.view(np.uint32).astype(np.uint64)
    # Sorting one mixed word is several times as fast as sorting rows; whether it told all points apart is then seen.
    multipliers = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    mixed = (bits * multipliers).sum(axis=1, dtype=np.uint64)
    _, first, index = np.unique(mixed, return_index=True, return_inverse=True)
    points = corners[first]
    if not (points[index] == corners).all():
        points, first, index = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return points[order], rank[index].reshape(-1, 3)


def run_manifold3d(files, operation, steps, out):
    import manifold3d
    import numpy as np
    import trimesh

    corners = steps.time("read", lambda: [read_corners(file) for file in files])
    meshes = steps.time("weld", lambda: [weld(c) for c in corners])

    def build():
        solids = []
        for points, triangles in meshes:
            solids.append(
                manifold3d.Manifold(manifold3d.Mesh64(points.astype(np.float64), triangles.astype(np.uint64)))
            )
            if solids[-1].status() != manifold3d.Error.NoError:
                raise ValueError(f"manifold3d refuses an input: {solids[-1].status().name}")
        return solids

    a, b = steps.time("build", build)

    def boolean():
        if operation == SUM:
            middle = b.to_mesh64().vert_properties[:, :3].mean(axis=0)
            result = a.minkowski_sum(b.translate(-middle)).translate(middle)
        else:
            result = {"intersection": a.__xor__, "union": a.__add__, "difference": a.__sub__}[operation](b)
        # The operators only note what is to be done; asking for a number has it done.
        return result, result.num_tri()

    result, triangles = steps.time("boolean", boolean)
    if operation == SUM:
        steps.notes["b_convex"] = b.hull().volume() - b.volume() <= 1e-6 * b.volume()

    def write():
        # STL holds f32, so that nothing is lost.
        mesh = result.to_mesh()
        trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False).export(out)

    if out:
        steps.time("write", write)
    return steps.time("volume", result.volume), triangles


def run_trueform(files, operation, steps, out, dtype="float32"):
    import trueform

    # Its reader welds as it reads, and gives f32.
    meshes = steps.time("read", lambda: [trueform.read_stl(str(file)) for file in files])

    def build():
        built = [trueform.Mesh(faces, points.astype(dtype)) for faces, points in meshes]
        for mesh in built:
            # All that the Boolean would otherwise build when first called.
            mesh.build_tree()
            mesh.build_face_membership()
            mesh.build_manifold_edge_link()
        return built

    a, b = steps.time("build", build)
    result = steps.time("boolean", lambda: getattr(trueform, f"boolean_{operation}")(a, b)[0])

    def write():
        faces, points = result
        if not trueform.write_stl((faces, points.astype("float32")), str(out)):
            raise ValueError(f"trueform does not write {out}")

    if out:
        steps.time("write", write)
    return steps.time("volume", lambda: trueform.signed_volume(result)), len(result[0])


def run_trueform_f64(files, operation, steps, out):
    return run_trueform(files, operation, steps, out, "float64")


def run_libigl(files, operation, steps, out):
    import igl.copyleft.cgal
    import numpy as np
    import trimesh

    corners = steps.time("read", lambda: [read_corners(file) for file in files])
    meshes = steps.time("weld", lambda: [weld(c) for c in corners])
    (points_a, triangles_a), (points_b, triangles_b) = ((p.astype(np.float64), t.astype(np.int64)) for p, t in meshes)
    points, triangles, _ = steps.time(
        "boolean",
        lambda: igl.copyleft.cgal.mesh_boolean(points_a, triangles_a, points_b, triangles_b, operation),
    )

    def volume():
        a, b, c = (points[triangles[:, i]] for i in range(3))
        return float((a * np.cross(b, c)).sum() / 6)

    if out:
        steps.time("write", lambda: trimesh.Trimesh(points, triangles, process=False).export(out))
    return steps.time("volume", volume), len(triangles)


def run_meshlib(files, operation, steps, out):
    from meshlib import mrmeshpy

    # Its reader welds as it reads, and gives f32.
    meshes = steps.time("read", lambda: [mrmeshpy.loadMesh(str(file)) for file in files])

    def build():
        for mesh in meshes:
            # The Boolean would otherwise build it when first called.
            mesh.getAABBTree()
        return meshes

    a, b = steps.time("build", build)
    names = {"intersection": "Intersection", "union": "Union", "difference": "DifferenceAB"}

    def boolean():
        result = mrmeshpy.boolean(a, b, getattr(mrmeshpy.BooleanOperation, names[operation]))
        if not result.valid():
            raise ValueError(f"meshlib refuses: {result.errorString}")
        return result.mesh

    result = steps.time("boolean", boolean)
    if out:
        steps.time("write", lambda: mrmeshpy.saveMesh(result, str(out)))
    return steps.time("volume", result.volume), result.topology.numValidFaces()


def run_cgal(files, operation, steps, out):
    from CGAL import CGAL_Polygon_mesh_processing as processing
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3

    corners = steps.time("read", lambda: [read_corners(file) for file in files])
    meshes = steps.time("weld", lambda: [weld(c) for c in corners])

    def build():
        built = []
        for points, triangles in meshes:
            polyhedron, soup, faces = Polyhedron_3(), processing.Point_3_Vector(), processing.Polygon_Vector()
            for x, y, z in points.astype(float).tolist():
                soup.append(Point_3(x, y, z))
            for triangle in triangles.tolist():
                faces.append(processing.Int_Vector(triangle))
            processing.polygon_soup_to_polygon_mesh(soup, faces, polyhedron)
            built.append(polyhedron)
        return built

    a, b = steps.time("build", build)

    def boolean():
        result = Polyhedron_3()
        if not getattr(processing, f"corefine_and_compute_{operation}")(a, b, result):
            raise ValueError("CGAL: the result is not a manifold")
        return result

    result = steps.time("boolean", boolean)
    if out:
        raise ValueError("CGAL: the result is not written here")
    return steps.time("volume", lambda: processing.volume(result)), result.size_of_facets()


def common_raster(meshes, resolution):
    """The lower corner, the pitch and the numbers of voxels of a raster around points."""
    import numpy as np

    low = np.min([points.min(axis=0) for points, _ in meshes], axis=0).astype(float)
    high = np.max([points.max(axis=0) for points, _ in meshes], axis=0).astype(float)
    pitch = (high - low).max() / resolution
    return low, pitch, np.ceil((high - low) / pitch).astype(int)


def run_open3d(files, operation, steps, out):
    import numpy as np
    import open3d

    corners = steps.time("read", lambda: [read_corners(file) for file in files])
    meshes = steps.time("weld", lambda: [weld(c) for c in corners])
    low, pitch, counts = common_raster(meshes, steps.resolution)

    def build():
        scenes = []
        for points, triangles in meshes:
            scenes.append(open3d.t.geometry.RaycastingScene())
            scenes[-1].add_triangles(open3d.core.Tensor(points), open3d.core.Tensor(triangles.astype(np.uint32)))
        return scenes

    scenes = steps.time("build", build)

    def boolean():
        centres = [low[axis] + pitch * (np.arange(counts[axis]) + 0.5) for axis in range(3)]
        both = 0
        # Slabs, as the points of all voxels do not fit into memory.
        for z in np.array_split(centres[2], max(1, len(centres[2]) // 16)):
            x, y, z = np.meshgrid(centres[0], centres[1], z, indexing="ij")
            points = open3d.core.Tensor(np.stack([x, y, z], axis=-1).astype(np.float32).reshape(-1, 3))
            inside = [scene.compute_occupancy(points).numpy() > 0 for scene in scenes]
            both += int((inside[0] & inside[1]).sum())
        return both

    both = steps.time("boolean", boolean)
    return both * pitch**3, 0


def run_vtk(files, operation, steps, out):
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkImagingStencil import vtkImageStencilToImage, vtkPolyDataToImageStencil
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    def read():
        meshes = []
        for file in files:
            # Its reader welds as it reads.
            reader = vtkSTLReader()
            reader.SetFileName(str(file))
            reader.Update()
            meshes.append(reader.GetOutput())
        return meshes

    meshes = steps.time("read", read)
    boxes = [np.array(mesh.GetBounds()).reshape(3, 2) for mesh in meshes]
    low, pitch, counts = common_raster([(box.T, None) for box in boxes], steps.resolution)

    def voxels(mesh):
        stencil = vtkPolyDataToImageStencil()
        stencil.SetInputData(mesh)
        stencil.SetOutputOrigin(*(low + 0.5 * pitch))
        stencil.SetOutputSpacing(pitch, pitch, pitch)
        stencil.SetOutputWholeExtent(0, counts[0] - 1, 0, counts[1] - 1, 0, counts[2] - 1)
        image = vtkImageStencilToImage()
        image.SetInputConnection(stencil.GetOutputPort())
        image.SetOutputScalarTypeToUnsignedChar()
        image.SetInsideValue(1)
        image.Update()
        return vtk_to_numpy(image.GetOutput().GetPointData().GetScalars())

    a, b = steps.time("build", lambda: [voxels(mesh) for mesh in meshes])
    both = steps.time("boolean", lambda: int((a & b).sum()))
    return both * pitch**3, 0


def run_picopie(files, operation, steps, out):
    import picopie

    corners = [read_corners(file) for file in files]
    _, pitch, _ = common_raster([(c, None) for c in corners], steps.resolution)
    del corners
    if not picopie.is_initialized():
        picopie.init(voxel_size_mm=float(pitch))
    meshes = steps.time("read", lambda: [picopie.Mesh.load_stl(str(file)) for file in files])
    a, b = steps.time("build", lambda: [picopie.Voxels.from_mesh(mesh) for mesh in meshes])
    steps.time("boolean", lambda: a.bool_intersect_(b))
    return steps.time("volume", lambda: a.calculate_properties()[0]), 0


# name: (distribution, what runs it)
VOXELS = {
    "open3d": ("open3d", run_open3d),
    "vtk": ("vtk", run_vtk),
    "picopie": ("picopie", run_picopie),
}
PEERS = {
    "manifold3d": ("manifold3d", run_manifold3d),
    "trueform": ("trueform", run_trueform),
    "trueform-f64": ("trueform", run_trueform_f64),
    "meshlib": ("meshlib", run_meshlib),
    "libigl": ("libigl", run_libigl),
    "cgal": ("cgal", run_cgal),
} | VOXELS


def peak_memory():
    """In bytes. VmHWM is of this program alone; getrusage would count what the parent held when it started us."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    return None


def measure(peer, files, operation, runs, out, resolution):
    """In the peer's own process: medians, volume, peak memory."""
    _, run = PEERS[peer]
    every, answers, cpu = [], [], []
    for _ in range(runs):
        steps = Steps(resolution)
        answers.append(run(files, operation, steps, out))
        every.append(steps.seconds)
        cpu.append(steps.cpu_seconds)
    seconds = {step: None if every[0][step] is None else statistics.median(s[step] for s in every) for step in STEPS}
    seconds["total"] = statistics.median(sum(filter(None, s.values())) for s in every)
    volume, triangles = answers[0]
    return {
        "volume": volume,
        "triangles": triangles,
        "same_every_run": all(answer == answers[0] for answer in answers),
        **steps.notes,
        "seconds": seconds,
        "every_total": [sum(filter(None, s.values())) for s in every],
        "cpu_seconds": statistics.median(cpu),
        "peak_memory_bytes": peak_memory(),
    }


def measure_apart(peer, files, operation, runs, timeout, out, resolution):
    """Starts this program again for the one peer."""
    if operation == SUM and peer != "manifold3d":
        return {"peer": peer, "refused": "has no Minkowski sums"}
    if peer in VOXELS and (operation != "intersection" or out):
        return {"peer": peer, "refused": "tells volumes of intersections alone"}
    distribution, _ = PEERS[peer]
    try:
        row = {"peer": peer, "version": importlib.metadata.version(distribution)}
    except importlib.metadata.PackageNotFoundError:
        return {"peer": peer, "refused": "not installed"}
    command = [sys.executable, __file__, "--build-and-intersect", *files, "--op", operation, "--runs", str(runs)]
    command += ["--write", str(out)] if out else []
    command += ["--resolution", str(resolution)] if resolution else []
    try:
        run = subprocess.run([*command, "--only", peer], capture_output=True, text=True, timeout=timeout)
    except subprocess.TimeoutExpired:
        return row | {"refused": f"not done within {timeout} s"}
    if run.returncode != 0:
        last = (run.stderr.strip().splitlines() or [""])[-1]
        return row | {"refused": f"ended with status {run.returncode}: {last}"}
    return row | json.loads(run.stdout)


def print_table(rows, file):
    columns = (*STEPS, "total")
    heads = "".join(f"{c + ' s':>11}" for c in columns)
    print(f"{'peer':14}{'version':10}{heads}{'peak MiB':>10}  volume", file=file)
    for row in rows:
        head = f"{row['peer']:14}{row.get('version', ''):10}"
        if "refused" in row:
            print(f"{head}  {row['refused']}", file=file)
            continue
        cells = ["–" if row["seconds"][c] is None else f"{row['seconds'][c]:.4f}" for c in columns]
        memory = row["peak_memory_bytes"]
        cells.append("–" if memory is None else f"{memory / 2**20:.0f}")
        times = "".join(f"{c:>11}" for c in cells[:-1])
        remark = "" if row["same_every_run"] else "  (other in another run)"
        remark += "" if row.get("b_convex", True) else "  (wrong: B is not convex)"
        print(f"{head}{times}{cells[-1]:>10}  {row['volume']!r}{remark}", file=file)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--build-and-intersect", nargs=2, metavar=("A.stl", "B.stl"), type=Path, required=True)
    arguments.add_argument("--op", choices=OPERATIONS, default="intersection")
    arguments.add_argument("--runs", type=int, default=5, help="of each peer; medians are printed (default 5)")
    arguments.add_argument("--timeout", type=float, default=600, help="seconds for all runs of a peer (default 600)")
    arguments.add_argument("--peers", help=f"which, of {','.join(PEERS)}; without --resolution not the last {len(VOXELS)}")
    arguments.add_argument("--resolution", type=int, help="voxels along the longest side of both solids together")
    arguments.add_argument("--write", metavar="OUT.stl", type=Path, help="write the result too")
    arguments.add_argument("--json", metavar="FILE", help="for machines; - is stdout, with the table on stderr")
    arguments.add_argument("--only", choices=PEERS, help=argparse.SUPPRESS)
    given = arguments.parse_args()
    files = [path.resolve() for path in given.build_and_intersect]

    if given.only:
        print(json.dumps(measure(given.only, files, given.op, given.runs, given.write, given.resolution)))
        return
    names = given.peers.split(",") if given.peers else [name for name in PEERS if given.resolution or name not in VOXELS]
    if not set(names) <= PEERS.keys():
        arguments.error(f"--peers: choose from {', '.join(PEERS)}")
    if set(names) & VOXELS.keys() and not given.resolution:
        arguments.error(f"{', '.join(VOXELS)} need --resolution")
    rows = [
        measure_apart(name, files, given.op, given.runs, given.timeout, given.write, given.resolution)
        for name in names
    ]
    print_table(rows, sys.stderr if given.json == "-" else sys.stdout)
    if given.json:
        document = {
            "operation": given.op,
            "inputs": [{"path": str(given_path), "triangles": (path.stat().st_size - 84) // 50}
                       for given_path, path in zip(given.build_and_intersect, files)],
            "runs": given.runs,
            "processors": len(os.sched_getaffinity(0)),
            "python": platform.python_version(),
            "results": rows,
        }
        text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
        if given.json == "-":
            sys.stdout.write(text)
        else:
            Path(given.json).write_text(text)


if __name__ == "__main__":
    main()
