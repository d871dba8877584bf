#!/usr/bin/env bash
# Runs every test and says at the end which passed.
# usage: tests/run.sh [STAGE …]    of fmt clippy docs test no-gpu corpus python reference files peers python-package browser
#                             self-test; all by default; or of quick, which repeats the fastest part of fmt, clippy and test
#
# A stage that cannot run has failed. All stages run, so that one run tells everything; only where what they need is
# missing and cannot be installed does none run, and the stage that has failed is `install`. As root, what is missing is
# installed; anyone else is told what to install. The corpus of real meshes is not part of the repository: it is the folder
# $LDI_CORPUS, or ../shared/corpus, and without it the summary says so.
set -euo pipefail

cd "$(dirname "$0")/.."
stages=(fmt clippy docs test no-gpu corpus python reference files peers python-package browser self-test)
# Stages that repeat parts of others, run only by name.
repeats=(quick)

# Functions report failure by status, each command by its own: `if` around their call switches off `set -e` inside them.

# On Linux, what tests of the GPU's sampler reach an adapter by: the loader, and a driver for it to find.
has_vulkan() {
  [ "$(uname)" = Linux ] || return 0
  local libraries
  # Debian keeps ldconfig away from those who are not root.
  libraries=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null) || true
  [[ $libraries == *libvulkan.so.1* ]] || return
  [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] || return 0
  compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null
}

has_chromium() { [ -n "${CHROMIUM:-}" ] || command -v chromium >/dev/null || command -v chromium-browser >/dev/null; }

# Adds to `packages` what the checks need beside the compiler.
add_packages_of_checks() {
  command -v python3 >/dev/null || packages+=(python3)
  # Debian's python3 has the module venv but not what it needs to put pip into it.
  python3 -c 'import ensurepip, venv' 2>/dev/null || packages+=(python3-venv)
  # Mesa's drivers hold a software adapter, which any machine can test with.
  has_vulkan || packages+=(libvulkan1 mesa-vulkan-drivers)
  # What opens the pages of reports.
  has_chromium || packages+=(chromium)
  command -v node >/dev/null || packages+=(nodejs)
  command -v npm >/dev/null || packages+=(npm)
}

