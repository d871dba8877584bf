"""The accessor `mesh.ldi` of PyVista meshes: `mesh.ldi.intersect(other)`. PyVista imports this module at its first use."""

from __future__ import annotations

from typing import Any

import pyvista

from ._interop import to_pyvista
from ._load import load
from ._native import Shape, Solid, Volume


@pyvista.register_dataset_accessor("ldi", pyvista.PolyData)
class Accessor:
    """Operations on a closed PyVista mesh; results are PyVista meshes."""

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh

    def solid(self, unit: str | None = None) -> Solid:
        """The mesh as a solid of ldi_ops."""
        return load(self._mesh, unit=unit)

    def volume(self, **settings: Any) -> Volume:
        """The volume."""
        return self.solid().volume(**settings)

    def intersect(self, other: Any, **settings: Any) -> Any:
        """The points in both meshes."""
        a, b = self._beside(other)
        return _mesh(a & b, settings)

    def union(self, other: Any, **settings: Any) -> Any:
        """The points in either mesh."""
        a, b = self._beside(other)
        return _mesh(a | b, settings)

    def difference(self, other: Any, **settings: Any) -> Any:
        """The points in this mesh and not in the other."""
        a, b = self._beside(other)
        return _mesh(a - b, settings)

    def minkowski(self, other: Any, **settings: Any) -> Any:
        """The Minkowski sum."""
        a, b = self._beside(other)
        return _mesh(a.minkowski(b), settings)

    def _beside(self, other: Any) -> tuple[Solid, Shape]:
        """Returns this mesh, in the unit of the other, and the other."""
        other = other if isinstance(other, Shape) else load(other)
        return self.solid(other.unit if isinstance(other, Solid) else None), other

    def offset(self, distance: float, **settings: Any) -> Any:
        """All points within a distance, or with a negative distance those that far inside."""
        return _mesh(self.solid().offset(distance), settings)


def _mesh(shape: Shape, settings: dict[str, Any]) -> Any:
    return to_pyvista(*shape.mesh(**settings))
