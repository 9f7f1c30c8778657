#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# CHANGELOG.md says of each node what its version changed: versions.sh SOURCE_FOLDER
set -eu
cd "$1"
bad=0
for file in nodes/*.c; do
  version=$(sed -n 's/^    \.version = \([0-9]*\),$/\1/p' "$file")
  name=$(sed -n 's/^    \.name = "\([a-z_]*\.[a-z_]*\)",$/\1/p' "$file")
  if [ "${version:-1}" = 1 ]; then continue; fi
  if ! grep -q "$name\`\{0,1\} $version[^0-9]" CHANGELOG.md; then
    echo "$file: CHANGELOG.md does not say what $name $version changes"
    bad=1
  fi
done
exit $bad
