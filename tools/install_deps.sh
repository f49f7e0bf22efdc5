#!/bin/bash
# tools/install_deps.sh [PACKAGE...]: installs what camgyro needs to build, test and run on Debian
# 12, and the packages named: only those that are missing, and without apt-get if none is. Needs
# root or sudo for that.
set -euo pipefail

packages=(
  # build
  g++ cmake ninja-build pkg-config ccache clang-format-14
  # libraries
  libeigen3-dev libceres-dev libsuitesparse-dev libgflags-dev libgoogle-glog-dev
  libopencv-dev libavformat-dev libavcodec-dev libswscale-dev libavutil-dev
  libyaml-cpp-dev nlohmann-json3-dev libexpected-dev libfast-float-dev
  libsqlite3-dev liblz4-dev libzstd-dev
  # optional: recordings of VideoIMUCapture
  libprotobuf-dev protobuf-compiler
  # Python module
  pybind11-dev python3-dev python3-numpy
  # charts of report.html
  libjs-dygraphs
  # tests
  libgmock-dev libgtest-dev libbenchmark-dev
  # tools/measure*.py
  python3 python3-yaml
)

missing=()
for package in "${packages[@]}" "$@"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed ]] || missing+=("$package")
done
if (( ${#missing[@]} == 0 )); then exit 0; fi

as_root=()
if (( EUID != 0 )); then
  if ! command -v sudo >/dev/null; then
    echo "$0: not root, and no sudo; as root: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "Installing ${missing[*]}"
"${as_root[@]}" apt-get -qq update ||
  echo "apt-get update failed; trying with the package lists as they are" >&2
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get -qq -y --no-install-recommends install "${missing[@]}"
