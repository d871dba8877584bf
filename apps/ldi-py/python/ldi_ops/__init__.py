"""Solid modelling on layered depth images: Booleans, Minkowski sums, offsets, volumes, scaffold metrics and clash.

>>> import ldi_ops as ldi
>>> ring = ldi.torus(major=10, minor=3, around=96, across=48)
>>> print(ring.volume())
1770.195 mm³ (exact)

`load` takes files, arrays and meshes of other libraries, and there is a function for each model solid, such as `gyroid`. The
operators & | - ^ and the methods of `Shape` combine solids; nothing is computed until a result is asked for. `options` sets
threads, memory and progress. All lengths are in the unit of the solids, which `load` can state.
"""

from collections.abc import Mapping as _Mapping

from . import _solids
from ._clash import clash
from ._errors import Cancelled, Error, InputError, MachineError, NotClosed, UsageError
from ._load import from_voxels, load
from ._native import VERSION as __version__
from ._native import Clashes, Image, Metric, Metrics, Shape, Solid, Volume
from ._options import options
from ._settings import MetricsSettings, Settings
from ._sweep import read_sweep, sweep

_Mapping.register(Metrics)
globals().update(_solids.FUNCTIONS)

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
    *_solids.FUNCTIONS,
]
