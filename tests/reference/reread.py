#!/usr/bin/env python3
"""Checks that other programs read the files of ldi-ops with the intended content.

usage: reread.py --program LDI-OPS [--self-test]

Runs every command line of `cases()`, in a folder of its own, and re-reads the written file: 3MF by lib3mf in strict mode, all
else by trimesh. Volume, area, box, triangles, watertightness, winding and unit must be those that the case expects. Exits 1 with
a table of the differences. `--self-test` also falsifies the expected values in each of these ways, and damages files, and exits 1
unless the check finds every falsehood, and no fault in the files as they are.
"""

import dataclasses
import struct
import tempfile
from pathlib import Path

import harness
import numpy as np
import packages
import trimesh

MODELS = Path(__file__).resolve().parents[2] / "data" / "models"

# Metres to a unit.
UNITS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048, "m": 1.0}

# Formats, and the share of a model's size by which reading may round its coordinates: lib3mf keeps 32 bits.
FORMATS = {"stl": 2e-7, "obj": 1e-15, "ply": 1e-15, "off": 1e-15, "glb": 2e-7, "3mf": 2e-7}


@dataclasses.dataclass
class Solid:
    """The found or expected content of a file; lengths are in `unit`, where the format has one."""

    volume: float
    area: float
    triangles: int
    bounds: np.ndarray
    watertight: bool = True
    winding: bool = True
    unit: str | None = None

    def scaled(self, factor, unit):
        """Returns the same solid in another unit."""
        return dataclasses.replace(
            self, volume=self.volume * factor**3, area=self.area * factor**2, bounds=self.bounds * factor, unit=unit
        )


@dataclasses.dataclass
class Case:
    """A command line, in which `{out}` is the file that it writes, and the expected content of this file.

    Where the exact values are not known to the last digits, `tolerance` is the allowed relative error of volume and area. A solid
    without a count of triangles (None) may have any.
    """

    arguments: list
    suffix: str
    expected: Solid
    tolerance: float = 1e-6


def of_mesh(mesh, unit):
    return Solid(
        volume=float(mesh.volume),
        area=float(mesh.area),
        triangles=len(mesh.faces),
        bounds=np.array(mesh.bounds),
        watertight=bool(mesh.is_watertight),
        winding=bool(mesh.is_winding_consistent),
        unit=unit,
    )


def read_3mf(path):
    """Returns the solid of a package with one object and one item, as lib3mf reads it."""
    package = packages.read(path)
    # The indices of the file decide here, so nothing is merged.
    found = of_mesh(trimesh.Trimesh(package.points, package.faces, process=False), package.unit)
    if package.is_manifold != (found.watertight and found.winding):
        raise ValueError("lib3mf and trimesh disagree on whether the object is manifold and oriented")
    return found


def read_others(path):
    unit = "m" if path.suffix == ".glb" else None
    # A soup becomes a solid only once its corners are merged; the file's own indices decide in all other formats.
    mesh = trimesh.load(path, force="mesh", process=path.suffix == ".stl")
    return of_mesh(mesh, unit)


def read(path):
    return read_3mf(path) if path.suffix == ".3mf" else read_others(path)


def complaints(case, found):
    """Returns the differences between the found and the expected content, as (name, expected, found)."""
    expected, rows = case.expected, []
    rounding = FORMATS[case.suffix]
    size = float(np.max(expected.bounds[1] - expected.bounds[0]))
    # A coordinate that moves by a share of the size moves the volume by that share of size times area.
    scales = {"volume": size * expected.area, "area": size * size}
    for name, scale in scales.items():
        allowed = case.tolerance * abs(getattr(expected, name)) + rounding * scale
        if not abs(getattr(found, name) - getattr(expected, name)) <= allowed:
            rows.append((name, getattr(expected, name), getattr(found, name)))
    farthest = float(np.max(np.abs(expected.bounds)))
    if not np.max(np.abs(found.bounds - expected.bounds)) <= rounding * farthest + case.tolerance * size:
        rows.append(("box", expected.bounds.tolist(), found.bounds.tolist()))
    if expected.triangles is not None and found.triangles != expected.triangles:
        rows.append(("triangles", expected.triangles, found.triangles))
    for name in ("watertight", "winding", "unit"):
        if getattr(found, name) != getattr(expected, name):
            rows.append((name, getattr(expected, name), getattr(found, name)))
    return rows


def in_file(solid, unit, suffix):
    """Returns the content of a file of this format for a solid in this unit; without a unit (None), GLB takes m and 3MF mm."""
    if suffix == "glb":
        return solid.scaled(UNITS[unit] if unit else 1.0, "m")
    return solid.scaled(1.0, (unit or "mm") if suffix == "3mf" else None)


def conversions():
    """Yields models, each in a unit of its own, to every format."""
    models = [
        ("torus.stl", "mm", 1.0),
        ("gyroid_sheet.stl", "um", 250.0),
        ("bone.stl", "in", 0.125),
        ("geodesic.obj", "cm", 1.0),
        ("cylinder.stl", "ft", 3.0),
        ("sphere.stl", "m", 0.5),
        ("box.stl", None, 2.0),
    ]
    for name, unit, factor in models:
        path = MODELS / name
        solid = of_mesh(trimesh.load(path, force="mesh"), None)
        if not (solid.watertight and solid.winding and solid.volume > 0):
            raise ValueError(f"{path}: trimesh takes the model for no solid")
        solid = solid.scaled(factor, None)
        for suffix in FORMATS:
            arguments = ["convert", path, "-o", "{out}", "--transform-a", f"scale({factor})"]
            arguments += ["--unit", unit] if unit else []
            yield Case(arguments, suffix, in_file(solid, unit, suffix))


