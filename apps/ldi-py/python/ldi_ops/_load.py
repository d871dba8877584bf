"""Solids from files, arrays and meshes of other libraries."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from typing import Any

from ._errors import UsageError
from ._native import Solid, unit_symbol


def load(source: Any, unit: str | None = None, name: str | None = None, *, tolerance: float = 0.01) -> Solid:
    """Returns the solid of a closed mesh.

    `source` is a path (.stl, .obj, .ply, .off, .gltf, .glb, .3mf; images .npz), a pair of vertices (n, 3) and faces (m, 3), a
    `trimesh.Trimesh`, a `pyvista.PolyData`, a `meshio.Mesh`, an Open3D mesh, or a shape with a method `tessellate`, as those
    of CadQuery and build123d. `tolerance` is the greatest distance of the triangles from such a shape, in its unit.

    `unit` is the unit of the coordinates: mm, um, cm, m, in or ft. Coordinates do not change; a file that states another unit
    keeps that, with a warning. `name` is for messages and reports.

    Raises `NotClosed` for a mesh that is not closed, with the places of its defects.
    """
    if isinstance(source, Solid):
        solid = source
    elif isinstance(source, (str, os.PathLike)):
        solid = Solid.open(source)
    else:
        vertices, faces, own = _arrays(source, tolerance)
        solid = Solid.from_arrays(vertices, faces)
        if own is not None:
            try:
                solid = solid.with_unit(own)
            except UsageError:
                if unit is None:
                    warnings.warn(f"the unit {own!r} of the mesh is not known; pass unit=", stacklevel=2)
    if unit is not None:
        solid = solid.with_unit(unit)
        if solid.unit != unit_symbol(unit):
            warnings.warn(f"{solid.name} states the unit {solid.unit}, so unit={unit!r} is ignored", stacklevel=2)
    return solid if name is None else solid.named(name)


def from_voxels(
    voxels: Any,
    spacing: float | Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    unit: str | None = None,
    name: str | None = None,
) -> Solid:
    """Returns the solid of the voxels that are inside: a CT stack after its threshold.

    `voxels` is an array [x, y, z] of bool, or of numbers that are 0 outside and above 0 inside; a stack of slices that is indexed [z, y, x] is
    transposed by `voxels.T`. `spacing` is the distance of neighbouring centres, one for all axes or one each, and `origin` the
    centre of voxel (0, 0, 0). The solid is the union of the voxels as boxes, so that its volume is exact and its surface has
    steps.
    """
    import numpy as np

    inside = np.asarray(voxels)
    if inside.ndim != 3:
        raise UsageError(f"voxels have three axes, [x, y, z], not {inside.ndim}")
    if inside.dtype not in (np.bool_, np.uint8):
        # Not a number is not at least 0, either.
        if not (inside >= 0).all():
            raise UsageError("voxels are 0 outside and above 0 inside; compare the values with a threshold: array > threshold")
        inside = inside > 0
    if not inside.any():
        raise UsageError("no voxel is inside")
    steps, place = _three("spacing", spacing), _three("origin", origin)
    solid = Solid.from_voxels(np.ascontiguousarray(inside).view(np.uint8), steps, place)
    if unit is not None:
        solid = solid.with_unit(unit)
    return solid if name is None else solid.named(name)


def _three(name: str, value: Any) -> list[float]:
    """Returns a number for each axis."""
    import numpy as np

    numbers = np.asarray(value, dtype=float)
    if numbers.shape not in ((), (3,)) or (name == "origin" and not numbers.shape):
        raise UsageError(f"{name}={value}: three numbers are needed, for x, y and z")
    return [float(number) for number in np.broadcast_to(numbers, 3)]


def restore(vertices: Any, faces: Any, name: str, unit: str | None) -> Solid:
    """Returns a solid that was pickled."""
    solid = Solid.from_arrays(vertices, faces.astype("int64")).named(name)
    return solid if unit is None else solid.with_unit(unit)


def _arrays(source: Any, tolerance: float) -> tuple[Any, Any, str | None]:
    """Returns vertices, faces and the unit of a mesh."""
    import numpy as np

    own = None
    if isinstance(source, (tuple, list)) and len(source) == 2:
        vertices, faces = source
    elif hasattr(source, "points") and hasattr(source, "faces") and hasattr(source, "triangulate"):
        triangles = source.triangulate()
        vertices, faces = triangles.points, np.asarray(triangles.faces).reshape(-1, 4)[:, 1:]
    elif hasattr(source, "tessellate"):
        # build123d's shapes have methods `vertices` and `faces`, too.
        vertices, faces = _tessellated([source], tolerance)
    elif hasattr(source, "vals"):
        vertices, faces = _tessellated(source.vals(), tolerance)
    elif hasattr(source, "vertices") and hasattr(source, "faces"):
        # trimesh; its unit is None, or a word.
        vertices, faces, own = source.vertices, source.faces, getattr(source, "units", None)
    elif hasattr(source, "vertices") and hasattr(source, "triangles"):
        vertices, faces = source.vertices, source.triangles
    elif hasattr(source, "points") and hasattr(source, "cells_dict"):
        vertices, faces = source.points, _faces_of_cells(source.cells_dict)
    else:
        raise UsageError(
            f"{type(source).__name__} is not a surface mesh: give a path, (vertices, faces), a mesh of trimesh, PyVista (PolyData), "
            "meshio or Open3D, a shape of CadQuery or build123d, or voxels to from_voxels"
        )
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    faces = np.asarray(faces)
    if faces.size and not np.issubdtype(faces.dtype, np.integer):
        raise UsageError(f"faces are indices of vertices, not {faces.dtype}")
    if vertices.ndim != 2 or faces.ndim != 2:
        raise UsageError(f"vertices have the shape (n, 3), and faces (m, 3), not {vertices.shape} and {faces.shape}")
    return vertices, np.ascontiguousarray(faces, dtype=np.int64), own


def _tessellated(shapes: Any, tolerance: float) -> tuple[Any, Any]:
    """Returns the triangles of all shapes of a CAD library."""
    vertices: list[Any] = []
    faces: list[Any] = []
    for shape in shapes:
        points, triangles = shape.tessellate(tolerance)
        faces += [[len(vertices) + corner for corner in triangle] for triangle in triangles]
        vertices += [_coordinates(point) for point in points]
    return vertices, faces


def _faces_of_cells(cells: Any) -> Any:
    """Returns the triangles of a meshio mesh; quadrilaterals are cut."""
    import numpy as np

    other = sorted(map(str, set(cells) - {"triangle", "quad", "line", "vertex"}))
    if other:
        raise UsageError(f"the mesh has cells that are no faces: {', '.join(other)}; give the surface of it")
    parts = [np.asarray(cells[kind]) for kind in ("triangle",) if kind in cells]
    if "quad" in cells:
        quads = np.asarray(cells["quad"])
        parts += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    return np.concatenate(parts) if parts else np.empty((0, 3), np.int64)


def _coordinates(vertex: Any) -> Any:
    """Returns the coordinates of a vector of a CAD library."""
    if hasattr(vertex, "toTuple"):
        return vertex.toTuple()
    if hasattr(vertex, "to_tuple"):
        return vertex.to_tuple()
    if hasattr(vertex, "X"):
        return vertex.X, vertex.Y, vertex.Z
    return tuple(vertex)
