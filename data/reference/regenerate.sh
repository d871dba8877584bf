#!/usr/bin/env bash
# Makes data/models, data/reference/minkowski/models and the values of both, *.json, anew.
# usage: data/reference/regenerate.sh LDI_OPS_BINARY   models from `ldi-ops generate`, then the peers' values
#        data/reference/regenerate.sh --keep-models    the peers' values of the models that are there
set -euo pipefail

cd "$(dirname "$0")/../.."
[ $# = 1 ] || { sed -n '2,4s/^# //p' "$0"; exit 2; }

for tool in cmake g++ python3; do
  command -v "$tool" >/dev/null || { echo "missing $tool: apt-get install cmake g++ python3-venv libcgal-dev"; exit 1; }
done
[ -e /usr/include/CGAL/version.h ] || { echo "missing CGAL: apt-get install libcgal-dev"; exit 1; }
[ -x .venv/bin/python ] || python3 -m venv .venv
.venv/bin/python -m pip install --quiet --requirement tests/requirements.txt

if [ "$1" != --keep-models ]; then
  # Old models may not stay where their generation fails.
  rm -f data/models/*
  mkdir -p data/models
  .venv/bin/python - <<'PYTHON' | while IFS=$'\t' read -r arguments path; do
import tomllib
for model in tomllib.load(open("data/reference/pairs.toml", "rb"))["models"].values():
    print(model["generate"], model["path"], sep="\t")
PYTHON
    # shellcheck disable=SC2086  # the arguments are words of a command line
    "$1" generate $arguments -o "$path" </dev/null
  done
  rm -f data/reference/minkowski/models/*
  .venv/bin/python data/reference/minkowski/models.py
fi

cmake -S data/reference/cgal -B target/cgal_reference
cmake --build target/cgal_reference
rm -f data/reference/*.json data/reference/minkowski/*.json
.venv/bin/python data/reference/manifold_reference.py
.venv/bin/python data/reference/cgal_reference.py --program target/cgal_reference/cgal_reference
.venv/bin/python tests/reference/live_manifold.py
.venv/bin/python data/reference/minkowski/manifold_sums.py
.venv/bin/python data/reference/minkowski/cgal_sums.py --program target/cgal_reference/cgal_sum
.venv/bin/python tests/reference/live_sums.py
.venv/bin/python data/reference/struts/struts.py
