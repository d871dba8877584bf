"""The pairs of `pairs.toml` as exact triangle meshes, and the JSON files that hold what the peers say of them."""

import hashlib
import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
OPERATIONS = ("intersection", "union", "difference")
VALUES = (*OPERATIONS, "volume_a", "volume_b")


def load(root=ROOT, names=None):
    """The pairs, each {"name", "a", "b", "transform_b", "why"} with `a` and `b` as paths from the root."""
    table = tomllib.loads((Path(__file__).parent / "pairs.toml").read_text())
    pairs = []
    for pair in table["pair"]:
        if names and pair["name"] not in names:
            continue
        paths = {side: table["models"][pair[side]]["path"] for side in "ab"}
        pairs.append({"transform_b": None, **pair, **paths})
    missing = set(names or ()) - {pair["name"] for pair in pairs}
    if missing:
        raise SystemExit(f"pairs.toml has no pair {', '.join(sorted(missing))}")
    for path in {pair[side] for pair in pairs for side in "ab"}:
        if not (Path(root) / path).is_file():
            raise SystemExit(f"{path} is missing: data/reference/regenerate.sh LDI_OPS_BINARY makes it")
    return pairs


def meshes(pair, root=ROOT):
    """(points, triangles) of A and of B as placed: f64 and int64."""
    a, b = (read(Path(root) / pair[side]) for side in "ab")
    if pair["transform_b"]:
        b = (transform(b[0], pair["transform_b"]), b[1])
    return a, b


def inputs(pair, root=ROOT):
    """What a reader needs to know that it has the same files."""
    rows = []
    for side in "ab":
        path = Path(root) / pair[side]
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        row = {"path": pair[side], "sha256": digest, "triangles": len(read(path)[1])}
        if side == "b" and pair["transform_b"]:
            row["transform"] = pair["transform_b"]
        rows.append(row)
    return rows


def read(path):
    """Points and triangles of a binary STL or an OBJ file. Only equal coordinates become one point."""
    if path.suffix == ".stl":
        raw = path.read_bytes()
        count = int.from_bytes(raw[80:84], "little")
        if len(raw) != 84 + 50 * count:
            raise SystemExit(f"{path}: not a binary STL file")
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(raw, record, count, 84)["corners"].reshape(-1, 3).astype(np.float64)
        triangles = np.arange(3 * count).reshape(-1, 3)
    elif path.suffix == ".obj":
        rows = [line.split() for line in path.read_text().splitlines()]
        corners = np.array([row[1:4] for row in rows if row[:1] == ["v"]], dtype=np.float64)
        faces = [[int(word.split("/")[0]) - 1 for word in row[1:]] for row in rows if row[:1] == ["f"]]
        triangles = np.array([(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)])
    else:
        raise SystemExit(f"{path}: neither .stl nor .obj")
    # Adding zero turns −0 into +0, which are equal but not the same bytes.
    points, index = np.unique(corners + 0.0, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[triangles]
    a, b, c = triangles.T
    return points, triangles[(a != b) & (b != c) & (c != a)]


def transform(points, text):
    """A placement as the command line has it: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', the leftmost first."""
    steps = re.findall(r"(\w+)\(([^)]*)\)", text)
    if "".join(f"{name}({numbers})" for name, numbers in steps) != text.replace(" ", ""):
        raise SystemExit(f"cannot read the transform '{text}'")
    for name, numbers in steps:
        values = [float(x) for x in numbers.split(",")]
        if name == "translate" and len(values) == 3:
            points = points + values
        elif name == "scale" and len(values) == 1:
            points = points * values[0]
        elif name == "rotate" and len(values) == 4:
            points = points @ rotation(values[:3], math.radians(values[3])).T
        else:
            raise SystemExit(f"cannot read the transform '{text}'")
    return points


def rotation(axis, angle):
    """Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def result_path(name):
    return Path(__file__).parent / f"{name}.json"


def write_result(pair, result, root=ROOT):
    """Replaces what the same tool said before; what any tool said of other inputs than these goes too."""
    path = result_path(pair["name"])
    document = {"pair": pair["name"], "why": pair["why"], "inputs": inputs(pair, root), "results": []}
    if path.exists():
        old = json.loads(path.read_text())
        if old["inputs"] == document["inputs"]:
            document["results"] = [r for r in old["results"] if r["tool"] != result["tool"]]
    document["results"].append(result)
    document["results"].sort(key=lambda r: r["tool"])
    path.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n")