def chains():
    """Yields files that ldi-ops wrote, read by itself and written once more."""
    cube = Solid(volume=8000.0, area=2400.0, triangles=12, bounds=np.array([[-10.0] * 3, [10.0] * 3]))
    for suffix in FORMATS:
        yield Case(
            ["generate", "cuboid", "--min", "-10,-10,-10", "--max", "10,10,10", "-o", "{out}"],
            suffix,
            in_file(cube, "mm", suffix),
        )
        # GLB returns metres, so that the size stays the same.
        yield Case(
            ["convert", "{before}", "-o", "{out}", "--unit", "mm"],
            "3mf",
            cube.scaled(1e-3, "m") if suffix == "glb" else cube.scaled(1.0, "mm"),
        )


def cases():
    """Yields all command lines and the expected content. `{before}` is the file that the case before wrote."""
    yield from conversions()
    yield from chains()


def run(program, case, folder, number, before):
    out = folder / f"{number}.{case.suffix}"
    places = {"{out}": out, "{before}": before}
    harness.run([program, *(places.get(word, word) for word in case.arguments)])
    return out


def describe(case):
    return " ".join(str(Path(word).name) if isinstance(word, Path) else word for word in case.arguments)


def results(program, folder):
    """Yields every case with the found content, or the error that prevented it."""
    before = None
    for number, case in enumerate(cases()):
        try:
            before = run(program, case, folder, number, before)
            yield case, read(before), None
        except Exception as error:  # whatever a reader throws is a finding
            yield case, None, error


def check(program, folder):
    rows, count = [], 0
    for case, found, error in results(program, folder):
        count += 1
        wrong = [("error", "", error)] if error else complaints(case, found)
        rows += [(describe(case), case.suffix, *row) for row in wrong]
    harness.print_rows(rows)
    print(f"{count} files, {len(rows)} complaints")
    return not rows and count > 0


def falsify(case):
    """Yields (what, case) for every way in which an expectation can be false."""

    def expecting(**changes):
        return dataclasses.replace(case, expected=dataclasses.replace(case.expected, **changes))

    solid = case.expected
    yield "volume", expecting(volume=solid.volume * (1 + 1e-4))
    yield "volume of the mirror image", expecting(volume=-solid.volume)
    yield "volume that is no number", expecting(volume=float("nan"))
    yield "area", expecting(area=solid.area * (1 + 1e-4))
    yield "box", expecting(bounds=solid.bounds * (1 + 1e-4))
    yield "triangles", expecting(triangles=solid.triangles + 1)
    yield "watertight", expecting(watertight=False)
    yield "winding", expecting(winding=False)
    yield "unit", expecting(unit="ft" if solid.unit != "ft" else "mm")


def damaged(path):
    """Returns the file with a triangle turned or lost, where a byte or a line can do that."""
    bytes_ = bytearray(path.read_bytes())
    if path.suffix == ".ply":
        # The last triangle names its last two corners in reverse order.
        bytes_[-8:] = bytes_[-4:] + bytes_[-8:-4]
    elif path.suffix == ".stl":
        count = struct.unpack_from("<I", bytes_, 80)[0]
        struct.pack_into("<I", bytes_, 80, count - 1)
        del bytes_[-50:]
    elif path.suffix in (".obj", ".off"):
        lines = bytes_.decode().splitlines()
        word, a, b, c = lines[-1].split()
        lines[-1] = f"{word} {a} {c} {b}"
        bytes_ = "\n".join(lines).encode()
    else:
        # The last bytes of a GLB are a coordinate, here of 1 m, and those of a package belong to its directory.
        bytes_[-4:] = b"\x00\x00\x80\x3f"
    path.write_bytes(bytes_)


def complaints_about_damage(case, path):
    """Returns the complaints about a damaged file, or the error of a reader that refuses it."""
    try:
        return complaints(case, read(path))
    except Exception as error:  # a reader that refuses the file has noticed
        return [error]


def self_test(program, folder):
    told, seen = harness.Falsehoods(), set()
    for case, found, error in results(program, folder):
        name = f"{case.suffix}, {describe(case)}"
        if not told.accept(name, [error] if error else complaints(case, found)) or case.suffix in seen:
            continue
        seen.add(case.suffix)
        for what, false in falsify(case):
            told.expect(f"{name}: {what}", complaints(false, found))
        path = run(program, case, folder, f"damaged-{case.suffix}", None)
        damaged(path)
        told.expect(f"{name}: damage", complaints_about_damage(case, path))
    for suffix in FORMATS:
        told.expect(f"{suffix}: never written", suffix in seen)
    return told.report()


def main():
    given = harness.parser(__doc__, self_test="falsify expectations and see that it shows").parse_args()
    with tempfile.TemporaryDirectory() as folder:
        test = self_test if given.self_test else check
        harness.leave(test(given.program, Path(folder)))


if __name__ == "__main__":
    main()
