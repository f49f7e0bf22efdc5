#!/bin/bash
# tools/fuzz.sh [until] [SECONDS [TARGET...]]: builds libFuzzer's program (preset fuzz) and runs every
# target of tests/fuzz/targets.cc, or those named, for SECONDS (60), one after the other. Run it after
# a change to a reader, and for half an hour per target before a release:
#
#   tools/fuzz.sh until 1800
#
# gives each target what it lacks of 1800 s of the processor, in slices of five minutes at most, so
# that it can be stopped at any moment and called again. What a target has had since its corpus was
# begun is in build/fuzz/ran/TARGET, of every call.
#
# What brings a reader down, takes it longer than 20 s or more than 1 GiB ends its target; the input
# is then build/fuzz/found/TARGET-*. Mend it, and put the input (made smaller by -minimize_crash=1)
# into tests/fuzz/found/TARGET/ under a name that says what it is: test_fuzz replays it. What inputs
# reach is kept in build/fuzz/corpus/TARGET, where the next run begins.
set -euo pipefail
cd "$(dirname "$0")/.."
until=0
if [[ ${1:-} == until ]]; then until=1; shift; fi
seconds=${1:-60}
shift || true
slice=300

tools/install_deps.sh clang-14 libclang-rt-14-dev
cmake --log-level=WARNING --preset fuzz >/dev/null
cmake --build --preset fuzz --target camgyro_fuzz -j "$(nproc)"
fuzz=build/fuzz/tests/camgyro_fuzz

# Files that are written anew for every input belong in memory.
if [[ -z ${TMPDIR:-} && -w /dev/shm ]]; then export TMPDIR=/dev/shm; fi
# A reader may ask for what a file claims and be refused; freed memory is not kept for long.
export ASAN_OPTIONS=allocator_may_return_null=1:quarantine_size_mb=16
export GLOG_minloglevel=3 OPENCV_LOG_LEVEL=SILENT

if (( $# )); then targets=("$@"); else mapfile -t targets < <("$fuzz" --list); fi
mkdir -p build/fuzz/found build/fuzz/ran
failed=()

ran() { cat "build/fuzz/ran/$1" 2>/dev/null || echo 0; }  # seconds of the processor

# fuzz_for TARGET SECONDS: of time, which is no less than that of the processor.
fuzz_for() {
  local target=$1 corpus=build/fuzz/corpus/$1 log=build/fuzz/$1.log good=1
  local TIMEFORMAT='%U %S'
  { time "$fuzz" --target="$target" "$corpus" -max_total_time="$2" -rss_limit_mb=1024 -timeout=20 \
      -max_len=65536 -artifact_prefix="build/fuzz/found/$target-" -print_final_stats=1 \
      >"$log" 2>&1; } 2>"build/fuzz/$target.time" || good=0
  awk -v before="$(ran "$target")" '{ printf "%.2f\n", before + $1 + $2 }' \
    "build/fuzz/$target.time" >"build/fuzz/ran/$target.new"
  mv "build/fuzz/ran/$target.new" "build/fuzz/ran/$target"
  if (( good )); then
    awk -v target="$target" -v ran="$(ran "$target")" '
      / cov: / { for (i = 1; i < NF; ++i) if ($i == "cov:") cov = $(i + 1) }
      /number_of_executed_units/ { runs = $2 } /peak_rss_mb/ { rss = $2 }
      END { printf "%-20s %9d inputs, %6d edges, %4d MB; %.0f s in all\n",
                   target, runs, cov, rss, ran }' "$log"
  else
    printf '%-20s FAILED: %s\n' "$target" "$(grep -m1 -E 'SUMMARY|the answer|ERROR' "$log" || true)"
    failed+=("$target")
    return 1
  fi
}

for target in "${targets[@]}"; do
  "$fuzz" --target="$target" --write-seeds="build/fuzz/corpus/$target"
  if (( ! until )); then
    fuzz_for "$target" "$seconds" || true
    continue
  fi
  while :; do
    had=$(ran "$target")
    left=$(( seconds - ${had%.*} ))
    if (( left <= 0 )); then break; fi
    fuzz_for "$target" $(( left > slice ? slice : left < 10 ? 10 : left )) || break
  done
done
if (( ${#failed[@]} )); then
  echo "build/fuzz/found has the inputs, build/fuzz/TARGET.log what happened: ${failed[*]}" >&2
  exit 1
fi
