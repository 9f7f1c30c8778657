# SPDX-License-Identifier: GPL-3.0-or-later
# The files that the rules of the house are about. A test sources it and stands in the source folder.

# source_files PATH...: the files in these folders, a path a line, sorted, without those that a build makes. In a clone Git
# tells them: what is committed, and new files that are not ignored. A source archive has no .git.
source_files() {
  {
    if [ -e .git ] && git rev-parse --git-dir >/dev/null 2>&1; then
      git -c core.quotePath=false ls-files --cached --others --exclude-standard -- "$@" | while IFS= read -r file; do
        if [ -e "$file" ]; then printf '%s\n' "$file"; fi # one that is deleted is still committed
      done
    else
      for path in "$@"; do
        if [ -e "$path" ]; then
          find "$path" \( -name build -o -name node_modules -o -name .git \) -prune -o -type f -print
        fi
      done | sed 's/^\.\///'
    fi
  } | LC_ALL=C sort -u
}
