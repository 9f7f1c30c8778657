#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes the page of a model of 100 thousand triangles and tells how quickly headless Chromium draws it:
#   page_rate.sh [MODEL]
# QMAT_BUILD is the build folder, by default build/release; without MODEL it needs the target qmat_planted.
set -eu
options=
. "$(dirname "$0")/functions.sh"
need node nodejs
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) ||
  refuse "there is no Chromium (Debian: apt install chromium)"
model=${1:-}
if [ -z "$model" ]; then
  need_built qmat_planted
  model=$work/tree.off
  "$build/qmat_planted" tree 9 1 100000 0 "$model" "$work/tree.ma"
fi
"$build/qmat" mat "$model" -o "$work/page.html" --no-cache --progress off
node "$top/tests/bench/page_rate.mjs" "$chromium" "$work" "$work/page.html"
