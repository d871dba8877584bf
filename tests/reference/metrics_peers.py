#!/usr/bin/env python3
"""Compares metrics of voxel arrays with PoreSpy, localthickness, edt, scikit-image and scipy on the same arrays.

usage: metrics_peers.py --program LDI-BENCH [--quick | --self-test] [--speed] [--threads N] [--json FILE]

Writes arrays (minimal surfaces, balls, struts, blobs), has `ldi-bench metrics` measure them, and gives the peers the same arrays,
solid and pores alike, so that only the voxel algorithms are compared. Compared are

- counts, which must be equal: voxels and porosity (PoreSpy), sizes of components with 26 and with 6 neighbours (scipy),
  Euler characteristics of either (scikit-image), pores that are open (PoreSpy), and chords along each axis by length, those
  that end at the border counted and left out (PoreSpy);
- distances: within a pitch of edt's at every voxel, less half a pitch, as edt measures to the middles of voxels of the other
  phase and the library to the faces between;
- local thickness: the mean within a pitch of PoreSpy's with all radii that the distance has ("all radii"), which the definition
  asks for. The table also shows, without a limit, PoreSpy's default, which rounds radii down to whole numbers ("whole radii"),
  and localthickness, whose balls are polyhedra that grow too large;
- balls, whose local thickness is their diameter everywhere: the program measures them from the crossings of rays with their
  meshes, the peers from the voxels of the same raster, which hold less information. The program's value is within a pitch of the
  diameter; the peers' values are shown without a limit;
- access, the size of the largest ball that reaches a pore from outside: mean within a pitch of PoreSpy's `porosimetry`, again
  with all radii, where PoreSpy's own are whole numbers;
- tortuosity of diffusion: within 1 % of PoreSpy's `tortuosity_fd`, and infinite where the phase does not percolate.

With `--speed`, gyroids of 256³ are timed on as many threads as the peers have: local thickness must be ten times as fast as
PoreSpy's with radii that are not whole numbers (`method="legacy"`; the table also shows PoreSpy's default), and distances faster
than edt's, which is given `uint8`, as it takes two to four times as long with `bool`. Times on a machine with other work mean
nothing.

Prints a table in Markdown, and exits 1 where anything differs. `--self-test` falsifies every result, one by one, and gives the
program arrays other than the peers'; it exits 1 unless the comparison finds every difference.
"""

import collections
import dataclasses
import json
import math
import os
import re
import statistics
import sys
import tempfile
import time
import warnings
from importlib.metadata import version
from pathlib import Path

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
if "--threads" in sys.argv[:-1]:
    THREADS = int(sys.argv[sys.argv.index("--threads") + 1])
# numba and the libraries below numpy read these when they are loaded.
for variable in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = str(THREADS)
warnings.filterwarnings("ignore")

import edt  # noqa: E402
import harness  # noqa: E402
import localthickness  # noqa: E402
import numpy as np  # noqa: E402
import porespy  # noqa: E402
import scipy.ndimage  # noqa: E402
import skimage.measure  # noqa: E402

porespy.settings.tqdm["disable"] = True
porespy.settings.ncores = THREADS
# PoreSpy warns of pores that do not percolate.
porespy.settings.loglevel = 50

AXES = "xyz"
PHASES = ("solid", "pore")
# The neighbourhood across faces, edges and corners.
ALL_NEIGHBOURS = np.ones((3, 3, 3))

# In pitches.
PITCH = 1.0
# No limit: the value is only shown.
ANY = math.inf
TORTUOSITY_SHARE = 0.01
THICKNESS_SPEED = 10.0
DISTANCE_SPEED = 1.0


# Arrays: True where solid. They are indexed x, y, z.


def places(shape, period):
    """Returns the places of the voxels' middles, in periods."""
    sides = [(np.arange(n) + 0.5) / period for n in shape]
    return np.meshgrid(*sides, indexing="ij", sparse=True)


