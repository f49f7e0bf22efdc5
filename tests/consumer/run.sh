#!/bin/bash
# tests/consumer/run.sh BUILD_DIR: installs a build into a temporary prefix, and builds and runs
# against it, with find_package(camgyro), a program that uses the libraries and the examples.
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

# The examples, each a project of its own.
for project in minimal recording; do
  cmake -S "$source_dir/examples/$project" -B "$work/$project" -G Ninja \
    -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_BUILD_TYPE=Release >"$work/configure.log" 2>&1 ||
    { cat "$work/configure.log"; exit 1; }
  cmake --build "$work/$project"
done
"$work/minimal/minimal"
"$work/recording/realtime" "$source_dir/tools/sample"
"$work/recording/prepare_vio" "$source_dir/tools/sample" "$work/vio"
head -2 "$work/vio/image_times.csv" "$work/vio/readiness.csv"

if grep -rn "$source_dir\|$build_dir" "$work/prefix" --include='*.cmake'; then
  echo "the installed package refers to the source or build folder (above)"
  exit 1
fi
"$work/prefix/bin/camgyro" help >/dev/null
echo "find_package(camgyro): installed, built and run"
