#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The ES module of examples/readers: js_test.sh SOURCE_FOLDER BUILD_FOLDER. Without three.js, Babylon.js, glTF-Transform and
# ajv, which npm fetches once, only what needs none of them is tested, and the test counts as skipped.
set -eu
if ! command -v node >/dev/null 2>&1; then
  echo "skipped: there is no node (Debian: apt install nodejs)"
  exit 77
fi
work=$2/reader_packages
mkdir -p "$work"
node "$1/tests/readers/js_test.mjs" "$1/examples/readers"
if ! cmp -s "$1/tests/readers/package.json" "$work/package.json" || [ ! -e "$work/node_modules/.complete" ]; then
  cp "$1/tests/readers/package.json" "$work/package.json"
  if ! (cd "$work" && npm install --no-audit --no-fund --no-package-lock >install.log 2>&1 && touch node_modules/.complete); then
    echo "skipped in part: npm could not install the loaders; $work/install.log says why"
    exit 77
  fi
fi
cp "$1/tests/readers/js_test.mjs" "$1/tests/readers/js_loaders_test.mjs" "$work"
node "$work/js_loaders_test.mjs" "$1/examples/readers"
