#!/usr/bin/env bash
# Measures the sampler and whole commands on a machine with a GPU. Programs are built elsewhere: that machine needs no network
# and no compiler, only the GPU's driver and the Vulkan loader. After 25 minutes no step is begun.
# usage: apps/ldi-bench/gpu-machine.sh pack FOLDER             where the sources are: builds the programs into FOLDER
#        FOLDER/gpu-machine.sh run OUT [ADAPTER]               there: measures, and writes into OUT after each step
#
# ADAPTER is a name as `ldi-ops devices` lists it, or part of one; the first by default. The twins come first: where one differs,
# nothing is measured. A later step that fails or takes too long is noted in OUT/failed, and the others go on.
set -euo pipefail

pack() {
  local folder=$1 here twins
  here=$(cd "$(dirname "$0")/../.." && pwd)
  mkdir -p "$folder/data"
  folder=$(cd "$folder" && pwd)
  cd "$here"
  cargo build --release --workspace --bins
  twins=$(cargo test --release --workspace --test twins --no-run --message-format=json |
    sed -n 's/.*"executable":"\([^"]*twins-[^"]*\)".*/\1/p')
  cp "${CARGO_TARGET_DIR:-target}/release/ldi-ops" "${CARGO_TARGET_DIR:-target}/release/ldi-bench" "$folder"
  cp "$twins" "$folder/twins"
  strip "$folder/ldi-ops" "$folder/ldi-bench" "$folder/twins"
  cp -r data/models "$folder/data"
  cp "$here/apps/ldi-bench/gpu-machine.sh" "$folder"
  git log -1 --format='%H %cI' >"$folder/commit"
  du -ch "$folder"/* | tail -1
}

# Runs a step of at most so many seconds, unless 25 minutes have passed; a failure is noted in OUT/failed.
step() {
  local name=$1 seconds=$2
  shift 2
  printf '%4d s  %s\n' "$SECONDS" "$name" >&3
  if [ "$SECONDS" -ge 1500 ]; then
    echo "$name: not begun" >>"$out/failed"
  else
    timeout "$seconds" "$@" && return
    echo "$name: exit $?" >>"$out/failed"
  fi
  return 1
}

# Prints the JSON of a result but for its device, times and memory.
facts() { grep -vE '"(backend|device|read|sample|operate|integrate|write|total|[a-z_]+_bytes)":' "$1"; }

run() {
  local out adapter=() resolution
  # For the names of steps, whose own output goes into files.
  exec 3>&1
  mkdir -p "$1"
  out=$(cd "$1" && pwd)
  cd "$(dirname "$0")"
  if [ -n "${2:-}" ]; then
    adapter=(--adapter "$2")
    export LDI_ADAPTER=$2
  fi
  rm -f "$out/failed"
  cp commit "$out"
  export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-/tmp}

  ./ldi-ops devices -q --json "$out/devices.json"
  echo "twins, by 64-bit integers and by pairs"
  timeout 600 ./twins >"$out/twins.txt" 2>&1 || { tail -40 "$out/twins.txt"; exit 1; }
  for resolution in 512 1024 2048; do
    step "the sampler at $resolution rays" 300 ./ldi-bench gpu "${adapter[@]}" --resolution "$resolution" \
      --rounds $((7680 / resolution)) --json "$out/gpu-$resolution.json" >"$out/gpu-$resolution.md" || true
  done
  step "the sampler of the processor" 300 ./ldi-bench sampling --runs 5 --json "$out/sampling.json" >"$out/sampling.md" ||
    true
  commands
  echo "done after $SECONDS s: $out"
  if [ -e "$out/failed" ]; then
    cat "$out/failed" >&2
    exit 1
  fi
}

# Runs whole commands on either device, three times each. Times are in the JSON of each; everything else must be the same.
commands() {
  local models round name command
  models=$(mktemp -d)
  local gyroid=$models/gyroid.stl bone=$models/bone.stl bcc=$models/bcc.stl star=$models/star.stl
  ./ldi-ops generate gyroid --part sheet --cells 4,4,4 -q -o "$gyroid" >/dev/null &&
    ./ldi-ops generate bone -q -o "$bone" >/dev/null &&
    ./ldi-ops generate bcc --cells 6,6,6 -q -o "$bcc" >/dev/null &&
    ./ldi-ops generate star -q -o "$star" >/dev/null || { echo "models: exit $?" >>"$out/failed"; return; }
  while read -r name command; do
    for round in 1 2 3; do
      local cpu=$out/$name-cpu-$round.json gpu=$out/$name-gpu-$round.json errors=$out/$name.txt
      # shellcheck disable=SC2086 — the words of a command
      if step "$name on the processor" 120 ./ldi-ops $command --unit mm --backend cpu -q --json "$cpu" >>"$errors" 2>&1 &&
        step "$name on the GPU" 120 ./ldi-ops $command --unit mm --backend gpu "${adapter[@]}" -q --json "$gpu" \
          >>"$errors" 2>&1; then
        diff <(facts "$cpu") <(facts "$gpu") >>"$errors" || echo "$name: the devices differ" >>"$out/failed"
      fi
    done
  done <<COMMANDS
intersect intersect $gyroid $bcc --estimate --resolution 1024
intersect-over intersect $gyroid $bcc --mode over --resolution 1024
union union $gyroid $bcc $bone --estimate --resolution 1024
csg csg (a-b)|(c&d)-e a=$gyroid b=$bone c=$bcc d=$star e=$bone --estimate --resolution 1024
volume volume $gyroid --estimate --resolution 1024
sample sample $gyroid --resolution 1024 -o $models/images.npz
minkowski minkowski $bone $star --resolution 256
offset offset $bone --distance 1 --resolution 256
COMMANDS
  rm -r "$models"
}

# Not behind `&&` or `||`, which would switch off `set -e` in the functions.
case "${1:-} $#" in
  "pack 2") pack "$2" ;;
  "run 2" | "run 3") run "${@:2}" ;;
  *)
    sed -n '4,5s/^# //p' "$0" >&2
    exit 2
    ;;
esac