def gyroid(shape, period, level, is_sheet):
    x, y, z = (2 * np.pi * side for side in places(shape, period))
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return np.abs(f) < level if is_sheet else f < level


def ball(radius):
    """Returns a ball about the middle of an array of an even number of voxels, with two layers of pore around it."""
    middle = np.arange(2 * radius + 4) - (2 * radius + 3) / 2
    x, y, z = np.meshgrid(middle, middle, middle, indexing="ij", sparse=True)
    return x * x + y * y + z * z < radius * radius


def struts(shape, period, radius):
    """Returns orthogonal round struts through the middle of each cell."""
    x, y, z = (side - np.floor(side) - 0.5 for side in places(shape, period))
    least = np.minimum(np.minimum(x * x + y * y, y * y + z * z), z * z + x * x)
    return least < (radius / period) ** 2


def plates(shape, thickness):
    """Returns plates across z, as thick as the gaps between them; a cut through all but the last plate leaves dead ends."""
    is_solid = np.zeros(shape, dtype=bool)
    for start in range(thickness, shape[2], 2 * thickness):
        is_solid[:, :, start : start + thickness] = True
    is_solid[3:7, :, : shape[2] - 2 * thickness] = False
    return is_solid


def balls(shape, radius, count):
    """Returns balls at random places, which overlap."""
    random = np.random.default_rng(6)
    is_solid = np.zeros(shape, dtype=bool)
    grid = np.meshgrid(*map(np.arange, shape), indexing="ij", sparse=True)
    for middle in random.random((count, 3)) * shape:
        is_solid |= sum((side - at) ** 2 for side, at in zip(grid, middle, strict=True)) < radius**2
    return is_solid


def blobs(shape, width, share):
    """Returns a level set of smoothed noise, with small parts and bubbles."""
    noise = scipy.ndimage.gaussian_filter(np.random.default_rng(7).random(shape), width)
    return noise < np.quantile(noise, share)


def crumbs(shape, share):
    """Returns noise: components that touch at edges and corners, and thousands of holes and cavities."""
    return np.random.default_rng(8).random(shape) < share


@dataclasses.dataclass(frozen=True)
class Model:
    """An array with its name, and the metrics to compare besides those of every array."""

    name: str
    is_solid: np.ndarray
    # The radius of a ball, in pitches.
    radius: float | None = None
    # The axes along which the pores' diffusion is compared.
    diffusion: str = ""
    has_balls: bool = True


def models(scale):
    """Returns the arrays; their sides differ, so that an exchange of axes is found."""

    def shape(*sides):
        return tuple(scale * side for side in sides)

    cell = 24 * scale
    return [
        Model("gyroid sheet", gyroid(shape(48, 40, 44), cell, 0.45, True), diffusion="x"),
        Model("gyroid network", gyroid(shape(40, 48, 36), cell, -0.2, False), diffusion="yz"),
        Model("struts", struts(shape(48, 24, 36), cell, 0.15 * cell), diffusion="y"),
        # Nothing percolates along z.
        Model("plates", plates(shape(24, 20, 28), 4 * scale), diffusion="xz"),
        Model("balls", balls(shape(40, 36, 48), 6 * scale, 60), diffusion="z"),
        Model("blobs", blobs(shape(48, 36, 40), 2.0 * scale, 0.35), diffusion="xyz"),
        Model("crumbs", crumbs(shape(20, 16, 24), 0.3), has_balls=False),
        *(Model(f"ball, R/h = {radius}", ball(radius), radius=radius) for radius in (4, 8, 24)),
    ]


# Answers of the peers


@dataclasses.dataclass(frozen=True)
class Answer:
    """The answer of one program, and its time."""

    value: object
    seconds: float


def asked(function, *arguments, rounds=1, **keywords):
    """Returns the answer of a function, and the median time of the rounds."""
    seconds = []
    for _ in range(rounds):
        start = time.perf_counter()
        value = function(*arguments, **keywords)
        seconds.append(time.perf_counter() - start)
    return Answer(value, statistics.median(seconds))


