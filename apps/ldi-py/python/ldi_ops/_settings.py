"""The settings that calls take as keywords."""

from __future__ import annotations

from typing import TypedDict


class Settings(TypedDict, total=False):
    """Keywords of the raster and the images. None is needed; one of the first three sets the raster.

    resolution: rays along the longest side of the common box; 512 by default.
    pitch: the distance of neighbouring rays, in the unit of the first solid.
    tolerance: the raster is refined until the error estimate is below this share of the volume; not for metrics.
    axes: 'all' (default), 'x', 'y' or 'z': the directions of the rays. A mesh and metrics need all.
    mode: 'exact' (default), or 'over' or 'under' for images that contain the solid or lie in it.
    fill: 'even-odd' (default) or 'nonzero': which winding numbers are inside, where shells overlap.
    backend: 'auto' (default), 'cpu', 'gpu', or 'gpu:NAME' for the adapter whose name contains NAME.
    lod: voxels along each ray of the modes 'over' and 'under'; 1024 by default.
    bounds: True for certified bounds of volumes, `lower` and `upper`; other results ignore it.
    """

    resolution: int
    pitch: float
    tolerance: float
    axes: str
    mode: str
    fill: str
    backend: str
    lod: int
    bounds: bool


class MetricsSettings(Settings, total=False):
    """Keywords of metrics, beside those of the raster.

    edges: 'border' (default): the faces of the region are walls to balls and paths; 'clip': they end nothing; 'periodic': what
        leaves at one face of a box enters at the opposite one.
    tortuosity_resolution: rays along the longest side of the raster that diffusion is solved on; 128 by default.
    build: the direction that is up in the printer: 'x', 'y', 'z' (default), '-x', '-y' or '-z'.
    overhang_angle: degrees from the horizontal below which a facet overhangs; 45 by default.
    """

    edges: str
    tortuosity_resolution: int
    build: str
    overhang_angle: float
