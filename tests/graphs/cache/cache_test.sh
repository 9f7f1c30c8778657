#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The cache as a user meets it: cache_test.sh PROGRAM
qmat=$1
. "$(dirname "$0")/../../lib.sh"
mounted=
clean_up() { if [ -n "$mounted" ]; then umount "$mounted"; fi; }
unset QMAT_CACHE
XDG_CACHE_HOME=$work/home
export XDG_CACHE_HOME
graph=graph.yaml

write_graph graph.yaml 20%
write_box box.off

# run OPTION...: the graph on $model; the states of its nodes, in one line, in $states.
model=box.off
run() {
  "$qmat" run "$graph" --set model="$model" --verbose "$@" >out.txt 2>err.txt
  code=$?
  states=$(sed 's/from cache/hit/; s/to run/run/; s/ ran / run /; s/unchanged/same/' out.txt | awk '$2 ~ /^[a-z]+\.[a-z]+$/ { printf "%s%s:%s", n++ ? " " : "", $1, $3 }')
}

# all STATE WHAT: the last run went well, and every node was in that state.
all() {
  if [ "$code" -ne 0 ] || [ -z "$states" ] || echo "$states" | tr ' ' '\n' | grep -qv ":$1\$"; then
    fail "$2: not all of '$states' are $1 (exit $code)"
  fi
}

# is NODE STATE WHAT
is() {
  if ! echo " $states " | grep -q " $1:$2 "; then fail "$3: node $1 of '$states' is not $2"; fi
}

# Cold and warm.
formats="-o cold.glb -o cold.gltf -o cold.ma -o cold.ply"
# shellcheck disable=SC2086
run $formats
all run "a first run"
# shellcheck disable=SC2086
run $(echo $formats | sed 's/cold/warm/g')
all hit "a second run"
for ending in glb gltf ma ply; do holds "cold and warm are the same, .$ending" cmp cold.$ending warm.$ending; done
run -o off.glb --no-cache
holds "no state without a cache" test -z "$(grep -c 'from cache' out.txt | grep -v 0)"
holds "with and without a cache is the same" cmp off.glb cold.glb
run -o off.glb --cache "$work/other"
all run "another cache"
QMAT_CACHE=$work/other run -o off.glb
all hit "the cache that the environment names"
QMAT_CACHE=off run -o off.glb
holds "no cache where the environment says so" sh -c '! grep -q "from cache" out.txt'
holds "the default folder" test -s "$XDG_CACHE_HOME/qmat/CACHEDIR.TAG"

# What a result depends on, and what it does not.
touch -d '2001-01-01' box.off
run -o a.glb
all hit "another date of the file"
run -o a.glb --threads 1
all hit "another number of threads"
mkdir copy
cp box.off copy/
model=copy/box.off
run -o a.glb
all hit "a copied folder"
cd copy || exit 1
model=box.off
graph=../graph.yaml
run -o a.glb
all hit "another working folder"
cd "$work" || exit 1
graph=graph.yaml
if mkdir locale && localedef -i de_DE -f UTF-8 locale/de_DE.UTF-8 2>/dev/null; then
  LOCPATH=$work/locale LC_ALL=de_DE.UTF-8 run -o a.glb
  all hit "de_DE.UTF-8"
else
  echo "skipped: the locale de_DE.UTF-8 (Debian: apt install locales)"
fi
if [ "$(id -u)" -eq 0 ] && command -v setpriv >/dev/null && setpriv --reuid 65534 --clear-groups test -x "$qmat"; then
  chmod -R a+rX "$work"
  mkdir -m 777 theirs
  qmat_before=$qmat
  cat >as_other <<END
#!/bin/sh
exec setpriv --reuid 65534 --clear-groups env HOME=/nonexistent "$qmat_before" "\$@"
END
  chmod +x as_other
  qmat=$work/as_other
  run -o theirs/a.glb
  all hit "another user, who may only read the cache"
  qmat=$qmat_before
else
  echo "skipped: another user (root and setpriv are needed)"
fi
model=box.off
run -o a.glb --set initial.merge=0.15
for node in model thickness samples; do is $node hit "another parameter"; done
is initial run "another parameter"
sed 's/^2 1 1$/2 1 1.5/' box.off >changed.off
cp box.off kept.off
cp changed.off box.off
run -o a.glb
all run "another byte"
cp kept.off box.off
run -o a.glb
all hit "the bytes of before"

# --force, --dry-run, --to, dot and why.
run -o a.glb --force=initial
is initial same "a forced node"
is model hit "a node that is not forced"
run -o a.glb --force
all same "all nodes forced"
holds "forcing names unknown nodes" sh -c '"$0" run "$1" --set model=box.off --force=inital 2>&1 | grep -q "did you mean .initial."' \
  "$qmat" "$graph"
