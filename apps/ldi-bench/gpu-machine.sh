#!/usr/bin/env bash
# Asks a machine with a GPU everything that docs and thresholds rest on, by programs alone: it needs no network and no
# compiler there, only the GPU's driver and the Vulkan loader. Under 25 minutes.
# usage: apps/ldi-bench/gpu-machine.sh pack FOLDER             where the sources are: builds the programs into FOLDER
#        FOLDER/gpu-machine.sh run OUT [ADAPTER]               there: measures, and writes into OUT after each step
#
# ADAPTER is a name as `ldi-ops devices` lists it, or part of one; the first by default. The twins come before any time: where one
# differs, nothing else is measured.
set -euo pipefail

pack() {
  local folder=$1 here twins
  here=$(cd "$(dirname "$0")/../.." && pwd)
  mkdir -p "$folder/data"
  folder=$(cd "$folder" && pwd)
  cd "$here"
  cargo build --release -p ldi-ops-cli -p ldi-bench
  twins=$(cargo test --release -p ldi-ops --features full --test twins --no-run --message-format=json |
    sed -n 's/.*"executable":"\([^"]*twins-[^"]*\)".*/\1/p')
  cp "${CARGO_TARGET_DIR:-target}/release/ldi-ops" "${CARGO_TARGET_DIR:-target}/release/ldi-bench" "$folder"
  cp "$twins" "$folder/twins"
  strip "$folder/ldi-ops" "$folder/ldi-bench" "$folder/twins"
  cp -r data/models "$folder/data"
  cp "$here/apps/ldi-bench/gpu-machine.sh" "$folder"
  git log -1 --format='%H %cI' >"$folder/commit"
  du -ch "$folder"/* | tail -1
}

# Prints a step and how long the steps before took.
step() { printf '%4d s  %s\n' "$SECONDS" "$1"; }

run() {
  local out adapter=()
  mkdir -p "$1"
  out=$(cd "$1" && pwd)
  cd "$(dirname "$0")"
  [ -z "${2:-}" ] || adapter=(--adapter "$2")
  [ -z "${2:-}" ] || export LDI_ADAPTER=$2
  cp commit "$out"
  export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-/tmp}

  step devices
  ./ldi-ops devices -q --json "$out/devices.json"
  step "twins, by 64-bit integers and by pairs"
  ./twins 2>&1 | tee "$out/twins.txt" | tail -3
  for resolution in 512 1024 2048; do
    step "sampler at $resolution rays"
    timeout 300 ./ldi-bench gpu "${adapter[@]}" --resolution "$resolution" --rounds $((7680 / resolution)) \
      --json "$out/gpu-$resolution.json" >"$out/gpu-$resolution.md"
  done
  step "the sampler of this machine's processor"
  timeout 300 ./ldi-bench sampling --runs 5 --json "$out/sampling.json" >"$out/sampling.md"
  commands "$out" "${adapter[@]}"
  step "done: $out"
}

# Whole commands on either device, three times each; the times are in the JSON of each.
commands() {
  local out=$1 models name command
  shift
  models=$(mktemp -d)
  step "models"
  ./ldi-ops generate gyroid --part sheet --cells 4,4,4 -q -o "$models/gyroid.stl" >/dev/null
  ./ldi-ops generate bone -q -o "$models/bone.stl" >/dev/null
  ./ldi-ops generate bcc --cells 6,6,6 -q -o "$models/bcc.stl" >/dev/null
  ./ldi-ops generate star -q -o "$models/star.stl" >/dev/null
  local gyroid=$models/gyroid.stl bone=$models/bone.stl bcc=$models/bcc.stl star=$models/star.stl
  while read -r name command; do
    step "$name: $command"
    for device in cpu gpu; do
      local chosen=(--backend cpu)
      [ "$device" = cpu ] || chosen=(--backend gpu "$@")
      for round in 1 2 3; do
        # shellcheck disable=SC2086 — the words of a command
        timeout 120 ./ldi-ops $command --unit mm "${chosen[@]}" -q --json "$out/$name-$device-$round.json" >/dev/null
      done
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
