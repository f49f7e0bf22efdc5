#!/bin/bash
# tools/packages_test.sh [DEB_DIR]: are the Debian packages all that is needed? Makes a clean Debian
# 12 in a temporary folder, from the mirror that apt uses here, installs the packages of DEB_DIR
# (build/packages/deb, as tools/packages.sh leaves them) in it with apt, and there calibrates the
# sample, imports the Python module, and builds and runs a program that finds the library with
# find_package. Then asks lintian. Needs root, for chroot; takes some minutes and 2 GB of $TMPDIR.
set -euo pipefail
cd "$(dirname "$0")/.."
debs=$(realpath "${1:-build/packages/deb}")
begin() { echo "=== $* (after ${SECONDS} s)"; }

if ! compgen -G "$debs/*.deb" >/dev/null; then
  echo "$debs: no packages; tools/packages.sh makes them" >&2
  exit 2
fi
tools/install_deps.sh mmdebstrap lintian
mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' 'Codename: bookworm' |
  sort -u | head -n 1)

root=$(mktemp -d)
trap 'umount "$root/proc" 2>/dev/null || true; rm -rf --one-file-system "$root"' EXIT
chmod 755 "$root"  # apt fetches as a user of its own
begin "a clean Debian 12 from $mirror"
mmdebstrap --quiet --variant=apt bookworm "$root" "${mirror:-http://deb.debian.org/debian}"
mount -t proc proc "$root/proc"
cp /etc/resolv.conf "$root/etc/resolv.conf"
in_root() {
  chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive "$@"
}
install() {
  in_root sh -c "apt-get -q -y --no-install-recommends install $*" >"$root/apt.log" 2>&1 ||
    { tail -n 20 "$root/apt.log"; exit 1; }
}

in_root apt-get -qq update
# The program alone first: it must run without what only the others bring.
mkdir "$root/debs"
cp "$debs"/*.deb "$root/debs"
begin "camgyro"
install '/debs/camgyro_*.deb'
cp -r tools/sample "$root/sample"
in_root camgyro calibrate /sample --out=/result --quiet
[[ -s $root/result/calibration.yaml && -s $root/result/report.html ]]

begin "python3-camgyro, libcamgyro-dev"
install '/debs/*.deb' cmake g++ make
in_root python3 -c 'import camgyro; print("Python:", camgyro.read_recording("/sample"))'
cp -r examples/minimal "$root/minimal"
in_root sh -c 'cmake -S /minimal -B /built -DCMAKE_BUILD_TYPE=Release >/dev/null &&
  cmake --build /built >/dev/null && /built/minimal'

begin "lintian"
lintian --fail-on error "$debs"/*.deb
begin "all passed"