# Installs what stages need, of which `quick` needs the compiler alone.
install_missing() {
  local packages=()
  # The linker, and the C in the benchmarks' library.
  command -v cc >/dev/null || packages+=(build-essential)
  [ "$*" = quick ] || add_packages_of_checks
  if [ ${#packages[@]} != 0 ]; then
    local install=(apt-get install -y --no-install-recommends "${packages[@]}")
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
      echo "missing packages; run: sudo ${install[*]}" >&2
      return 1
    fi
    apt-get update -qq || return
    DEBIAN_FRONTEND=noninteractive "${install[@]}" || return
  fi

  command -v cargo >/dev/null || { echo "missing cargo: see https://rustup.rs" >&2; return 1; }
  if ! cargo fmt --version &>/dev/null || ! cargo clippy --version &>/dev/null; then
    local add=(rustup component add rustfmt clippy)
    if [ "$(id -u)" != 0 ] || ! command -v rustup >/dev/null; then
      echo "missing rustfmt or clippy; run: ${add[*]} (or install your distribution's packages of these names)" >&2
      return 1
    fi
    "${add[@]}" || return
  fi
}

run_fmt() { cargo fmt --all -- --check; }
# The library also by itself, with the formats of its default and with none.
run_clippy() {
  cargo clippy --workspace --all-targets -- -D warnings && cargo clippy --package ldi-ops -- -D warnings &&
    cargo clippy --package ldi-ops --no-default-features -- -D warnings
}
# A quick answer on a warm build: each kind of test of the code, and of the slow kinds a few.
run_quick() {
  run_fmt && cargo clippy --workspace --all-targets -- -D warnings &&
    cargo test --profile checked --workspace --lib --test structure &&
    cargo test --profile checked --workspace --test cli -- help:: streams:: operations:: completions:: threads:: &&
    cargo test --profile checked --workspace --test reference
}
run_docs() { RUSTDOCFLAGS=-Dwarnings cargo doc --workspace --no-deps; }
# The checked profile is optimised, which the oracle and the properties need, and panics where an integer overflows.
run_test() { cargo test --profile checked --workspace --no-fail-fast; }
# Without the feature `gpu`: lints, and tests of the commands that choose a device. All other tests call the same code in both
# builds.
run_no-gpu() {
  cargo clippy --workspace --all-targets --no-default-features -- -D warnings &&
    cargo test --profile checked --workspace --no-default-features --no-fail-fast --test cli -- \
      devices:: help:: operations:: sums:: threads::
}

find_corpus() {
  local folder=${LDI_CORPUS:-../shared/corpus}
  if [ -d "$folder" ]; then (cd "$folder" && pwd); fi
}

# --tests leaves out the documentation's examples, of which `ignore` means another thing.
run_corpus() {
  [ -n "$corpus" ] || { echo "LDI_CORPUS is no folder: $LDI_CORPUS"; return 1; }
  local log
  log=$(mktemp)
  LDI_CORPUS=$corpus cargo test --profile checked --workspace --no-fail-fast --tests -- --ignored | tee "$log" ||
    { rm "$log"; return 1; }
  local ran
  ran=$(grep -cE '^running [1-9]' "$log") || true
  rm "$log"
  [ "$ran" != 0 ] || { echo "no corpus test ran"; return 1; }
  run_python && build_program && .venv/bin/python tests/reference/outputs.py --program "$program" --corpus "$corpus" &&
    .venv/bin/python tests/reference/exact_volumes.py --program "$program" --bench "$bench" --corpus "$corpus"
}

# The installation in the background, as a process group, and the second of this run at which it ends at the latest.
installer=
INSTALLED_BY=900
is_installing() { [ -n "$installer" ] && kill -0 "$installer" 2>/dev/null; }
stop_installing() { ! is_installing || kill -- "-$installer" 2>/dev/null || true; }

# What an interrupted run left half made is made anew.
run_python() {
  # Two installations at once would spoil the folder.
  while is_installing && [ $SECONDS -lt $INSTALLED_BY ]; do sleep 1; done
  stop_installing
  .venv/bin/python -m pip --version &>/dev/null || python3 -m venv --clear .venv || return
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement tests/requirements.txt
}
# Each may be the only stage asked for.
run_reference() {
  run_python && .venv/bin/python tests/reference/live_manifold.py && .venv/bin/python tests/reference/live_sums.py &&
    build_program && .venv/bin/python tests/reference/offsets.py --program "$program" &&
    .venv/bin/python tests/reference/exact_volumes.py --program "$program" --bench "$bench" &&
    .venv/bin/python tests/reference/clashes.py --program "$program" &&
    .venv/bin/python tests/reference/estimates.py --program "$program" --cases 200
}
# Pages in a browser: reports on one solid, on several and on two beside each other, a clash, a sweep. The limits are kept, so that all exit with 0.
run_browser() {
  build_program && install_browser || return
  local pages
  pages=$(mktemp -d)
  make_pages "$pages" &&
    node tests/browser/check.mjs report="$pages/one/report.html" report="$pages/roi/report.html" report="$pages/hull/report.html" \
      summary="$pages/many/index.html" comparison="$pages/two/compare.html" clash="$pages/clash/clash.html" \
      sweep="$pages/sweep/index.html"
  local status=$?
  rm -r "$pages"
  return "$status"
}
install_browser() { npm ci --silent --no-audit --no-fund --prefix tests/browser; }
make_pages() {
  local models=data/models report=("$program" report --unit mm --quiet --resolution 64)
  "${report[@]}" "$models/gyroid_sheet.stl" --limits data/limits.toml -o "$1/one" >/dev/null &&
    "${report[@]}" "$models/gyroid_sheet.stl" --roi "$models/bone.stl" -o "$1/roi" >/dev/null &&
    "${report[@]}" "$models/bone.stl" --roi hull -o "$1/hull" >/dev/null &&
    "${report[@]}" "$models/bcc_lattice.stl" "$models/sphere.stl" "$models/primitive_sheet.stl" -o "$1/many" >/dev/null &&
    "${report[@]}" "$models/cubic_lattice.stl" --compare "$models/bcc_lattice.stl" -o "$1/two" >/dev/null &&
    "$program" sweep data/sweep.toml --quiet -o "$1/sweep" >/dev/null &&
    make_clash_page "$1/clash"
}
# A page with findings, so that its command exits with 1.
make_clash_page() {
  local models=data/models status=0
  "$program" clash "$models/gyroid_sheet.stl" "$models/bone.stl" "$models/sphere.stl" "$models/bcc_lattice.stl" \
    --unit mm --clearance 1mm --quiet -o "$1" >/dev/null || status=$?
  [ "$status" -eq 1 ]
}
# Files that are written, read by others; and the commands of README.md and docs/.
run_files() {
  run_python && build_program && .venv/bin/python tests/reference/live_numpy.py "$program" &&
    .venv/bin/python tests/reference/reread.py --program "$program" &&
    .venv/bin/python tests/reference/outputs.py --program "$program" &&
    .venv/bin/python tests/reference/sum_outputs.py --program "$program" &&
    .venv/bin/python tests/reference/docs.py --program "$program"
}
# Metrics of voxel arrays, by programs that take some minutes to install.
run_metrics_python() {
  run_python &&
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement tests/requirements-metrics.txt
}
run_peers() {
  run_metrics_python && build_bench && .venv/bin/python tests/reference/metrics_peers.py --program "$bench" --quick &&
    .venv/bin/python tests/reference/metrics_peers.py --program "$bench" --self-test
}
# The wheel of the Python package in a fresh environment: its tests, the programs of its guide, and the console script beside the
# program of the same profile.
run_python-package() {
  local folder=${CARGO_TARGET_DIR:-target}/python-package
  rm -rf "$folder" && build_program && python3 -m venv "$folder/venv" || return
  local python=$folder/venv/bin/python
  "$python" -m pip install --quiet --disable-pip-version-check --requirement tests/requirements-python-package.txt &&
    "$folder/venv/bin/maturin" build --profile checked --manifest-path apps/ldi-py/Cargo.toml --out "$folder/wheels" 2>&1 |
      tee "$folder/build.log" && shares_the_library "$folder/build.log" &&
    "$python" -m pip install --quiet --disable-pip-version-check --no-deps "$folder"/wheels/ldi_ops-*.whl &&
    LDI_OPS_PROGRAM=$(realpath "$program") "$python" -m pytest --quiet -p no:cacheprovider --durations=10 tests/python
}
# Fails if cargo, by its log, compiled the library again for the wheel, which takes as long as for the tests.
shares_the_library() {
  ! grep 'Compiling ldi-ops v' "$1" ||
    { echo "the wheel compiled the library a second time: in apps/ldi-py/Cargo.toml, give its dependencies the features" \
      "that the tests of the workspace give them (cargo tree --workspace --edges features)" >&2; return 1; }
}
run_self-test() {
  run_python && .venv/bin/python tests/reference/live_manifold.py --self-test &&
    .venv/bin/python tests/reference/live_sums.py --self-test &&
    .venv/bin/python tests/reference/live_numpy.py --self-test &&
    build_program && .venv/bin/python tests/reference/reread.py --program "$program" --self-test &&
    .venv/bin/python tests/reference/offsets.py --program "$program" --self-test &&
    .venv/bin/python tests/reference/exact_volumes.py --program "$program" --bench "$bench" --self-test &&
    .venv/bin/python tests/reference/clashes.py --program "$program" --parts 40 --self-test &&
    .venv/bin/python tests/reference/estimates.py --program "$program" --cases 60 --self-test &&
    .venv/bin/python tests/reference/outputs.py --program "$program" --self-test &&
    .venv/bin/python tests/reference/sum_outputs.py --program "$program" --self-test &&
    .venv/bin/python tests/reference/docs.py --program "$program" --self-test &&
    install_browser && node tests/browser/self_test.mjs
}
program=${CARGO_TARGET_DIR:-target}/checked/ldi-ops
# With the tests, whose features the dependencies are built with already.
build_program() { cargo build --profile checked --workspace --bins --tests; }
bench=${CARGO_TARGET_DIR:-target}/checked/ldi-bench
build_bench() { build_program; }

if [ $# = 0 ]; then set -- "${stages[@]}"; fi
for stage in "$@"; do
  [[ " ${stages[*]} ${repeats[*]} " == *" $stage "* ]] ||
    { echo "no stage '$stage'; there are: ${stages[*]} ${repeats[*]}" >&2; exit 2; }
done

corpus=$(find_corpus)
passed=0 failed=0 summary="" missing="" ends=""
log=$(mktemp)
trap 'stop_installing; rm -f "$log"' EXIT
if ! install_missing "$@"; then
  printf -v summary '%-14s %s\n' install 'FAILED; no other stage was run'
  failed=1
  set --
fi
# The peers take minutes to fetch, in which the first stages compile. The stage `peers` installs them again and reports failures.
if [[ " $* " == *" peers "* ]]; then
  set -m
  run_metrics_python &>/dev/null </dev/null &
  installer=$!
  set +m
fi
for stage in "$@"; do
  printf '\n=== %s\n' "$stage"
  if [ "$stage" = corpus ] && [ -z "$corpus" ] && [ -z "${LDI_CORPUS:-}" ]; then
    verdict="NOT RUN: corpus folder not found; real meshes were NOT tested (set LDI_CORPUS)"
    missing=$verdict
    echo "$verdict"
  else
    start=$SECONDS
    if "run_$stage" 2>&1 | tee "$log"; then
      verdict=passed passed=$((passed + 1))
    else
      verdict=FAILED failed=$((failed + 1))
      # Again at the end, where it is seen.
      ends+=$'\n\n'"=== the end of $stage"$'\n'$(grep -E 'FAILED|panicked|^error' "$log" | tail -n 20; tail -n 20 "$log")
    fi
    verdict+=" $((SECONDS - start)) s"
  fi
  printf -v summary '%s%-14s %s\n' "$summary" "$stage" "$verdict"
done

printf '%s\n\n=== summary\n%s' "$ends" "$summary"
[ -z "$missing" ] || echo "$missing"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