def sizes_of_components(is_in, structure):
    labels, _ = scipy.ndimage.label(is_in, structure)
    return np.sort(np.bincount(labels.ravel())[1:])[::-1].tolist()


def chords(is_in, axis, is_complete):
    """Counts the chords along an axis by length, with PoreSpy, which numbers them voxel by voxel.

    PoreSpy's trimming drops every chord that touches a face of the array, and also those that run along it. A layer of the other
    phase around the rows keeps the chords that only run along a face.
    """
    layer = [(0, 0) if other == axis else (1, 1) for other in range(3)]
    wide = np.pad(is_in, layer)
    labels = porespy.filters.apply_chords(wide, spacing=0, axis=axis, trim_edges=is_complete, label=True)
    lengths = np.bincount(labels.ravel())[1:]
    return dict(collections.Counter(lengths[lengths > 0].tolist()))


def all_radii(is_in):
    """Returns PoreSpy's local thickness with every radius of the distance."""
    distances = edt.edt(is_in)
    radii = np.unique(distances[is_in])
    return porespy.filters.local_thickness(is_in, dt=distances, method="legacy", sizes=radii)


def entered(pore):
    """Returns the radius of the largest ball that reaches each voxel from outside: PoreSpy's `porosimetry` with every radius of
    the distance. PoreSpy's own call takes whole numbers only, whatever radii are given."""
    distances = edt.edt(pore)
    inlets = porespy.generators.borders(pore.shape, mode="faces")
    sizes = np.zeros(pore.shape)
    for radius in np.unique(distances[pore])[::-1]:
        seeds = porespy.filters.trim_disconnected_voxels(distances >= radius, inlets=inlets)
        if seeds.any():
            sizes[(sizes == 0) & pore & (edt.edt(~seeds) < radius)] = radius
    return sizes


def diffusion(pore, axis):
    """Returns the tortuosity and the share of the array that percolates."""
    if not porespy.metrics.is_percolating(pore, axis=axis):
        return math.inf, 0.0
    found = porespy.simulations.tortuosity_fd(pore, axis)
    return float(found.tortuosity), float(found.effective_porosity)


def warm_up():
    """Runs functions that are compiled at their first call, before anything is timed."""
    small = blobs((12, 12, 12), 1.5, 0.5)
    porespy.filters.local_thickness(small)
    all_radii(small)
    entered(small)
    porespy.filters.porosimetry(small)
    localthickness.local_thickness(small)
    porespy.filters.fill_closed_pores(small)
    chords(small, 0, True)
    diffusion(np.ones((6, 6, 6), dtype=bool), 0)


# Comparison


@dataclasses.dataclass(frozen=True)
class Row:
    """One metric by the program and by a peer; it is right where both are equal, or within `within` of one another."""

    array: str
    metric: str
    peer: str
    ours: Answer
    theirs: Answer
    # None where values have to be equal: counts and lists of them.
    within: float | None = None
    # The largest difference of the two over all slices or voxels.
    off: float = 0.0
    # The exact value, where there is one; the peer's value then has no limit.
    right: float | None = None
    # The speed that the program needs, as a multiple of the peer's.
    faster: float | None = None
    # A remark on the two values.
    note: str = ""

    def is_right(self):
        expected = self.theirs.value if self.right is None else self.right
        if self.ours.value is None:
            is_right = False
        elif self.within is None:
            is_right = type(self.ours.value) is type(expected) and self.ours.value == expected
        elif math.inf in (self.ours.value, expected):
            is_right = self.ours.value == expected
        else:
            is_right = max(abs(self.ours.value - expected), self.off) <= self.within
        return is_right and (self.faster is None or self.theirs.seconds >= self.faster * self.ours.seconds)

    def complaint(self):
        """Returns a complaint, or None."""
        if self.is_right():
            return None
        expected = told(self.theirs.value if self.right is None else self.right)
        allowed = "" if self.within in (None, ANY) else f" ± {self.within:.3g}"
        speed = ""
        if self.faster is not None:
            speed = f", in {self.ours.seconds:.3g} s, not {self.faster:g} times faster than {self.theirs.seconds:.3g} s"
        off = f", off by up to {self.off:.3g}" if self.off else ""
        return f"{self.array}, {self.metric}: {told(self.ours.value)}{off}, where {self.peer} has {expected}{allowed}{speed}"


