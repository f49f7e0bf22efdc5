#!/bin/bash
# tools/tutorial_pictures.sh [CAMGYRO]: the pictures of docs/tutorial.md, out of the reports of the
# commands that stand there. Needs chromium-headless-shell.
set -euo pipefail
cd "$(dirname "$0")/.."
camgyro=$(realpath "${1:-build/release/tools/camgyro}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# One section of a report as a picture: FOLDER SECTION HEIGHT PICTURE.
picture() {
  sed "s|</head>|<style>section:not(#$2), header, nav, h1, h1 ~ p { display: none !important }</style></head>|" \
    "$work/$1/report.html" > "$work/page.html"
  chromium-headless-shell --no-sandbox --disable-gpu --hide-scrollbars --window-size="900,$3" \
    --screenshot="$PWD/docs/$4" "file://$work/page.html" 2> "$work/chromium.log" ||
    { cat "$work/chromium.log"; exit 1; }
}

"$camgyro" calibrate tools/sample --out "$work/result" --quiet
picture result rates 725 tutorial_rates.png
picture result residuals 575 tutorial_residuals.png
"$camgyro" simulate tools/scenarios/effect_radial_distortion.yaml duration_s=20 --out "$work/lens"
"$camgyro" diagnose "$work/lens" --out "$work/diagnosis" --quiet
picture diagnosis structure 515 tutorial_diagnosis.png
