#!/usr/bin/env bash
# Runs every test and says at the end which passed.
# usage: tests/run.sh [STAGE …]    of fmt clippy docs test no-gpu corpus python python-package reference files browser peers; all
#                             by default; or of quick, which repeats the fastest part of fmt, clippy and test
# corpus and the last five run after the others, two at a time.
#
# A stage that cannot run has failed. All stages run, so that one run tells everything; only where what they need is
# missing and cannot be installed does none run, and the stage that has failed is `install`. As root, what is missing is
# installed; anyone else is told what to install. The corpus of real meshes is not part of the repository: it is the folder
# $LDI_CORPUS, or ../shared/corpus, and without it the summary says so.
set -euo pipefail

cd "$(dirname "$0")/.."
stages=(fmt clippy docs test no-gpu corpus python python-package reference files browser peers)
# Two of these run at a time, after all others: they call what is built, and leave processors idle in between.
in_pairs=(corpus python-package reference files browser peers)
# Stages that repeat parts of others, run only by name.
repeats=(quick)

# Functions report failure by status, each command by its own: `||` after their call switches off `set -e` inside them.

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
# The library and its tests also with the formats of its default, and the library with none.
run_clippy() {
  cargo clippy --workspace --all-targets -- -D warnings && cargo clippy --package ldi-ops --lib --tests -- -D warnings &&
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
# The twins take turns at the device and leave a processor idle, so that all other tests run beside them.
run_test() (
  tests=(cargo test --profile checked --workspace --no-fail-fast)
  "${tests[@]}" --no-run || exit
  twins=
  trap 'stop "$twins"' EXIT
  trap 'exit 130' INT TERM
  in_background "${tests[@]}" --test twins &>"$logs/twins"
  twins=$!
  # Cargo cannot leave out one test, and to name the others selects what plain `cargo test` does not compile.
  others='[[ ${0##*/} == twins-* ]] && echo "twins: run beside these" || exec "$0" "$@"'
  status=0
  "${tests[@]}" --config "target.'cfg(all())'.runner=['bash','-c','$others']" || status=$?
  wait "$twins" || status=$?
  cat "$logs/twins"
  exit "$status"
)
# Without the feature `gpu`: lints, and tests of the commands that choose a device. All other tests call the same code in both
# builds. These are not long enough to gain from a library that is optimised in full.
run_no-gpu() {
  cargo clippy --workspace --all-targets --no-default-features -- -D warnings &&
    cargo test --profile checked --config profile.checked.package.ldi-ops.opt-level=1 --workspace --no-default-features --no-fail-fast --test cli -- \
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
  run_python && build_program && check_by outputs.py --program "$program" --corpus "$corpus" &&
    check_by exact_volumes.py --program "$program" --bench "$bench" --corpus "$corpus"
}

# The installation in the background, and the second of this run at which it ends at the latest.
installer=
INSTALLED_BY=900
is_installing() { [ -n "$installer" ] && kill -0 "$installer" 2>/dev/null; }

# Starts a command in the background, as a process group of its own.
in_background() {
  set -m
  "$@" </dev/null &
  set +m
}
# Stops a group that runs.
stop() { [ -z "$1" ] || ! kill -0 "$1" 2>/dev/null || kill -- "-$1" 2>/dev/null || true; }

# What an interrupted run left half made is made anew.
has_python=
run_python() {
  [ -z "$has_python" ] || return 0
  # Two installations at once would spoil the folder.
  while is_installing && [ $SECONDS -lt $INSTALLED_BY ]; do sleep 1; done
  stop "$installer"
  .venv/bin/python -m pip --version &>/dev/null || python3 -m venv --clear .venv || return
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement tests/requirements.txt
}
# Each may be the only stage asked for. The self-test of a check shows that it notices falsehoods.
run_reference() {
  run_python && run_twice live_manifold.py && run_twice live_sums.py &&
    build_program && run_twice offsets.py --program "$program" &&
    run_twice exact_volumes.py --program "$program" --bench "$bench" &&
    check_by clashes.py --program "$program" --self-test &&
    check_by estimates.py --program "$program" --cases 200 --self-test
}
check_by() { .venv/bin/python "tests/reference/$1" "${@:2}"; }
# Runs a check and its self-test, the second also where the first fails.
run_twice() {
  local status=0
  check_by "$@" || status=$?
  check_by "$@" --self-test && return "$status"
}
# Pages in a browser: reports on one solid, on several and on two beside each other, a clash, a sweep. The limits are kept, so that all exit with 0.
run_browser() {
  build_program && install_browser || return
  local pages
  pages=$(mktemp -d)
  make_pages "$pages" &&
    node tests/browser/self_test.mjs &&
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
  run_python && build_program && check_by live_numpy.py "$program" && check_by live_numpy.py --self-test &&
    check_by reread.py --program "$program" --self-test && run_twice outputs.py --program "$program" &&
    run_twice sum_outputs.py --program "$program" && run_twice docs.py --program "$program"
}
# Metrics of voxel arrays, by programs that take some minutes to install.
run_metrics_python() {
  run_python &&
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement tests/requirements-metrics.txt
}
run_peers() {
  run_metrics_python && build_program && check_by metrics_peers.py --program "$bench" --quick &&
    check_by metrics_peers.py --program "$bench" --self-test
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
program=${CARGO_TARGET_DIR:-target}/checked/ldi-ops
# With the tests, whose features the dependencies are built with already.
build_program() { cargo build --profile checked --workspace --bins --tests; }
bench=${CARGO_TARGET_DIR:-target}/checked/ldi-bench

if [ $# = 0 ]; then set -- "${stages[@]}"; fi
for stage in "$@"; do
  [[ " ${stages[*]} ${repeats[*]} " == *" $stage "* ]] ||
    { echo "no stage '$stage'; there are: ${stages[*]} ${repeats[*]}" >&2; exit 2; }
done

corpus=$(find_corpus)
passed=0 failed=0 summary="" missing="" ends=""
logs=$(mktemp -d)
other=
trap 'stop "$installer"; stop "$other"; rm -rf "$logs"' EXIT
# What was printed by stages that have not ended is kept.
trap 'trap - EXIT; stop "$installer"; stop "$other"; echo "stopped; stages printed to $logs"; exit 130' INT TERM
if ! install_missing "$@"; then
  printf -v summary '%-14s %s\n' install 'FAILED; no other stage was run'
  failed=1
  set --
fi
# The peers take minutes to fetch, in which the first stages compile. The stage `peers` installs them again and reports failures.
if [[ " $* " == *" peers "* ]]; then
  in_background run_metrics_python &>/dev/null
  installer=$!
fi

# Runs a stage, and leaves its verdict beside its log.
run_stage() {
  local start=$SECONDS verdict=passed
  "run_$1" || verdict=FAILED
  echo "$verdict $((SECONDS - start)) s" >"$logs/$1.verdict"
}
# Adds a stage that has run to the summary.
count() {
  local verdict
  verdict=$(cat "$logs/$1.verdict" 2>/dev/null) || verdict="FAILED; it was stopped"
  if [[ $verdict == passed* ]]; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    # Again at the end, where it is seen.
    ends+=$'\n\n'"=== the end of $1"$'\n'$(last_words "$logs/$1" 2>/dev/null || true)
  fi
  printf -v summary '%s%-14s %s\n' "$summary" "$1" "$verdict"
}
last_words() { grep -E 'FAILED|panicked|^error' "$1" | tail -n 20; tail -n 20 "$1"; }
run_printed() {
  printf '\n=== %s\n' "$1"
  # The verdict is in its file, also where this fails.
  run_stage "$1" 2>&1 | tee "$logs/$1" || true
}
# Runs the stages that no other process has begun, and prints each when it has ended.
run_rest() {
  local stage
  for stage in "$@"; do
    mkdir "$logs/$stage.begun" 2>/dev/null || continue
    run_stage "$stage" &>"$logs/$stage"
    printf '\n=== %s\n' "$stage"
    cat "$logs/$stage"
  done
}

paired=()
for stage in "$@"; do
  if [ "$stage" = corpus ] && [ -z "$corpus" ] && [ -z "${LDI_CORPUS:-}" ]; then
    missing="NOT RUN: corpus folder not found; real meshes were NOT tested (set LDI_CORPUS)"
    printf '\n=== %s\n%s\n' "$stage" "$missing"
    printf -v summary '%s%-14s %s\n' "$summary" "$stage" "$missing"
  elif [[ " ${in_pairs[*]} " == *" $stage "* ]]; then
    paired+=("$stage")
  else
    run_printed "$stage"
    count "$stage"
  fi
done
# Two installations at once would spoil the folder: what the paired stages need of it is installed before. Where that fails, they
# run one after another, and say so themselves.
prepare() {
  case " $* " in
  *" peers "*) run_metrics_python ;;
  *" corpus "* | *" reference "* | *" files "*) run_python ;;
  esac
}
if [ ${#paired[@]} -gt 1 ] && prepare "${paired[@]}"; then
  has_python=yes
  printf '\n=== two at a time: %s\n' "${paired[*]}"
  in_background run_rest "${paired[@]}"
  other=$!
  (trap 'exit 130' INT TERM && run_rest "${paired[@]}") || true
  wait "$other" || true
else
  for stage in ${paired[@]+"${paired[@]}"}; do run_printed "$stage"; done
fi
for stage in ${paired[@]+"${paired[@]}"}; do count "$stage"; done

printf '%s\n\n=== summary\n%s' "$ends" "$summary"
[ -z "$missing" ] || echo "$missing"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