def told(value):
    """Returns a value in a few characters."""
    if isinstance(value, dict):
        count = sum(value.values())
        return f"{count} of mean {sum(length * n for length, n in value.items()) / max(count, 1):.4f}"
    if isinstance(value, list):
        return f"{len(value)}, largest {max(value, default=0)}"
    if isinstance(value, float):
        return f"{value:.4f}" if math.isfinite(value) else str(value)
    return str(value)


def of_phase(is_solid, phase):
    return is_solid if phase == "solid" else ~is_solid


class Comparison:
    """The program's answer for one array, compared with the peers; appends to `rows`."""

    def __init__(self, model, said, folder):
        self.model, self.said, self.folder = model, said, folder
        self.rows = []

    def ours(self, phase, metric, value, *also):
        """Returns the program's value, its time, and the time of the steps that it rests on."""
        seconds = self.said["phases"][phase]["seconds"]
        return Answer(value, sum(seconds[each] for each in (metric, *also)))

    def add(self, metric, peer, ours, theirs, **rest):
        self.rows.append(Row(self.model.name, metric, peer, ours, theirs, **rest))

    def map_of(self, phase, metric):
        """Reads a value for each voxel, as the program wrote it: x fastest."""
        path = self.folder / f"{Path(self.said['array']).stem}.{phase}.{metric}.f32"
        return np.fromfile(path, dtype="<f4").reshape(self.said["size"], order="F")

    def whole(self):
        is_solid, said = self.model.is_solid, self.said
        self.add("size", "numpy", Answer(said["size"], math.nan), Answer(list(is_solid.shape), math.nan))
        porosity = asked(porespy.metrics.porosity, ~is_solid)
        theirs = Answer(float(porosity.value), porosity.seconds)
        self.add("porosity", "PoreSpy", Answer(said["porosity"], said["seconds"]), theirs)
        for axis, name in enumerate(AXES):
            profile = asked(porespy.metrics.porosity_profile, ~is_solid, axis)
            ours, theirs = np.array(said["profiles"][name]), profile.value.porosity
            off = float(np.abs(ours - theirs).max()) if ours.shape == theirs.shape else math.inf
            theirs = Answer(float(np.mean(theirs)), profile.seconds)
            ours = Answer(float(np.mean(ours)), math.nan)
            self.add(f"porosity profile along {name}", "PoreSpy", ours, theirs, within=1e-12, off=off)

    def topology(self, phase):
        is_in, said = of_phase(self.model.is_solid, phase), self.said["phases"][phase]
        for neighbours, structure, connectivity in ((6, None, 1), (26, ALL_NEIGHBOURS, 3)):
            ours = self.ours(phase, f"components{neighbours}", said[f"components{neighbours}"])
            theirs = asked(sizes_of_components, is_in, structure)
            self.add(f"{phase} components, {neighbours} neighbours", "scipy", ours, theirs)
            euler = asked(skimage.measure.euler_number, is_in, connectivity)
            ours = self.ours(phase, f"euler{neighbours}", said[f"euler{neighbours}"])
            self.add(f"{phase} χ, {neighbours} neighbours", "scikit-image", ours, Answer(int(euler.value), euler.seconds))

    def open_pores(self):
        pore = ~self.model.is_solid
        filled = asked(porespy.filters.fill_closed_pores, pore, "min")
        ours = self.ours("pore", "open", self.said["phases"]["pore"]["open"])
        self.add("open pore voxels", "PoreSpy", ours, Answer(int(filled.value.sum()), filled.seconds))

    def chords(self, phase):
        is_in, said = of_phase(self.model.is_solid, phase), self.said["phases"][phase]
        for axis, name in enumerate(AXES):
            for which, is_complete in (("all", False), ("complete", True)):
                counts = {int(length): count for length, count in said["chords"][name][which].items()}
                seconds = said["seconds"][f"chords-{name}"] + said["seconds"]["images"][axis]
                theirs = asked(chords, is_in, axis, is_complete)
                self.add(f"{phase} chords along {name}, {which}", "PoreSpy", Answer(counts, seconds), theirs)

    def distance(self, phase, rounds=1, **rest):
        is_in = of_phase(self.model.is_solid, phase)
        # edt takes two to four times as long with bool.
        theirs = asked(edt.edt, is_in.astype(np.uint8), rounds=rounds, parallel=THREADS)
        found, expected = self.map_of(phase, "distance")[is_in], theirs.value[is_in] - 0.5
        off = float(np.abs(found - expected).max())
        ours = self.ours(phase, "distance", float(found.mean(dtype=float)))
        mean = Answer(float(expected.mean(dtype=float)), theirs.seconds)
        self.add(f"{phase} distance", "edt", ours, mean, within=PITCH, off=off, note=f"voxels off by up to {off:.2f}", **rest)

    def thickness(self, phase, peers=None, **rest):
        for peer in peers or (WHOLE_RADII, ALL_RADII, "localthickness"):
            within = PITCH if peer == ALL_RADII and not self.model.radius else ANY
            self.of_balls(phase, "thickness", f"{phase} thickness", peer, THICKNESSES[peer], within, **rest)

    def access(self):
        for peer, function in ACCESSES.items():
            self.of_balls("pore", "access", "pore access", peer, function, PITCH if peer == ALL_RADII else ANY)

    def of_balls(self, phase, metric, title, peer, function, within, **rest):
        """Compares the mean diameter with that of a peer's radii, and notes quantiles of the differences of voxels."""
        is_in = of_phase(self.model.is_solid, phase)
        found = self.map_of(phase, metric)[is_in]
        theirs = asked(function, is_in)
        expected = 2.0 * theirs.value[is_in]
        quantiles = " ".join(f"{q:+.2f}" for q in np.quantile(found - expected, (0.05, 0.25, 0.5, 0.75, 0.95)))
        ours, mean = self.ours(phase, metric, float(found.mean(dtype=float)), "field"), float(expected.mean(dtype=float))
        self.add(title, peer, ours, Answer(mean, theirs.seconds), within=within, note=quantiles, **rest)

    def diffusion(self):
        """PoreSpy's tortuosity covers the pores that reach from end to end; their share of the array is compared, too."""
        pore, said = ~self.model.is_solid, self.said["phases"]["pore"]
        for name in self.model.diffusion:
            (tortuosity, share), seconds = dataclasses.astuple(asked(diffusion, pore, AXES.index(name)))
            found = said["diffusion"][name] or {"formation": math.inf, "spanning": 0.0}
            through = f"diffusion-{name}"
            spanning = self.ours("pore", through, found["spanning"])
            self.add(f"pores through along {name}", "PoreSpy", spanning, Answer(share, seconds))
            of_them = self.ours("pore", through, found["formation"] * found["spanning"] if found["spanning"] else math.inf)
            theirs = Answer(tortuosity, seconds)
            self.add(f"diffusion along {name}", "PoreSpy", of_them, theirs, within=TORTUOSITY_SHARE * min(tortuosity, 1e9))

    def everything(self):
        self.whole()
        for phase in PHASES:
            self.topology(phase)
            self.chords(phase)
            self.distance(phase)
            if self.model.has_balls:
                self.thickness(phase)
        self.open_pores()
        if self.model.has_balls and not self.model.radius:
            self.access()
        self.diffusion()
        return self.rows


