#!/bin/bash
# tools/packages.sh [BUILD_DIR]: Debian packages of a release build (build/packages, without tests)
# in BUILD_DIR/deb: camgyro, libcamgyro0.1, libcamgyro-dev, python3-camgyro. Then asks apt whether
# it would install them, and tries them unpacked in a folder: the program calibrates the sample,
# Python imports the module, and a program is built against the library. Two runs on the same
# commit give the same bytes. Run it before a release; CI does not.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/packages}  # below this folder

tools/install_deps.sh dpkg-dev file
# Stamps inside the packages are those of the commit.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
cmake --log-level=WARNING --preset release -B "$build" -DCMAKE_INSTALL_PREFIX=/usr \
  -DBUILD_TESTING=OFF >/dev/null
cmake --build "$build" -j "$(nproc)"
rm -rf "$build/deb"
cpack -G DEB --config "$build/CPackConfig.cmake" -B "$build/deb" >"$build/cpack.log" 2>&1 ||
  { cat "$build/cpack.log"; exit 1; }
rm -rf "$build/deb/_CPack_Packages"

apt-get --simulate -qq install "$PWD/$build"/deb/*.deb >/dev/null  # are all dependencies there?
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
for package in "$build"/deb/*.deb; do
  dpkg-deb -x "$package" "$root"
  echo "$(basename "$package"): $(dpkg-deb -f "$package" Depends | tr ',' '\n' | wc -l) dependencies, $(du -k "$package" | cut -f1) KiB"
done
"$root/usr/bin/camgyro" calibrate tools/sample --out="$root/result" --quiet >/dev/null
gzip -dc "$root/usr/share/man/man1/camgyro-calibrate.1.gz" | grep -q '^\.SH OPTIONS'
bash -c "source $root/usr/share/bash-completion/completions/camgyro"
PYTHONPATH=$root/usr/lib/python3/dist-packages /usr/bin/python3 -c 'import camgyro; camgyro.read_recording'
cmake -S examples/minimal -B "$root/minimal" -G Ninja -DCMAKE_PREFIX_PATH="$root/usr" \
  -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$root/minimal" >/dev/null
LD_LIBRARY_PATH=$(dirname "$root"/usr/lib/*/libcamgyro.so) "$root/minimal/minimal" >/dev/null
echo "the program calibrates, Python imports, a program is built and runs"
if command -v lintian >/dev/null; then lintian --fail-on error "$build"/deb/*.deb; fi
