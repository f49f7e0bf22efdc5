#!/bin/bash
# tools/tidy.sh [BASE]: clang-tidy with the profile .clang-tidy, over all sources or over those that
# changed since the commit BASE (of a header foo.h: foo.cc). A source takes some 6 s of a core. Run it
# over one's commits before they land, and over all sources, a quarter of an hour, before a release.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_deps.sh clang-tidy-14
# In a folder of its own, without the unity build: each source has to be complete by itself, and
# without -Werror, since warnings that only GCC knows would be errors.
cmake --log-level=WARNING --preset dev -B build/tidy -DCAMGYRO_WERROR=OFF >/dev/null
cmake --build build/tidy --target camgyro_generated >/dev/null

list() { git ls-files '*.cc' ':!examples' ':!tests/consumer'; }
if (( $# )); then
  changed=$(git diff --name-only "$1" -- '*.cc' '*.h' | sed 's/\.h$/.cc/' | sort -u)
  sources=$(list | grep -Fxf <(echo "$changed") || true)
else
  sources=$(list)
fi
[[ -n $sources ]] || { echo "no source to look at"; exit 0; }
echo "$(wc -l <<<"$sources") sources"

# clang-tidy counts the warnings of system headers, which it does not show, on stderr.
tidy() { clang-tidy-14 -p build/tidy --quiet "$1" 2> >(grep -Ev '^[0-9]+ warnings?( and|) .*generated|^[0-9]+ warnings? generated' >&2 || true); }
export -f tidy
xargs -P "$(nproc)" -I{} bash -c 'tidy {}' <<<"$sources"
echo "clang-tidy: clean"