WHOLE_RADII, ALL_RADII = "PoreSpy, whole radii", "PoreSpy, all radii"
# PoreSpy's default before 3.2: slower, and not limited to whole numbers.
FORMER_RADII = "PoreSpy, 25 radii"
THICKNESSES = {
    WHOLE_RADII: porespy.filters.local_thickness,
    ALL_RADII: all_radii,
    FORMER_RADII: lambda is_in: porespy.filters.local_thickness(is_in, method="legacy"),
    "localthickness": localthickness.local_thickness,
}
ACCESSES = {WHOLE_RADII: porespy.filters.porosimetry, ALL_RADII: entered}


# The program


def measured(program, given, folder, *options):
    """Returns the program's results for arrays, in their order, with maps in the folder."""
    paths = []
    for model in given:
        paths.append(folder / f"{model.name.replace(' ', '-').replace('/', '-').replace(',', '').replace('=', '')}.npy")
        np.save(paths[-1], np.asfortranarray(model.is_solid.astype(np.uint8)))
    words = [program, "metrics", *paths, "--maps", folder, "--threads", THREADS]
    return told_by([*words, *options])["arrays"]


def told_by(words):
    """Runs a command and returns the JSON that it prints."""
    return json.loads(harness.run(words))


def balls_beside(program, given):
    """Compares balls measured from their meshes, by the program, with their voxels on the same raster, by the peers."""
    round_ones = [model for model in given if model.radius]
    radii = ",".join(str(model.radius) for model in round_ones)
    said = told_by([program, "metrics", "--balls", radii, "--threads", THREADS])["balls"]
    rows = []
    for model, each in zip(round_ones, said, strict=True):
        for peer, function in THICKNESSES.items():
            theirs = asked(function, model.is_solid)
            mean = Answer(float(2.0 * theirs.value[model.is_solid].mean(dtype=float)), theirs.seconds)
            ours = Answer(each["thickness"], each["seconds"])
            shares = f"{each['thickness'] / (2 * model.radius):.3f} and {mean.value / (2 * model.radius):.3f} of 2R"
            right = 2.0 * model.radius
            rows.append(Row(model.name, "thickness, from its mesh", peer, ours, mean, PITCH, right=right, note=shares))
    return rows


