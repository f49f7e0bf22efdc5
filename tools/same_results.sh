#!/bin/bash
# tools/same_results.sh BUILD_A BUILD_B: do two builds give the same results, byte by byte?
#
# Compared are calibration.yaml and trace.csv of tools/sample (pictures) and of a measured recording
# of attitudes (in $CAMGYRO_DATA, default ../shared/data; without it SKIPPED), the files of a small
# simulated recording, and its diagnosis.yaml. None of them holds times of day or of work. Both
# builds diagnose the recording that A has simulated. Prints one line per file; exit code 0 if all
# are the same, 1 if one differs, 2 if a build has no program, 3 if a program fails.
#
# What a build gave is kept in BUILD/same_results until its program changes, so that the second
# comparison with the same reference costs half.
set -euo pipefail
cd_root=$(dirname "$0")/..
(( $# == 2 )) || { sed -n '2,/^set /s/^# \{0,1\}//p' "$0" >&2; exit 2; }
for build in "$@"; do
  [[ -x $build/tools/camgyro ]] || { echo "$build: has no tools/camgyro" >&2; exit 2; }
done
a=$(realpath "$1") b=$(realpath "$2")
cd "$cd_root"
attitudes=$(realpath -m "${CAMGYRO_DATA:-../shared/data}")/tablet-attitude/D01

# run BUILD NAME RECORDING_OR_SCENARIO ARGUMENT...: `camgyro ARGUMENT... --out BUILD/same_results/NAME`,
# if that is not there from the same program.
run() {
  local build=$1 name=$2; shift 2
  local out=$build/same_results/$name
  if [[ -e $out/done && $out/done -nt $build/tools/camgyro ]]; then return; fi
  rm -rf "$out"
  mkdir -p "$out"
  echo "running: $build/tools/camgyro $*" >&2
  "$build/tools/camgyro" "$@" --out "$out" >"$out/log" 2>&1 ||
    { cat "$out/log" >&2; exit 3; }
  touch "$out/done"
}

simulated=$a/same_results/simulated
for build in "$a" "$b"; do
  run "$build" sample calibrate tools/sample --quiet
  if [[ -d $attitudes ]]; then run "$build" attitudes calibrate "$attitudes" --quiet; fi
  run "$build" simulated simulate tools/scenarios/effect_gyro_scale.yaml duration_s=6
  run "$build" diagnosis diagnose "$simulated" --quiet
done

files=(sample/calibration.yaml sample/trace.csv diagnosis/diagnosis.yaml
       diagnosis/calibration.yaml simulated/truth.yaml simulated/cam0/tracks.csv
       simulated/imu0/data.csv)
if [[ -d $attitudes ]]; then
  files+=(attitudes/calibration.yaml attitudes/trace.csv)
else
  echo "SKIPPED: $attitudes is absent"
fi
different=0
for file in "${files[@]}"; do
  if cmp -s "$a/same_results/$file" "$b/same_results/$file"; then
    echo "same       $file"
  else
    echo "DIFFERENT  $file"
    different=1
  fi
done
exit $different
