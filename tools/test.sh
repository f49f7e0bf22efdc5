#!/bin/bash
# tools/test.sh [PRESET [CTEST_OPTION...]]: installs what is missing, builds, and runs the tests.
# PRESET: release (default), dev, asan, tsan. CAMGYRO_WERROR=ON makes warnings errors.
# CAMGYRO_TESTS="core tools ...": builds and runs only these test programs, tests/test_NAME.
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-release}
shift || true

case $preset in
  asan | tsan) tools/install_deps.sh clang-14 libclang-rt-14-dev ;;
  *) tools/install_deps.sh ;;
esac
cmake --log-level=WARNING --preset "$preset" -DCAMGYRO_WERROR="${CAMGYRO_WERROR:-OFF}"
only=$(xargs <<<"${CAMGYRO_TESTS:-}")
# shellcheck disable=SC2046,SC2086
cmake --build --preset "$preset" -j "$(nproc)" ${only:+--target $(printf 'test_%s ' $only)}

# Tests on measured recordings find them there, and say SKIPPED if they are absent.
export CAMGYRO_DATA=${CAMGYRO_DATA:-$PWD/../shared/data}
if [[ ! -d $CAMGYRO_DATA ]]; then
  echo "*** NO MEASURED RECORDINGS in $CAMGYRO_DATA: every test on measured data is SKIPPED."
fi
ctest --preset "$preset" -j "$(nproc)" ${only:+-R "^(${only// /|})\."} "$@"