def compared(program, given):
    """Returns every row of the arrays."""
    with tempfile.TemporaryDirectory() as folder:
        said = measured(program, given, Path(folder))
        comparisons = [Comparison(model, each, Path(folder)) for model, each in zip(given, said, strict=True)]
        rows = [row for comparison in comparisons for row in comparison.everything()]
    return rows + balls_beside(program, given)


def raced(program):
    """Returns the rows that have a limit on speed."""
    n = 256
    given = [
        Model("gyroid sheet 256³", gyroid((n, n, n), n / 4, 0.45, True)),
        Model("gyroid network 256³", gyroid((n, n, n), n / 4, 0.0, False)),
    ]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        said = measured(program, given, Path(folder), "--only", "distance,thickness,chords", "--rounds", 3)
        for model, each in zip(given, said, strict=True):
            comparison = Comparison(model, each, Path(folder))
            for phase in PHASES:
                comparison.distance(phase, rounds=3, faster=DISTANCE_SPEED)
                comparison.thickness(phase, [FORMER_RADII], faster=THICKNESS_SPEED)
                comparison.thickness(phase, [WHOLE_RADII, "localthickness"])
                comparison.chords(phase)
            rows += comparison.rows
    return rows


# Printing


def markdown(heads, rows):
    """Returns a table whose first column is aligned left and whose others are right."""
    cells = [heads, *([str(cell) for cell in row] for row in rows)]
    widths = [max(max(len(row[i]) for row in cells), 2) for i in range(len(heads))]
    lines = [[cell.ljust(widths[0]) if i == 0 else cell.rjust(widths[i]) for i, cell in enumerate(row)] for row in cells]
    rule = "|".join(["-" * (widths[0] + 2), *("-" * (width + 1) + ":" for width in widths[1:])])
    return "\n".join([f"| {' | '.join(lines[0])} |", f"|{rule}|", *(f"| {' | '.join(line)} |" for line in lines[1:])]) + "\n"


