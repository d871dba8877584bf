#!/usr/bin/env python3
"""Checks that manifold3d still gives the values that data/reference holds.

Computes every pair anew and compares with the committed values. Exits 1, with a table of what differs, where a value is
off by more than 1e-9 of the pinned one, an input file is not the one the values were made from, the pinned values of
manifold3d and CGAL disagree, or a pair has no values. `--self-test` falsifies the committed values in each of these
ways and exits 1 unless every falsehood is noticed.
"""

import copy
import json
import sys
from pathlib import Path

import harness

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "reference"))
import manifold_reference  # noqa: E402
import pairs  # noqa: E402

TOLERANCE = 1e-9


def same(found, pinned, scale):
    """Compares two values; refusals must be equal. `scale`, the volume of A, replaces a value that is mere rounding."""
    if isinstance(found, dict) or isinstance(pinned, dict):
        return found == pinned
    reference = abs(pinned) if abs(pinned) > TOLERANCE * scale else scale
    return abs(found - pinned) <= TOLERANCE * reference


def complaints(pair, document, live):
    """Returns the faults of one pair's document as (name, pinned, found); `live` holds the values that manifold3d gives now."""
    if document is None:
        return [("file", "missing", "")]
    if document["inputs"] != pairs.inputs(pair):
        return [("inputs", document["inputs"], pairs.inputs(pair))]
    results = {result["tool"]: result for result in document["results"]}
    rows = [(tool, "missing", "") for tool in ("manifold3d", "CGAL") if tool not in results]
    if rows:
        return rows
    pinned, exact = results["manifold3d"], results["CGAL"]
    if live["version"] != pinned["version"]:
        rows.append(("version", pinned["version"], live["version"]))
    scale = live["volume_a"]
    for name in pairs.VALUES:
        if not same(live[name], pinned[name], scale):
            rows.append((name, pinned[name], live[name]))
        # A refusal of one peer does not contradict a value of the other.
        if not isinstance(exact[name], dict) and not same(pinned[name], exact[name], scale):
            rows.append((f"{name}, CGAL", exact[name], pinned[name]))
    return rows


def read_documents():
    return {path.stem: json.loads(path.read_text()) for path in Path(pairs.__file__).parent.glob("*.json")}


def print_table(rows):
    print(f"{'pair':24}{'value':22}{'pinned':26}found")
    for pair, name, pinned, found in rows:
        print(f"{pair:24}{name:22}{pinned!s:26}{found}")


def check():
    every, documents = pairs.load(), read_documents()
    rows = [(name, "pair", "has values", "not in pairs.toml") for name in documents.keys() - {p["name"] for p in every}]
    for pair in every:
        document = documents.get(pair["name"])
        live = manifold_reference.result(pair) if document else None
        rows += [(pair["name"], *row) for row in complaints(pair, document, live)]
    if rows:
        print_table(rows)
    print(f"{len(every)} pairs, {len(rows)} complaints")
    return not rows


def falsify(document):
    """Yields (what, document) for every way in which a document can be false."""
    yield "missing document", None
    false = copy.deepcopy(document)
    false["inputs"][0]["sha256"] = "0" * 64
    yield "other input", false
    for result in document["results"]:
        false = copy.deepcopy(document)
        false["results"].remove(result)
        yield f"no {result['tool']}", false
    for tool in range(len(document["results"])):
        for name in pairs.VALUES:
            false = copy.deepcopy(document)
            false["results"][tool][name] *= 1 + 2 * TOLERANCE
            yield f"{name} of {document['results'][tool]['tool']} off by 2e-9", false
            false = copy.deepcopy(document)
            false["results"][tool][name] = float("nan")
            yield f"{name} of {document['results'][tool]['tool']} not a number", false


def self_test():
    pair = pairs.load(names=["spheres"])[0]
    document = read_documents()["spheres"]
    live = manifold_reference.result(pair)
    found = harness.Falsehoods()
    found.vary(pair["name"], (document,), lambda pinned: complaints(pair, pinned, live), falsify)
    return found.report()


def main():
    parser = harness.parser(__doc__, self_test="falsify the pinned values and see that it shows", program=None)
    harness.leave(self_test() if parser.parse_args().self_test else check())


if __name__ == "__main__":
    main()