run -o dry.glb --set initial.merge=0.2 --dry-run
is model hit "a dry run"
is initial run "a dry run"
is asset depends "a dry run"
holds "a dry run writes nothing" test ! -e dry.glb
"$qmat" why "$graph" initial --set model=box.off --set initial.merge=0.2 >out.txt 2>err.txt
holds "why names the parameter" grep -q 'parameter merge is 0.2, was 0.1' out.txt
holds "why tells of the node that was asked for" sh -c '! grep -q "^model" out.txt'
"$qmat" why "$graph" --set model=changed.off --json >out.txt 2>err.txt
holds "why as JSON" grep -q '"tag": "name"' out.txt
"$qmat" dot "$graph" --status --set model=box.off --set initial.merge=0.2 >out.txt 2>err.txt
holds "dot shows hits" grep -q 'mesh.sdf: from cache' out.txt
holds "dot shows what would run" grep -q 'medial.delaunay: to run' out.txt
"$qmat" run "$graph" --set model=box.off -o a.glb --report report.json >out.txt 2>err.txt
holds "hits in the report" grep -q '"cache": "hit"' report.json

# A side file: the buffer of a glTF asset.
mkdir asset
printf '%s' '{"asset":{"version":"2.0"},"buffers":[{"uri":"box.bin","byteLength":60}],"bufferViews":[
 {"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],"accessors":[
 {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
 {"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],"meshes":[{"primitives":[
 {"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0}' >asset/box.gltf
# A tetrahedron: 0, x, y, z; one is 00 00 80 3f.
zero='\000\000\000\000'
one='\000\000\200\077'
# shellcheck disable=SC2059
printf "$zero$zero$zero$one$zero$zero$zero$one$zero$zero$zero$one\000\002\001\000\001\003\000\003\002\001\002\003" >asset/box.bin
model=asset/box.gltf
run -o a.ma
all run "a glTF asset"
run -o b.ma
all hit "a glTF asset again"
holds "a glTF asset is the same" cmp a.ma b.ma
cp -r asset elsewhere
model=elsewhere/box.gltf
run -o b.ma
all hit "a glTF asset in another folder"
two='\000\000\000\100'
# shellcheck disable=SC2059
printf "$zero$zero$zero$two$zero$zero$zero$one$zero$zero$zero$one\000\002\001\000\001\003\000\003\002\001\002\003" >elsewhere/box.bin
"$qmat" why "$graph" model --set model="$model" >out.txt 2>err.txt
holds "why names the side file" grep -q 'the side file box.bin changed' out.txt
run -o b.ma
all run "another byte in the side file"

# A scene of two meshes, one of which changes: the other comes from the cache.
mkdir scene
printf '%s' '{"asset":{"version":"2.0"},"buffers":[{"uri":"two.bin","byteLength":108}],"bufferViews":[
 {"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12},
 {"buffer":0,"byteOffset":60,"byteLength":48}],"accessors":[
 {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
 {"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"},
 {"bufferView":2,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[2,2,2]}],"meshes":[
 {"name":"one","primitives":[{"attributes":{"POSITION":0},"indices":1}]},
 {"name":"other","primitives":[{"attributes":{"POSITION":2},"indices":1}]}],
 "nodes":[{"mesh":0},{"mesh":1}],"scenes":[{"nodes":[0,1]}],"scene":0}' >scene/two.gltf
# put_scene X: the side file, with X as the first coordinate of the second mesh's second corner.
put_scene() {
  # shellcheck disable=SC2059
  printf "$zero$zero$zero$one$zero$zero$zero$one$zero$zero$zero$one\000\002\001\000\001\003\000\003\002\001\002\003" >scene/two.bin
  # shellcheck disable=SC2059
  printf "$zero$zero$zero$1$zero$zero$zero$two$zero$zero$zero$one" >>scene/two.bin
}
model=scene/two.gltf
put_scene "$one"
run --to initial
all run "a scene of two meshes"
run --to initial
all hit "a scene of two meshes again"
put_scene "$two"
run --to initial
is initial run "a mesh of two that has changed"
holds "the other mesh comes from the cache" test "$(grep -c '1 of 2 from cache' out.txt)" -eq 3
"$qmat" cache verify >out.txt 2>err.txt
holds "lists are whole in the cache" grep -q ' 0 broken, 0 incomplete' out.txt
model=box.off

# A cache that cannot be written, or is damaged.
cp -r "$XDG_CACHE_HOME/qmat" damaged
for blob in damaged/cas/*; do
  size=$(stat -c %s "$blob")
  case $((size % 3)) in
    0) truncate -s $((size / 2)) "$blob" ;;
    1) printf 'X' | dd of="$blob" bs=1 seek=$((size / 2)) conv=notrunc status=none ;;
    *) : >"$blob" ;;
  esac
done
run -o a.glb --cache damaged
holds "a run on a damaged cache" test "$code" -eq 0
holds "a damaged cache does not change a result" cmp a.glb cold.glb
run -o a.glb --cache damaged
all hit "a cache that was damaged"
run -o b.glb --cache-read-only --set initial.merge=0.3
is initial run "reading only"
run -o b.glb --set initial.merge=0.3
is initial run "nothing was kept when reading only"
# No less than the 1024 bytes that an OpenMP runtime may want for itself.
for size in 2 8; do
  (
    ulimit -f $size
    "$qmat" run "$graph" --set model=box.off --to initial --cache small$size >out.txt 2>err.txt
  )
  holds "a run whose files may not grow" test $? -eq 0
  "$qmat" cache verify --cache small$size >out.txt 2>err.txt
  holds "nothing half-written where files may not grow" test $? -eq 0
done
mkdir full
if [ "$(id -u)" -eq 0 ] && mount -t tmpfs -o size=64k tmpfs full 2>/dev/null; then
  mounted=$work/full
  run -o a.glb --cache full
  holds "a run on a full disk" test "$code" -eq 0
  holds "a full disk does not change a result" cmp a.glb cold.glb
  holds "a full disk is told" grep -q 'warning: cannot write to the cache' err.txt
  holds "a full disk is told once" test "$(grep -c warning err.txt)" -eq 1
  "$qmat" cache verify --cache full >out.txt 2>err.txt
  holds "nothing half-written on a full disk" test $? -eq 0
  mount -o remount,ro "$mounted"
  run -o a.glb --cache full
  holds "a run on a read-only disk" cmp a.glb cold.glb
else
  echo "skipped: a full disk (root and mount are needed)"
fi

# Cancelled while a node runs: what was done is kept, and nothing is broken.
awk 'BEGIN {
  n = 300; m = 150; pi = 3.14159265358979
  printf "OFF\n%d %d 0\n", n * m, n * m
  for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
    a = 2 * pi * i / n; b = 2 * pi * j / m
    printf "%.9f %.9f %.9f\n", (3 + cos(b)) * cos(a), (3 + cos(b)) * sin(a), sin(b)
  }
  for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
    k = (i + 1) % n; l = (j + 1) % m
    printf "4 %d %d %d %d\n", i * m + j, k * m + j, k * m + l, i * m + l
  }
}' >torus.off
: >err.txt
"$qmat" run "$graph" --set model=torus.off --set samples.spacing=2% -o torus.glb --progress json --threads 1 >out.txt \
  2>err.txt &
running=$!
tries=0
until grep -q '"event":"start","node":"thickness"' err.txt || [ $tries -ge 600 ]; do
  sleep 0.1
  tries=$((tries + 1))
done
kill -TERM $running
wait $running
code=$?
holds "exit code 3 after a signal, not $code" test $code -eq 3
"$qmat" cache verify >out.txt 2>err.txt
holds "nothing is broken after a signal" test $? -eq 0
"$qmat" run "$graph" --set model=torus.off --set samples.spacing=2% --dry-run >out.txt 2>err.txt
holds "what was done before the signal is kept" grep -q '^model .*from cache' out.txt

# Looking after it.
"$qmat" cache stats >out.txt 2>err.txt
holds "stats" grep -q 'records' out.txt
"$qmat" cache ls >out.txt 2>err.txt
holds "ls" grep -q 'medial.delaunay' out.txt
key=$(awk '$2 == "mesh.sdf" { print $1; exit }' out.txt)
"$qmat" cache show "$key" >out.txt 2>err.txt
holds "show" grep -q '^library  Embree' out.txt
for action in stats ls verify; do
  "$qmat" cache $action --json >out.txt 2>err.txt
  holds "$action as JSON" grep -q '^[{[]' out.txt
done
"$qmat" cache show 0000 >out.txt 2>err.txt
holds "no such key" test $? -eq 2
"$qmat" cache verfiy >out.txt 2>err.txt
holds "a mistyped action" grep -q "did you mean 'verify'?" err.txt
printf X >>"$(ls "$XDG_CACHE_HOME"/qmat/cas/* | head -n 1)"
"$qmat" cache verify >out.txt 2>err.txt
holds "verify fails when something is broken" test $? -eq 1
"$qmat" cache verify >out.txt 2>err.txt
holds "what is broken is set aside" test $? -eq 0
used_bytes() {
  find "$XDG_CACHE_HOME/qmat/ac" "$XDG_CACHE_HOME/qmat/cas" -type f -exec cat {} + | wc -c
}
"$qmat" run "$graph" --set model=torus.off --set samples.spacing=2% -o torus.glb >out.txt 2>err.txt
limit=$(($(used_bytes) / 2))
"$qmat" cache gc --cache-size $limit >out.txt 2>err.txt
used=$(used_bytes)
holds "gc keeps to the size of $limit, not $used" test "$used" -le $limit -a "$used" -gt 0
run -o a.glb
holds "a run after gc" cmp a.glb cold.glb
"$qmat" cache clear >out.txt 2>err.txt
holds "clear leaves nothing" test -z "$(ls "$XDG_CACHE_HOME/qmat/ac" "$XDG_CACHE_HOME/qmat/cas" | grep -v :)"
run -o a.glb
holds "a run after that" cmp a.glb cold.glb
"$qmat" run "$graph" --set model=box.off --cache box.off >out.txt 2>err.txt
holds "a file is no cache" test $? -eq 2
"$qmat" run "$graph" --set model=box.off --cache-size many >out.txt 2>err.txt
holds "no such size" test $? -eq 2

finish