def of_counts(rows):
    """Returns a table by counted quantity: the number of comparisons, the number that are equal, and the total times."""
    kinds = collections.defaultdict(list)
    for row in rows:
        kinds[re.sub(" along [xyz]", "", row.metric), row.peer].append(row)
    lines = []
    for (metric, peer), each in kinds.items():
        times = (seconds(sum(column)) for column in zip(*map(times_of, each), strict=True))
        lines.append((metric, peer, len(each), sum(row.is_right() for row in each), *times))
    return markdown(("counted", "peer", "comparisons", "equal", "ldi-ops s", "peer s"), lines)


def times_of(row):
    return row.ours.seconds, row.theirs.seconds


def seconds(value):
    return "–" if math.isnan(value) else f"{value:.3f}"


def of_values(rows):
    """Returns a table with a line for each row."""
    heads = ("array", "metric", "ldi-ops", "peer", "its value", "right", "ldi-ops s", "peer s", "voxels are off by")
    lines = []
    for row in rows:
        right = "" if row.right is None else told(row.right)
        values = told(row.ours.value), row.peer, told(row.theirs.value), right
        lines.append((row.array, row.metric, *values, *map(seconds, times_of(row)), row.note))
    return markdown(heads, lines)


def of_speed(rows):
    """Returns a table of the program's speed relative to the peers."""
    heads = ("array", "metric", "peer", "ldi-ops s", "peer s", "times faster", "at least")
    lines = []
    for row in rows:
        least = "" if row.faster is None else f"{row.faster:g}"
        ratio = f"{row.theirs.seconds / row.ours.seconds:.2f}"
        lines.append((row.array, row.metric, row.peer, *map(seconds, times_of(row)), ratio, least))
    return markdown(heads, lines)


def check(program, given, is_raced, path):
    load = f"{os.getloadavg()[0]:.2f}" if hasattr(os, "getloadavg") else "unknown"
    start = time.monotonic()
    warm_up()
    rows = compared(program, given)
    races = raced(program) if is_raced else []
    counted = [row for row in rows if row.within is None]
    # Slices of one porosity each compare like counts.
    valued = [row for row in rows if row.within is not None and "profile" not in row.metric]
    print(f"### Metrics beside peers\n\nporespy {porespy.__version__}, localthickness {version('localthickness')}, ", end="")
    print(f"edt {version('edt')}, scikit-image {version('scikit-image')}, scipy {version('scipy')}; {THREADS} threads.\n")
    print(f"#### Counts, which are equal\n\n{of_counts(counted)}")
    print(f"#### Values, in pitches\n\n{LEGEND}\n\n{of_values(valued)}")
    if races:
        print(f"#### Speed at 256³, on {THREADS} threads\n\n{of_speed(races)}")
    complaints = [complaint for complaint in map(Row.complaint, rows + races) if complaint]
    for complaint in complaints:
        print(f"- {complaint}")
    print(
        f"{len(rows + races)} comparisons of {len(given)} arrays, {len(complaints)} complaints; load average {load} before; "
        f"{time.monotonic() - start:.0f} s"
    )
    if path:
        every = [dataclasses.asdict(row) for row in rows + races]
        document = json.loads(json.dumps({"threads": THREADS, "load": load, "rows": every}), parse_constant=str)
        path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    return not complaints and len(rows) > 0


