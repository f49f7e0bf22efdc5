#!/bin/bash
# Builds camgyro and calibrates the sample recording, which the simulator made: the truth is known.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_deps.sh
cmake --log-level=WARNING --preset release
cmake --build --preset release -j "$(nproc)" --target camgyro
build/release/tools/camgyro calibrate tools/sample --out out/demo

# The value of a key of calibration.yaml or truth.yaml, cut after six decimals.
value() {
  sed -n "s/.*$2: *{value: *\(\[[^]]*\]\|[^,}]*\).*/\1/p" "$1" |
    sed 's/\(\.[0-9]\{6\}\)[0-9]*/\1/g'
}
echo
echo "Beside the truth of this simulated recording, tools/sample/truth.yaml (-q is the same as q):"
printf '%-18s %-46s %s\n' '' estimated truth
for key in focal_px principal_px readout_s delay_s bias_rad_s q_gyro_cam_wxyz; do
  printf '%-18s %-46s %s\n' "$key" "$(value out/demo/calibration.yaml $key)" \
    "$(value tools/sample/truth.yaml $key)"
done
echo "The result: out/demo/calibration.yaml; the estimate after each frame: out/demo/trace.csv"
