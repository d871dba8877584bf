"""Reads 3MF packages by lib3mf in strict mode."""

import dataclasses

import lib3mf
import numpy as np

# lib3mf numbers units in this order.
UNITS = ("um", "mm", "cm", "in", "ft", "m")


@dataclasses.dataclass(frozen=True)
class Package:
    """The one object of a package: points in f64, triangles, unit, and whether lib3mf takes it for manifold and oriented."""

    points: np.ndarray
    faces: np.ndarray
    unit: str
    is_manifold: bool


def read(path):
    """Returns the content of a package; raises ValueError unless it has one valid object, one item, and no warning."""
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    warnings = [reader.GetWarning(index) for index in range(reader.GetWarningCount())]
    if warnings:
        raise ValueError(f"lib3mf warns: {warnings}")
    items, objects = model.GetBuildItems(), model.GetMeshObjects()
    if (items.Count(), objects.Count()) != (1, 1):
        raise ValueError(f"{items.Count()} items and {objects.Count()} objects")
    objects.MoveNext()
    mesh = objects.GetCurrentMeshObject()
    if not mesh.IsValid():
        raise ValueError("lib3mf calls the object invalid")
    points = np.array([tuple(vertex.Coordinates) for vertex in mesh.GetVertices()], dtype=np.float64)
    faces = np.array([tuple(triangle.Indices) for triangle in mesh.GetTriangleIndices()], dtype=np.int64)
    return Package(points, faces, UNITS[int(model.GetUnit())], mesh.IsManifoldAndOriented())
