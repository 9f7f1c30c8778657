#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds qmat, makes a few models, describes each by medial spheres, cones and slabs, and shows what came of it. It needs
# only Debian 12, installs what is missing, and works from any folder.
set -eu
cd "$(dirname "$0")/.."
build=build/release
out=build/demo

say() {
  printf '\n%s\n' "$*"
}

say "This builds about 0.1 GB in $PWD/build and takes a few minutes the first time."
sh .ci/packages.sh packages.txt

say "Building ..."
mkdir -p build
if ! { cmake --preset release && cmake --build --preset release -j "$(nproc)" --target qmat qmat_models; } >build/demo.log 2>&1; then
  tail -n 30 build/demo.log
  echo "The build failed; all of it: $PWD/build/demo.log"
  exit 1
fi

say "Making models ..."
mkdir -p "$out"
QMAT_CACHE=off # results of earlier builds must not stand for those of this one
export QMAT_CACHE
"$build/qmat_models" all "$out"

# number FILE NAME: of the summary at the end of a report.
number() {
  awk -v name="\"$2\":" '/"summary": *\{/ { inside = 1 } inside && $1 == name { gsub(/,/, "", $2); print $2; exit }' "$1"
}

# percent FRACTION: rounded up, since it is a bound.
percent() {
  awk -v x="$1" 'BEGIN { x *= 10000; n = int(x); if (n < x) n++; printf "%.2f %%", n / 100 }'
}

say "Describing each to within 1 % of its size:"
printf '\n  %-16s %10s %8s %22s %8s %10s\n' model triangles spheres 'error out / in' seconds 'glb bytes'
rows=$out/cards.html
: >"$rows"
for surface in "$out"/*.off; do
  name=$(basename "$surface" .off)
  "$build/qmat" mat "$surface" -o "$out/$name.glb" -o "$out/$name.ma" -o "$out/$name.html" -o "$out/$name.png" \
    --set page.up=z --set picture.up=z --set picture.view=overlay --set picture.width=480 --epsilon 1% --report "$out/$name.json" --quiet \
    --progress off
  triangles=$(sed -n 2p "$surface" | cut -d ' ' -f 2)
  spheres=$(number "$out/$name.json" spheres)
  error_out=$(percent "$(number "$out/$name.json" surface_to_envelope)")
  error_in=$(percent "$(number "$out/$name.json" envelope_to_surface)")
  seconds=$(awk '/^  "seconds":/ { printf "%.1f", $2 }' "$out/$name.json") # of the whole run
  bytes=$(wc -c <"$out/$name.glb")
  printf '  %-16s %10d %8d %22s %8s %10d\n' "$name" "$triangles" "$spheres" "$error_out / $error_in" "$seconds" "$bytes"
  plural=s
  if [ "$spheres" -eq 1 ]; then plural=; fi
  {
    printf '<figure>\n'
    printf '<a href="%s.html"><img src="%s.png" alt="%s and its medial mesh"></a>\n' "$name" "$name" "$name"
    printf '<figcaption><b>%s</b><span class="n">%d triangles &rarr; %d sphere%s</span>' \
      "$name" "$triangles" "$spheres" "$plural"
    printf '<span>surface to envelope %s, envelope to surface %s; %s s</span>' "$error_out" "$error_in" "$seconds"
    printf '<span><a href="%s.html">page</a> <a href="%s.glb">glb</a> <a href="%s.ma">ma</a> <a href="%s.off">off</a> <a href="%s.json">report</a>' \
      "$name" "$name" "$name" "$name" "$name"
    printf '</span></figcaption>\n</figure>\n'
  } >>"$rows"
done

{
  cat <<'HEAD'
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>qmat: medial meshes</title>
<style>
body{margin:0 auto;max-width:1180px;padding:32px 24px 64px;font:16px/1.5 system-ui,sans-serif;color:#1d2733;background:#fff}
h1{font-size:28px;margin:0 0 8px}p{max-width:44em;margin:0 0 12px;color:#465362}
main{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));gap:20px;margin-top:28px}
figure{margin:0;padding:16px;border:1px solid #dfe5ec;border-radius:8px;display:flex;flex-direction:column}
figure img{width:100%;height:230px;object-fit:contain;margin-bottom:12px}figcaption{margin-top:auto}
figcaption b{font-size:17px}figcaption span{display:block;font-size:14px;color:#5b6878}
figcaption .n{color:#1d2733;font-size:15px}a{color:#9a4708;margin-right:8px}
i{display:inline-block;width:.8em;height:.8em;border-radius:50%;background:#e69f00;vertical-align:-1px}
i.c{background:#56b4e9}i.t{background:#009e73}
</style></head><body>
<h1>Models, and the medial meshes in them</h1>
<p>Each model is described by a few medial spheres <i></i>, joined by cones <i class="c"></i> and slabs <i class="t"></i>.
What they sweep, the envelope, may differ from the model by 1&nbsp;% of its diagonal; the figures are what was
reached. The glb files open in any viewer of glTF: they show the envelope, and carry the medial mesh with them.</p>
<main>
HEAD
  cat "$rows"
  printf '</main></body></html>\n'
} >"$out/index.html"
rm -f "$rows"

cat <<END

The files are in $PWD/$out

  index.html   a page with a picture of each model and its medial mesh; open it in a browser
  *.html       a page of each, to turn it and to go through its levels of detail
  *.glb        for any viewer of glTF (Blender, three.js, an engine)
  *.ma         the medial mesh as plain text: spheres "v x y z r", cones "e i j", slabs "f i j k"
  *.json       what was done, with times and errors

Your own model:  $build/qmat mat MODEL.obj -o MODEL.glb --epsilon 1%
END
