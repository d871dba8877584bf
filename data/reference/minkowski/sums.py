"""The sums and differences of `sums.toml` as exact triangle meshes, and the JSON files that hold what the peers say of them."""

import dataclasses
import json
import sys
import tomllib
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))
import models  # noqa: E402
import pairs  # noqa: E402

OPERATIONS = ("sum", "difference")
# Who computes a result, and how; the README says what each does.
WAYS = {"nef": "CGAL", "pieces": "manifold3d", "boundary": "manifold3d", "own": "manifold3d"}


@dataclasses.dataclass(frozen=True)
class Case:
    """A ⊕ B or A ⊖ B, with the paths of A and B from the root, and the ways it is computed in."""

    name: str
    operation: str
    a: str
    b: str
    why: str
    ways: tuple
    transform_b: str | None = None
    # Whether it takes manifold3d no more than a few seconds.
    quick: bool = True

    def pair(self):
        """As `pairs` has it."""
        return {"name": self.name, "a": self.a, "b": self.b, "transform_b": self.transform_b, "why": self.why}

    def meshes(self):
        """(points, triangles) of A and of B as placed."""
        return pairs.meshes(self.pair())

    def pieces(self, side):
        """The points of each convex piece of A or of B as placed."""
        path = Path({"a": self.a, "b": self.b}[side])
        if path.stem not in models.MODELS:
            raise SystemExit(f"{self.name}: the convex pieces of {path} are not known")
        solid = models.MODELS[path.stem]()
        if not same_triangles((solid.points, solid.triangles), pairs.read(pairs.ROOT / path)):
            raise SystemExit(f"{path} is not what models.py makes")
        if side == "b" and self.transform_b:
            return [pairs.transform(piece, self.transform_b) for piece in solid.pieces]
        return solid.pieces


def same_triangles(one, other):
    """Whether two meshes have the same triangles, in whatever order of points and triangles."""

    def rows(mesh):
        points, triangles = mesh
        corners = points[triangles] + 0.0
        return sorted(min(np.roll(t, -k, axis=0).tolist() for k in range(3)) for t in corners)

    return rows(one) == rows(other)


def load(names=None):
    """The cases of sums.toml, all or those of these names."""
    others = tomllib.loads((FOLDER.parent / "pairs.toml").read_text())["models"]
    cases = []
    for entry in tomllib.loads((FOLDER / "sums.toml").read_text())["case"]:
        paths = {side: path_of(entry[side], others) for side in "ab"}
        case = Case(**{**entry, **paths, "ways": tuple(entry["ways"])})
        if case.operation not in OPERATIONS or not set(case.ways) <= WAYS.keys():
            raise SystemExit(f"sums.toml, {case.name}: no such operation or way")
        cases.append(case)
    missing = set(names or ()) - {case.name for case in cases}
    if missing:
        raise SystemExit(f"sums.toml has no case {', '.join(sorted(missing))}")
    return [case for case in cases if not names or case.name in names]


def path_of(name, others):
    """A model of models.py, or one of pairs.toml."""
    if name in models.MODELS:
        path = str((models.FOLDER / f"{name}.obj").relative_to(pairs.ROOT))
    elif name in others:
        path = others[name]["path"]
    else:
        raise SystemExit(f"sums.toml: no model {name}")
    if not (pairs.ROOT / path).is_file():
        raise SystemExit(f"{path} is missing: data/reference/regenerate.sh makes it")
    return path


def result_path(name):
    return FOLDER / f"{name}.json"


def write_result(case, result):
    """Replaces what was said before in the same way; what anyone said of other inputs than these goes too."""
    path = result_path(case.name)
    inputs = pairs.inputs(case.pair())
    document = {"case": case.name, "operation": case.operation, "why": case.why, "inputs": inputs, "results": []}
    if path.exists():
        old = json.loads(path.read_text())
        if all(old[key] == document[key] for key in ("operation", "inputs")):
            document["results"] = [r for r in old["results"] if r["way"] != result["way"]]
    document["results"].append(result)
    document["results"].sort(key=lambda r: list(WAYS).index(r["way"]))
    path.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n")
