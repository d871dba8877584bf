"""The settings that calls take as keywords."""

from __future__ import annotations

from typing import TypedDict


class Settings(TypedDict, total=False):
    """Keywords of the raster and the images; none is needed. One of the first three sets the raster."""

    resolution: int
    """Rays along the longest side of the common box; 512 by default."""
    pitch: float
    """The distance of neighbouring rays, in the unit of the first solid."""
    tolerance: float
    """The raster is refined until the error estimate is below this share of the volume. Not for sums, offsets and metrics."""
    axes: str
    """'all' (default), 'x', 'y' or 'z'. A surface needs all."""
    mode: str
    """'exact' (default), or 'over' or 'under' for conservative estimates."""
    fill: str
    """'even-odd' (default) or 'non-zero': which winding numbers are inside."""
    backend: str
    """'auto' (default), 'cpu', 'gpu' or 'gpu:NAME'."""
    lod: int
    """Voxels along each ray of over- and under-estimates; 1024 by default."""
    bounds: bool
    """Whether volumes have certified bounds, `lower` and `upper`. Not for a sum or an offset of another operation."""