LEGEND = (
    "Quantiles at the end, 5, 25, 50, 75 and 95 %, are of the program's value less the peer's, voxel by voxel. What has a "
    "right value is held to that; PoreSpy with whole radii and localthickness are said beside and held to nothing."
)


# Showing that a check can fail


def falsehoods(row):
    """Yields (what, row) for every way in which the program's value can be wrong."""

    def ours(value):
        return dataclasses.replace(row, ours=dataclasses.replace(row.ours, value=value))

    value = row.ours.value
    yield "nothing", ours(None)
    yield "no number", ours(math.nan)
    if isinstance(value, dict):
        length = max(value, default=1)
        shorter = {each: count for each, count in value.items() if each != length}
        yield "a chord more", ours({**value, length: value.get(length, 0) + 1})
        yield "chords that are longer", ours({**shorter, length + 1: value.get(length, 1)})
    elif isinstance(value, list):
        yield "a piece more", ours([*value, 1])
        yield "a piece that is larger", ours([value[0] + 1, *value[1:]] if value else [1])
    elif row.within is None:
        yield "one more", ours(value + 1)
        yield "one less", ours(value - 1)
        yield "next to it", ours(math.nextafter(value, math.inf) if isinstance(value, float) else str(value))
    elif row.within != ANY:
        expected = row.theirs.value if row.right is None else row.right
        for sign in (1, -1):
            yield "another value", ours(expected + sign * 1.01 * row.within if math.isfinite(expected) else 3.0)
        yield "no way through", ours(math.inf if math.isfinite(expected) else 1.0)
        yield "a voxel or a slice that is off", dataclasses.replace(row, off=1.01 * row.within)
    slow = dataclasses.replace(row.ours, seconds=1.01 * row.theirs.seconds)
    yield "one that is slow", dataclasses.replace(row, ours=slow, faster=1.0)


def self_test(program, given):
    """Returns whether the comparison finds every falsehood, also arrays other than the peers', and a program that fails."""
    given = [model for model in given if model.name in ("blobs", "crumbs", "ball, R/h = 8")]
    found = harness.Falsehoods()
    with tempfile.TemporaryDirectory() as folder:
        found.expect_error("a program that fails", lambda: measured(Path(sys.executable), given, Path(folder)))
    rows = compared(program, given)
    found.expect("no row at all", rows)
    for row in rows:
        found.vary(f"{row.array}, {row.metric}", (row,), Row.complaint, falsehoods)
    with tempfile.TemporaryDirectory() as folder:
        blob = next(model for model in given if model.name == "blobs")
        with_one_turned = blob.is_solid.copy()
        with_one_turned[1, 2, 3] ^= True
        others = {
            "axes that are swapped": np.swapaxes(blob.is_solid, 0, 2),
            "an array that is turned over": blob.is_solid[::-1],
            "the other phase": ~blob.is_solid,
            "a voxel of the other phase": with_one_turned,
        }
        for what, is_solid in others.items():
            said = measured(program, [dataclasses.replace(blob, is_solid=is_solid)], Path(folder))
            comparison = Comparison(blob, said[0], Path(folder))
            comparison.whole()
            for phase in PHASES:
                comparison.topology(phase)
                comparison.chords(phase)
            found.expect(what, any(row.complaint() for row in comparison.rows))
    return found.report()


def main():
    parser = harness.parser(__doc__, program="the built ldi-bench")
    parser.add_argument("--quick", action="store_true", help="arrays of a quarter of a million voxels, as tests have them")
    parser.add_argument("--speed", action="store_true", help="hold the program to its speed at 256³, too")
    parser.add_argument("--threads", type=int, help="of the program and of the peers; all by default")
    parser.add_argument("--json", type=Path, help="also write every row to this file")
    options = parser.parse_args()
    given = models(1 if options.quick or options.self_test else 2)
    if options.self_test:
        harness.leave(self_test(options.program, given))
    harness.leave(check(options.program, given, options.speed, options.json))


if __name__ == "__main__":
    main()
