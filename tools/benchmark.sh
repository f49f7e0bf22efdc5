#!/bin/bash
# tools/benchmark.sh [CAMGYRO]: runs the benchmark and writes docs/benchmark.md, with the text of
# docs/benchmark_notes.md in front, and docs/benchmark_*.svg. SEEDS: runs per scenario (8); JOBS:
# processes at a time (all cores). The measured recordings are in $CAMGYRO_DATA (../shared/data).
set -euo pipefail
cd "$(dirname "$0")/.."
camgyro=$(realpath "${1:-build/release/tools/camgyro}")
data=${CAMGYRO_DATA:-../shared/data}
seeds=${SEEDS:-8} jobs=${JOBS:-$(nproc)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

compare() {  # arguments of `camgyro compare`, which become the section's command line
  "$camgyro" compare "$@" --jobs="$jobs" --out="$work/out" >&2
  printf '    camgyro compare %s\n\n' "$*"
  cat "$work/out/compare.md"
}

{
  cat docs/benchmark_notes.md
  printf '\n## Simulated, 0.5 px\n'
  compare walking running slow panning rotation --seeds="$seeds" tracks.noise_px=0.5 \
    --ekf_sigma_px=0.5
  cp "$work/out/errors_running.svg" docs/benchmark_running.svg
  cp "$work/out/errors_panning.svg" docs/benchmark_panning.svg
  printf '## Simulated, 1 px\n'
  compare walking running slow --seeds="$seeds"
  printf '## Simulated, 0.05 px: tracks as good as those of the paper\n'
  compare walking running panning --seeds="$seeds" tracks.noise_px=0.05 --estimators=ekf
  printf '## The filter made fair, 0.5 px\n'
  for options in "--ekf_triplets=30" "--ekf_triplets=300" "--ekf_gate=3" "--ekf_iterations=3"; do
    compare walking running --seeds="$seeds" tracks.noise_px=0.5 --ekf_sigma_px=0.5 \
      --estimators=ekf "$options"
  done
  if [[ -d $data ]]; then
    printf '## OpenVINS simulation, lens given\n'
    (cd "$data" && compare ov_handheld_gs ov_handheld_rs ov_handheld_rs_skew)
  fi
} > "$work/benchmark.md"
mv "$work/benchmark.md" docs/benchmark.md
