#!/usr/bin/env python3
"""Checks that manifold3d still gives the values that data/reference/minkowski holds of Minkowski sums and differences.

Computes every quick case anew, in every way of manifold3d, and compares with the committed values. Exits 1, with a table of
what differs, where a number is off by more than 1e-9 of the pinned one, an input file is not the one the values were made
from, the pinned values of two ways disagree, or a case has no values. `--all` takes the slow cases as well. `--self-test`
falsifies the committed values in each of these ways and exits 1 unless every falsehood is noticed.
"""

import copy
import json
import sys
from pathlib import Path

import harness

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "reference" / "minkowski"))
import manifold_sums  # noqa: E402
import sums  # noqa: E402

TOLERANCE = 1e-9


def same(found, pinned):
    """Compares numbers within the tolerance of the largest pinned one, all else exactly; the coordinates of a box share one
    size."""
    if isinstance(pinned, float | int) and isinstance(found, float | int):
        return abs(found - pinned) <= TOLERANCE * abs(pinned)
    if isinstance(pinned, list) and isinstance(found, list):
        flat = [[x for corner in box for x in corner] for box in (found, pinned)]
        size = max(map(abs, flat[1]))
        return all(abs(x - y) <= TOLERANCE * size for x, y in zip(*flat, strict=True))
    return found == pinned


def complaints(case, document, live):
    """Returns the faults of a case's document as (name, pinned, found); `live` holds the values that manifold3d gives now, by
    way."""
    if document is None:
        return [("file", "missing", "")]
    inputs = sums.pairs.inputs(case.pair())
    if (document["operation"], document["inputs"]) != (case.operation, inputs):
        return [("inputs", document["inputs"], inputs)]
    results = {result["way"]: result for result in document["results"]}
    if results.keys() != set(case.ways):
        return [("ways", sorted(results), sorted(case.ways))]
    rows = []
    for way, found in live.items():
        # These include the way, the tool and its version.
        for name in found.keys() | results[way].keys():
            if not same(found.get(name), results[way].get(name)):
                rows.append((f"{name}, {way}", results[way].get(name), found.get(name)))
    first = results[case.ways[0]]
    for way in case.ways[1:]:
        for name in ("volume", *manifold_sums.SHAPE):
            # Some ways give only some values, and a refusal of one way does not contradict a value of another.
            values = [result.get(name) for result in (first, results[way])]
            if not any(value is None or isinstance(value, dict) for value in values) and not same(*values[::-1]):
                rows.append((f"{name}, {way} and {case.ways[0]}", *values))
    return rows


def documents():
    return {path.stem: json.loads(path.read_text()) for path in sums.FOLDER.glob("*.json")}


def live_results(case):
    return {way: manifold_sums.result(case, way) for way in case.ways if way in manifold_sums.WAYS}


def check(slow):
    every, pinned = sums.load(), documents()
    rows = [(name, "case", "has values", "not in sums.toml") for name in pinned.keys() - {case.name for case in every}]
    computed = 0
    for case in every:
        # The pinned values of a slow case are still compared with each other.
        live = live_results(case) if case.quick or slow else {}
        computed += len(live)
        rows += [(case.name, *row) for row in complaints(case, pinned.get(case.name), live)]
    for name, what, expected, found in rows:
        print(f"{name:24}{what:28}{expected!s:26}{found}")
    print(f"{len(every)} sums and differences, {computed} computed anew, {len(rows)} complaints")
    return not rows and computed > 0


def falsify(document):
    """Yields (what, document) for every way in which a document can be false."""
    yield "missing document", None
    false = copy.deepcopy(document)
    false["inputs"][0]["sha256"] = "0" * 64
    yield "other input", false
    yield "other operation", document | {"operation": "union"}
    for i, result in enumerate(document["results"]):

        def falsified(**values):
            false = copy.deepcopy(document)
            false["results"][i] |= values
            return false

        false = copy.deepcopy(document)
        del false["results"][i]
        yield f"no {result['way']}", false
        for name in ("volume", "area"):
            if name in result:
                yield f"{name}, {result['way']}, off by 2e-9", falsified(**{name: result[name] * (1 + 2 * TOLERANCE)})
                yield f"{name}, {result['way']}, not a number", falsified(**{name: float("nan")})
        if "box" in result:
            low, high = result["box"]
            yield f"box, {result['way']}", falsified(box=[low, [x + 1e-6 for x in high]])
            yield f"cavities, {result['way']}", falsified(cavities=result["cavities"] + 1)
            yield f"components, {result['way']}", falsified(components=result["components"] + 1)


def self_test():
    [case] = sums.load(["hollow_cube_cube"])
    document, live = documents()[case.name], live_results(case)
    found = harness.Falsehoods()
    found.vary(case.name, (document,), lambda pinned: complaints(case, pinned, live), falsify)
    return found.report()


def main():
    parser = harness.parser(__doc__, self_test="falsify the pinned values and see that it shows", program=None)
    parser.add_argument("--all", action="store_true", help="the slow cases, too: minutes")
    given = parser.parse_args()
    harness.leave(self_test() if given.self_test else check(given.all))


if __name__ == "__main__":
    main()
