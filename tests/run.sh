#!/usr/bin/env bash
# Runs every test and says at the end which passed.
# usage: tests/run.sh [STAGE …]    of fmt clippy docs test corpus python reference self-test; all by default
#
# A stage that cannot run has failed. All stages run, so that one run tells everything. The corpus of real meshes is not
# part of the repository: it is the folder $LDI_CORPUS, or ../shared/corpus, and without it the summary says so.
# As root, what is missing is installed; anyone else is told what to install.
set -euo pipefail

cd "$(dirname "$0")/.."
stages=(fmt clippy docs test corpus python reference self-test)

install_missing() {
  local packages=()
  command -v cc >/dev/null || packages+=(build-essential)
  command -v python3 >/dev/null || packages+=(python3)
  # Debian's python3 has the module venv but not what it needs to put pip into it.
  python3 -c 'import ensurepip, venv' 2>/dev/null || packages+=(python3-venv)
  # The GPU's twins run on lavapipe, so that a machine without a GPU compares the same bytes.
  compgen -G '/usr/share/vulkan/icd.d/lvp_icd*.json' >/dev/null || packages+=(mesa-vulkan-drivers)
  compgen -G '/usr/lib*/*/libvulkan.so.1' >/dev/null || packages+=(libvulkan1)
  if [ ${#packages[@]} != 0 ]; then
    local install="apt-get install -y --no-install-recommends ${packages[*]}"
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
      echo "missing packages; run: sudo $install" >&2
      exit 1
    fi
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $install
  fi

  command -v cargo >/dev/null || { echo "missing cargo: see https://rustup.rs" >&2; exit 1; }
  if ! cargo fmt --version &>/dev/null || ! cargo clippy --version &>/dev/null; then
    local add="rustup component add rustfmt clippy"
    if [ "$(id -u)" != 0 ] || ! command -v rustup >/dev/null; then
      echo "missing rustfmt or clippy; run: $add (or install your distribution's packages of these names)" >&2
      exit 1
    fi
    $add
  fi
}

run_fmt() { cargo fmt --all -- --check; }
run_clippy() { cargo clippy --workspace --all-targets -- -D warnings; }
run_docs() { RUSTDOCFLAGS=-Dwarnings cargo doc --workspace --no-deps; }
# The release profile, as the oracle and the properties are slow without it.
run_test() { cargo test --release --workspace --no-fail-fast; }

find_corpus() {
  local folder=${LDI_CORPUS:-../shared/corpus}
  if [ -d "$folder" ]; then (cd "$folder" && pwd); fi
}

# --tests leaves out the documentation's examples, of which `ignore` means another thing.
run_corpus() {
  [ -n "$corpus" ] || { echo "LDI_CORPUS is no folder: $LDI_CORPUS"; return 1; }
  local log
  log=$(mktemp)
  LDI_CORPUS=$corpus cargo test --release --workspace --no-fail-fast --tests -- --ignored | tee "$log" ||
    { rm "$log"; return 1; }
  local ran
  ran=$(grep -cE '^running [1-9]' "$log") || true
  rm "$log"
  [ "$ran" != 0 ] || { echo "no corpus test ran"; return 1; }
}

run_python() {
  if ! [ -x .venv/bin/python ]; then python3 -m venv .venv || return; fi
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement tests/requirements.txt
}
run_reference() { .venv/bin/python tests/reference/live_manifold.py; }
run_self-test() { .venv/bin/python tests/reference/live_manifold.py --self-test; }

if [ $# = 0 ]; then set -- "${stages[@]}"; fi
for stage in "$@"; do
  [[ " ${stages[*]} " == *" $stage "* ]] || { echo "no stage '$stage'; there are: ${stages[*]}" >&2; exit 2; }
done

install_missing
corpus=$(find_corpus)
passed=0 failed=0 summary=""
for stage in "$@"; do
  printf '\n=== %s\n' "$stage"
  if [ "$stage" = corpus ] && [ -z "$corpus" ] && [ -z "${LDI_CORPUS:-}" ]; then
    verdict="NOT RUN: no corpus folder; real meshes were not tested (set LDI_CORPUS)"
    echo "$verdict"
  else
    start=$SECONDS
    # The function's own commands must report failure by status: `if` switches off `set -e` inside it.
    if "run_$stage"; then
      verdict=passed passed=$((passed + 1))
    else
      verdict=FAILED failed=$((failed + 1))
    fi
    verdict+=" $((SECONDS - start)) s"
  fi
  printf -v summary '%s%-10s %s\n' "$summary" "$stage" "$verdict"
done

printf '\n=== summary\n%s' "$summary"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
