#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The page of examples/game in headless Chromium: game_page_test.sh QMAT SOURCE_FOLDER BUILD_FOLDER
# Assets that the program makes fall: nothing on the console, all bodies at rest above the ground, and a picture of them.
set -eu
qmat=$1
source=$2
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if ! command -v node >/dev/null 2>&1 || [ -z "$chromium" ]; then
  echo "skipped: there is no node or no Chromium (Debian: apt install nodejs chromium)"
  exit 77
fi
# As in examples/, since the page takes the readers from there.
packages=$3/game_packages
mkdir -p "$packages/game/page" "$packages/readers"
page=$packages/game/page
if ! cmp -s "$source/examples/game/page/package.json" "$page/package.json" || [ ! -e "$page/node_modules/.complete" ]; then
  cp "$source/examples/game/page/package.json" "$page/package.json"
  if ! (cd "$page" && npm install --no-audit --no-fund --no-package-lock >install.log 2>&1 && touch node_modules/.complete); then
    echo "skipped: npm could not install three.js and Rapier; $page/install.log says why"
    exit 77
  fi
fi
for file in game.js index.html serve.mjs; do cp "$source/examples/game/page/$file" "$page"; done
cp "$source"/examples/readers/*.mjs "$packages/readers"

work=$(mktemp -d)
server=
trap 'if [ -n "$server" ]; then kill "$server"; fi; rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
QMAT_CACHE=$work/cache
export QMAT_CACHE
mkdir "$work/assets"
for model in pear ring; do
  "$qmat" run "$source/examples/game/fall.yaml" --set "model=$source/examples/game/models/$model.off" --set epsilon=1% -q \
    -o "$work/assets/$model.glb"
done
node "$page/serve.mjs" "$work/assets" 0 >"$work/address" &
server=$!
tries=0
until [ -s "$work/address" ]; do
  tries=$((tries + 1))
  if [ "$tries" -gt 300 ]; then
    echo "FAILED: the server does not start"
    exit 1
  fi
  sleep 0.1
done
node "$source/tests/page/game_page_test.mjs" "$chromium" "$(cat "$work/address")" "$work"
