#!/bin/bash
# tools/benchmark.sh [CAMGYRO]: runs the benchmark and writes docs/lab/benchmark.md, with the text
# of benchmark_notes.md in front, and benchmark_*.svg beside it. SEEDS: runs per scenario (8); JOBS:
# processes at a time (all cores). The measured recordings are in $CAMGYRO_DATA (../shared/data).
# tools/benchmark.sh --residuals [CAMGYRO]: only the section of that name, anew in that file.
# tools/benchmark.sh --times OLD NEW: prints the times of two programs, run in turns, and their
# ratios, for the table of docs/lab/performance.md. RUNS: of each (2), of which the least counts;
# ONLY: a pattern of rows.
set -euo pipefail
here=$PWD
cd "$(dirname "$0")/.."

# times OLD NEW: a row per command, seconds by the clock and of the processor.
times() {
  local old new data room runs=${RUNS:-2} name command row run program failed=
  old=$(cd "$here" && realpath "$1") new=$(cd "$here" && realpath "$2")
  data=$(realpath -m "${CAMGYRO_DATA:-../shared/data}")
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  room=$work/room
  local rows=(
    "tools/sample, 9 s of 640 x 480|calibrate tools/sample"
    "8 s of 1280 x 720|calibrate $room"
    "8 s of 1280 x 720, only tracked|track $room"
    "ov_corridor_rs, 90 s of tracks|calibrate $data/ov_corridor_rs --effects=radial_distortion:radtan"
    "phone-edge-hand, 52 s of 640 x 480|calibrate $data/phone-edge-hand"
    "8 s of 1280 x 720, diagnosed|diagnose $room"
    "ov_corridor_rs, with gyro_scale|calibrate $data/ov_corridor_rs --effects=radial_distortion:radtan,gyro_scale"
    "ov_handheld_rs, 60 s of tracks, diagnosed|diagnose $data/ov_handheld_rs"
    "phone-edge-hand, 52 s of 640 x 480, diagnosed|diagnose $data/phone-edge-hand"
  )
  TIMEFORMAT='%R %U'
  printf '| Recording | before | after | ratio | processor before | after | ratio |\n'
  printf '| --- | --- | --- | --- | --- | --- | --- |\n'
  for row in "${rows[@]}"; do
    name=${row%%|*} command=${row#*|}
    # shellcheck disable=SC2053
    [[ -z ${ONLY:-} || $name == $ONLY ]] || continue
    if [[ $command == *" $room" && ! -d $room ]]; then
      "$old" simulate tools/scenarios/video_room.yaml seed=1 duration_s=8 \
        'camera.resolution=[1280,720]' camera.focal_px=1000 --out "$room" > "$work/log"
    fi
    if [[ $command == *"$data"* && ! -d $data ]]; then echo "| $name | SKIPPED | | | | | |"; continue; fi
    : > "$work/seconds"
    for ((run = 0; run < runs; ++run)); do
      for program in "$old" "$new"; do
        # A recording that determines too little ends with 4.
        # shellcheck disable=SC2086
        { time "$program" $command --quiet --out "$work/out" > "$work/log" 2>&1 ||
          [[ $? == 4 ]] || failed=1; } 2>> "$work/seconds"
        if [[ $failed ]]; then cat "$work/log" >&2; return 1; fi
      done
    done
    awk -v name="$name" '
      { side = (NR + 1) % 2
        if (!(side in wall) || $1 < wall[side]) wall[side] = $1
        if (!(side in user) || $2 < user[side]) user[side] = $2 }
      END { printf "| %s | %.1f s | %.1f s | %.2f | %.1f s | %.1f s | %.2f |\n", name, wall[0],
              wall[1], wall[1] / wall[0], user[0], user[1], user[1] / user[0] }' "$work/seconds"
  done
}
if [[ ${1:-} == --times ]]; then times "$2" "$3"; exit; fi

only=
if [[ ${1:-} == --residuals ]]; then only=residuals; shift; fi
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

# One table of all residuals, with and without loss, from 12 comparisons.
residuals() {
  local motions=(walking running rotation) wrong=tracks.outlier_fraction=0.05
  local options=(--seeds=4 tracks.noise_px=0.5 --estimators=refinement)
  local -A no_loss=([robust]='' [norobust]=', no loss')
  local residual loss outliers
  printf '    camgyro compare %s %s\n\n' "${motions[*]}" "${options[*]}"
  cat <<EOF
with \`--residual\` and the loss as in the rows; the last three columns with \`$wrong\`: an observation in 20, a match in 10 is wrong, by 20 px per axis. In the cells, of the refinement: RMSE of f [px], RMSE of t_d [ms]; NEES/dof.

EOF
  printf '| |'
  printf ' %s |' "${motions[@]}" "${motions[@]/%/, 10 % wrong}"
  printf '\n| --- | --- | --- | --- | --- | --- | --- |\n'
  for residual in plane determinant transfer; do
    for loss in robust norobust; do
      printf '| %s%s |' "$residual" "${no_loss[$loss]}"
      for outliers in "" "$wrong"; do
        # shellcheck disable=SC2086
        "$camgyro" compare "${motions[@]}" "${options[@]}" --residual="$residual" --"$loss" \
          $outliers --jobs="$jobs" --out="$work/out" >&2
        # A cell per case. Runs that failed are in no number, but counted.
        awk '
          function value(key, scale) {
            match($0, key ": [^,}]*")
            return short(scale * substr($0, RSTART + length(key) + 2, RLENGTH - length(key) - 2))
          }
          function short(x) { return sprintf(x < 1000 ? "%.3g" : "%.0f", x) }
          function cell() {
            return " " (f == "" ? "-" : f ", " t "; " nees) (failed ? " (" failed " failed)" : "") " |"
          }
          /- name:/ { if (seen++) printf "%s", cell(); f = "" }
          /failed:/ { failed = $2 + 0 }
          /nees_per_dof:/ { nees = value("mean", 1) }
          /focal_px:/ { f = value("rmse", 1) }
          /delay_s:/ { t = value("rmse", 1e3) }
          END { printf "%s", cell() }' "$work/out/compare.yaml"
      done
      printf '\n'
    done
  done
  printf '\n'
}

if [[ $only == residuals ]]; then
  { printf '## Residuals, with and without loss\n'; residuals; } > "$work/section.md"
  awk -v section="$work/section.md" '
    /^## / { skip = 0 }
    /^## Residuals, with/ { skip = 1; while ((getline line < section) > 0) print line }
    !skip' docs/lab/benchmark.md > "$work/benchmark.md"
  mv "$work/benchmark.md" docs/lab/benchmark.md
  exit
fi

{
  cat docs/lab/benchmark_notes.md
  printf '\n## Simulated, 0.5 px\n'
  compare walking running slow panning rotation --seeds="$seeds" tracks.noise_px=0.5 \
    --ekf_sigma_px=0.5
  cp "$work/out/errors_running.svg" docs/lab/benchmark_running.svg
  cp "$work/out/errors_panning.svg" docs/lab/benchmark_panning.svg
  printf '## Simulated, 1 px\n'
  compare walking running slow --seeds="$seeds"
  printf '## Simulated, 0.05 px: tracks as good as those of the paper\n'
  compare walking running panning --seeds="$seeds" tracks.noise_px=0.05 --estimators=ekf
  printf '## The filter made fair, 0.5 px\n'
  for options in "--ekf_triplets=30" "--ekf_triplets=300" "--ekf_gate=3" "--ekf_iterations=3"; do
    compare walking running --seeds="$seeds" tracks.noise_px=0.5 --ekf_sigma_px=0.5 \
      --estimators=ekf "$options"
  done
  printf '## Residuals, with and without loss\n'
  residuals
  if [[ -d $data ]]; then
    printf '## OpenVINS simulation, lens given\n'
    (cd "$data" && compare ov_handheld_gs ov_handheld_rs ov_handheld_rs_skew)
  fi
} > "$work/benchmark.md"
mv "$work/benchmark.md" docs/lab/benchmark.md
