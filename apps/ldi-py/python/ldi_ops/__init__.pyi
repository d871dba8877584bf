# Written by apps/ldi-py/stubs.py.
from collections.abc import Sequence

from ._clash import clash as clash
from ._errors import Cancelled as Cancelled
from ._errors import Error as Error
from ._errors import InputError as InputError
from ._errors import MachineError as MachineError
from ._errors import NotClosed as NotClosed
from ._errors import UsageError as UsageError
from ._load import from_voxels as from_voxels
from ._load import load as load
from ._native import Clashes as Clashes
from ._native import Image as Image
from ._native import Metric as Metric
from ._native import Metrics as Metrics
from ._native import Shape as Shape
from ._native import Solid as Solid
from ._native import Volume as Volume
from ._options import options as options
from ._settings import MetricsSettings as MetricsSettings
from ._settings import Settings as Settings
from ._sweep import read_sweep as read_sweep
from ._sweep import sweep as sweep

__version__: str

def cuboid(
    *,
    min: float | Sequence[float] = (-10, -10, -10),
    max: float | Sequence[float] = (10, 10, 10),
) -> Solid: ...
def ell(
    *,
    size: float | Sequence[float] = (1, 1, 1),
    notch: float | Sequence[float] = (0.5, 0.5),
) -> Solid: ...
def hollow_box(
    *,
    size: float | Sequence[float] = (20, 20, 20),
    hollow: float | Sequence[float] = (10, 10, 10),
) -> Solid: ...
def sphere(
    *,
    radius: float | Sequence[float] = 10,
    segments: float | Sequence[float] = 64,
) -> Solid: ...
def geodesic(
    *,
    radius: float | Sequence[float] = 10,
    frequency: float | Sequence[float] = 16,
) -> Solid: ...
def geodesic_frame(
    *,
    radius: float | Sequence[float] = 10,
    frequency: float | Sequence[float] = 6,
    window: float | Sequence[float] = 0.8,
    depth: float | Sequence[float] = 0.5,
) -> Solid: ...
def star(
    *,
    radius: float | Sequence[float] = 10,
    valley: float | Sequence[float] = 4,
    frequency: float | Sequence[float] = 1,
) -> Solid: ...
def torus(
    *,
    major: float | Sequence[float] = 10,
    minor: float | Sequence[float] = 3,
    around: float | Sequence[float] = 96,
    across: float | Sequence[float] = 32,
) -> Solid: ...
def cylinder(
    *,
    radius: float | Sequence[float] = 10,
    height: float | Sequence[float] = 20,
    segments: float | Sequence[float] = 64,
) -> Solid: ...
def hyperboloid(
    *,
    waist: float | Sequence[float] = 5,
    rim: float | Sequence[float] = 10,
    height: float | Sequence[float] = 20,
    segments: float | Sequence[float] = 64,
    zones: float | Sequence[float] = 32,
) -> Solid: ...
def hyperboloid_frame(
    *,
    waist: float | Sequence[float] = 5,
    height: float | Sequence[float] = 20,
    bars: float | Sequence[float] = 24,
    crossings: float | Sequence[float] = 8,
    window: float | Sequence[float] = 0.8,
    depth: float | Sequence[float] = 0.4,
) -> Solid: ...
def knot(
    *,
    p: float | Sequence[float] = 2,
    q: float | Sequence[float] = 3,
    major: float | Sequence[float] = 8,
    minor: float | Sequence[float] = 4,
    tube: float | Sequence[float] = 1.6,
    segments: float | Sequence[float] = 60,
    sides: float | Sequence[float] = 8,
) -> Solid: ...
def chain(
    *,
    links: float | Sequence[float] = 5,
    major: float | Sequence[float] = 5,
    minor: float | Sequence[float] = 1,
    around: float | Sequence[float] = 64,
    across: float | Sequence[float] = 24,
) -> Solid: ...
def chain_mail(
    *,
    columns: float | Sequence[float] = 4,
    rows: float | Sequence[float] = 3,
    major: float | Sequence[float] = 5,
    minor: float | Sequence[float] = 1,
    around: float | Sequence[float] = 64,
    across: float | Sequence[float] = 24,
) -> Solid: ...
def weave(
    *,
    yarns: float | Sequence[float] = 8,
    layers: float | Sequence[float] = 1,
    spacing: float | Sequence[float] = 2,
    radius: float | Sequence[float] = 0.3,
    gap: float | Sequence[float] = 0.2,
    segments: float | Sequence[float] = 16,
    steps: float | Sequence[float] = 8,
) -> Solid: ...
def brush(
    *,
    bristles: float | Sequence[float] = 8,
    spacing: float | Sequence[float] = 2,
    radius: float | Sequence[float] = 0.5,
    length: float | Sequence[float] = 8,
    plate: float | Sequence[float] = 1,
    resolution: float | Sequence[float] = 16,
) -> Solid: ...
def gyroid(
    *,
    part: str = 'sheet',
    wall: float | Sequence[float] = 1,
    fraction: float | Sequence[float] = 0.5,
    cells: float | Sequence[float] = 4,
    cell_size: float | Sequence[float] = 10,
    resolution: float | Sequence[float] = 28,
) -> Solid: ...
def primitive(
    *,
    part: str = 'sheet',
    wall: float | Sequence[float] = 1,
    fraction: float | Sequence[float] = 0.5,
    cells: float | Sequence[float] = 4,
    cell_size: float | Sequence[float] = 10,
    resolution: float | Sequence[float] = 28,
) -> Solid: ...
def diamond(
    *,
    part: str = 'sheet',
    wall: float | Sequence[float] = 1,
    fraction: float | Sequence[float] = 0.5,
    cells: float | Sequence[float] = 4,
    cell_size: float | Sequence[float] = 10,
    resolution: float | Sequence[float] = 28,
) -> Solid: ...
def cubic(
    *,
    form: str = 'union',
    radius: float | Sequence[float] = 1,
    cells: float | Sequence[float] = 4,
    cell_size: float | Sequence[float] = 10,
    resolution: float | Sequence[float] = 32,
    segments: float | Sequence[float] = 24,
) -> Solid: ...
def bcc(
    *,
    form: str = 'union',
    radius: float | Sequence[float] = 1,
    cells: float | Sequence[float] = 4,
    cell_size: float | Sequence[float] = 10,
    resolution: float | Sequence[float] = 32,
    segments: float | Sequence[float] = 24,
) -> Solid: ...
def bone(
    *,
    length: float | Sequence[float] = 100,
    girth: float | Sequence[float] = 1,
    bow: float | Sequence[float] = 1,
    resolution: float | Sequence[float] = 200,
) -> Solid: ...
def trabecular(
    *,
    size: float | Sequence[float] = (5, 5, 7),
    spacing: float | Sequence[float] = 1,
    fraction: float | Sequence[float] = 0.35,
    stretch: float | Sequence[float] = 1.5,
    seed: float | Sequence[float] = 1,
    resolution: float | Sequence[float] = 12,
) -> Solid: ...
def organic(
    *,
    size: float | Sequence[float] = 20,
    bumps: float | Sequence[float] = 1,
    resolution: float | Sequence[float] = 65,
) -> Solid: ...
def skull(
    *,
    size: float | Sequence[float] = 20,
    wall: float | Sequence[float] = 0.08,
    resolution: float | Sequence[float] = 38,
) -> Solid: ...

__all__ = [
    "Cancelled",
    "Clashes",
    "Error",
    "Image",
    "InputError",
    "MachineError",
    "Metric",
    "Metrics",
    "MetricsSettings",
    "NotClosed",
    "Settings",
    "Shape",
    "Solid",
    "UsageError",
    "Volume",
    "clash",
    "from_voxels",
    "load",
    "options",
    "read_sweep",
    "sweep",
    "cuboid",
    "ell",
    "hollow_box",
    "sphere",
    "geodesic",
    "geodesic_frame",
    "star",
    "torus",
    "cylinder",
    "hyperboloid",
    "hyperboloid_frame",
    "knot",
    "chain",
    "chain_mail",
    "weave",
    "brush",
    "gyroid",
    "primitive",
    "diamond",
    "cubic",
    "bcc",
    "bone",
    "trabecular",
    "organic",
    "skull",
]
