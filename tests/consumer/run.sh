#!/bin/bash
# tests/consumer/run.sh BUILD_DIR: installs a build into a temporary prefix, and builds and runs a
# program against it with find_package(camgyro).
set -euo pipefail
source_dir=$(cd "$(dirname "$0")/../.." && pwd)
build_dir=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build_dir" --prefix "$work/prefix" >"$work/install.log"
cmake -S "$source_dir/tests/consumer" -B "$work/build" -G Ninja \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_BUILD_TYPE=Release >"$work/configure.log" 2>&1 ||
  { cat "$work/configure.log"; exit 1; }
cmake --build "$work/build"
"$work/build/consumer" "$source_dir/tools/sample"
if grep -rn "$source_dir\|$build_dir" "$work/prefix" --include='*.cmake'; then
  echo "the installed package refers to the source or build folder (above)"
  exit 1
fi
"$work/prefix/bin/camgyro" help >/dev/null
echo "find_package(camgyro): installed, built and run"
