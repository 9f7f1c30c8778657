#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The remote cache on a real web server, nginx with WebDAV on the loopback: remote_cache_test.sh PROGRAM
# Without nginx it says so and exits with 77, which ctest counts as skipped.
qmat=$1
PATH=$PATH:/usr/sbin:/sbin
if ! command -v nginx >/dev/null; then
  echo "skipped: there is no nginx (Debian: apt install nginx)"
  exit 77
fi
. "$(dirname "$0")/../../lib.sh"
server=
stop_server() {
  if [ -n "$server" ]; then
    kill -KILL "$server" 2>/dev/null
    wait "$server" 2>/dev/null
  fi
  server=
}
clean_up() { stop_server; }
export QMAT_CACHE=off no_proxy='*'

write_graph graph.yaml 20% box.off
write_box box.off

# start_server LINES: nginx in the foreground of a process of ours, so that it can be killed by its number.
start_server() {
  mkdir -p web tmp
  {
    if [ "$(id -u)" -eq 0 ]; then echo "user root;"; fi
    cat <<END
daemon off; master_process off; worker_processes 1; pid "$work/nginx.pid"; error_log "$work/error.log";
events { worker_connections 64; }
http {
  access_log "$work/access.log";
  client_body_temp_path "$work/tmp"; proxy_temp_path "$work/tmp"; fastcgi_temp_path "$work/tmp";
  uwsgi_temp_path "$work/tmp"; scgi_temp_path "$work/tmp";
  client_max_body_size 0;
  server { listen 127.0.0.1:$port; root "$work/web"; $1 }
}
END
  } >nginx.conf
  if is_taken $port; then return 1; fi
  nginx -p "$work" -c "$work/nginx.conf" 2>nginx.err &
  server=$!
  wait_for_server
}

# wait_for_server: until the server listens; false when it ends before.
wait_for_server() {
  tries_left=600
  until is_taken $port; do
    tries_left=$((tries_left - 1))
    if [ $tries_left -eq 0 ] || ! kill -0 "$server" 2>/dev/null; then return 1; fi
    sleep 0.1
  done
}
dav="dav_methods PUT; create_full_put_path on;"
port=$((10000 + $$ % 9000)) # below those that systems give to clients, and those of slurm_test.sh
tries=0
until start_server "$dav"; do
  stop_server
  port=$((port + 1))
  tries=$((tries + 1))
  if [ $tries -gt 5 ]; then
    echo "FAILED: nginx does not start"
    cat nginx.err
    exit 1
  fi
done
url=http://127.0.0.1:$port

right=right.glb
# run CACHE OPTION...: as a machine with that cache folder; the states of its nodes in $states.
run() {
  folder=$1
  shift
  timeout 60 "$qmat" run graph.yaml --cache "$folder" --remote-cache "$url" -o out.glb --verbose "$@" >out.txt 2>err.txt
  code=$?
  states=$(sed 's/from cache/hit/; s/ ran / run /' out.txt | awk '$2 ~ /^[a-z]+\.[a-z]+$/ { print $3 }' | sort -u | tr '\n' ' ')
  holds "the result is right" cmp -s out.glb "$right"
  holds "exit code 0, not $code" test $code -eq 0
}

"$qmat" run graph.yaml -o right.glb >out.txt 2>err.txt
run ours
holds "the first machine computes" test "$states" = "run "
holds "the server has records and blobs" test -n "$(ls web/ac)" -a -n "$(ls web/cas)"
cp -r web web.kept
run theirs
holds "the second machine finds everything: $states" test "$states" = "hit "
holds "no warning" test ! -s err.txt
stop_server # what it has yet to log is not of the next run
: >access.log
start_server "$dav" || holds "nginx starts again" false
run theirs
holds "what was got is kept" sh -c '! grep -q GET access.log'
"$qmat" run graph.yaml -o right21.glb --set samples.spacing=21% >out.txt 2>err.txt
right=right21.glb
run third --remote-read-only --set samples.spacing=21%
right=right.glb
holds "reading only sends nothing" diff -r web web.kept

# A server that lies: other bytes under every name, then records under other names.
for file in web/cas/*; do printf 'X' | dd of="$file" bs=1 seek=40 conv=notrunc status=none; done
run liar
holds "a lie is told once" test "$(grep -c 'has a damaged' err.txt)" -eq 1
rm -rf web/cas/* web/ac/*
run ours --force
rm -rf web && cp -r web.kept web
set -- web/ac/*
cp "$1" keep && cp "$2" "$1" && mv keep "$2"
run swapped
rm -rf web && cp -r web.kept web
for file in web/cas/* web/ac/*; do head -c 100000 /dev/zero >>"$file"; done
run long
rm -rf web && cp -r web.kept web

# A server that sends what is put on to another address: the body is read again from its start.
stop_server
start_server 'location ~ ^/(ac|cas)/ { if ($request_method = PUT) { return 307 /stored$request_uri; } }
  location /stored/ { alias '"$work/web/"'; dav_methods PUT; create_full_put_path on; }' || holds "nginx starts again" false
rm -rf web && mkdir web
run sent_on
holds "no warning of a redirected store" test ! -s err.txt
holds "all is stored behind the redirection" test "$(ls web/ac web/cas | wc -l)" -eq "$(ls web.kept/ac web.kept/cas | wc -l)"
run sent_on2
holds "what was sent on is found: $states" test "$states" = "hit "

# A server that takes nothing, one that always says yes, one that fails.
stop_server
start_server "" || holds "nginx starts again" false
rm -rf web && mkdir web
run alone1
holds "a server that takes nothing is told once" test "$(grep -c 'refuses to store' err.txt)" -eq 1
stop_server
start_server 'location / { default_type text/html; return 200 "<html>welcome</html>"; }' || holds "nginx starts again" false
run alone2
stop_server
start_server 'location / { return 503; }' || holds "nginx starts again" false
: >access.log
run alone3
holds "a failing server is told once" test "$(grep -c warning err.txt)" -eq 1
tries=0
until [ -s access.log ] || [ $tries -ge 100 ]; do # it logs after it has answered
  sleep 0.1
  tries=$((tries + 1))
done
holds "a failing server is asked once" test "$(wc -l <access.log)" -eq 1

# No server at all; one that accepts and never answers; one that dies in the middle of a run.
stop_server
run alone4
holds "no server is told once" test "$(grep -c 'not used any more' err.txt)" -eq 1
run alone4
holds "what is in the folder needs no server: $states" test "$states" = "hit "
rm -rf web && cp -r web.kept web
for delay in 0.01 0.03 0.05 0.08 0.12; do
  start_server "$dav limit_rate 40k;" || holds "nginx starts again" false
  (
    sleep $delay
    kill -KILL "$server"
  ) &
  run "killed$delay"
  wait $!
  stop_server
  "$qmat" cache verify --cache "killed$delay" >out.txt 2>err.txt
  holds "nothing broken after the server was killed" test $? -eq 0
done
if command -v python3 >/dev/null; then
  python3 -c "import socket, time; s = socket.socket(); s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
s.bind(('127.0.0.1', $port)); s.listen(8); time.sleep(600)" &
  server=$!
  wait_for_server || holds "a server that is silent" false
  run silent # within a minute, also on a busy machine
  stop_server
else
  echo "skipped: a server that is silent (Debian: apt install python3)"
fi
"$qmat" run graph.yaml --remote-cache ftp://127.0.0.1 --cache ours >out.txt 2>err.txt
holds "only http and https" test $? -eq 2

# A password in the URL is used and never printed.
for address in "http://user:secret@127.0.0.1:$port/x" "ftp://user:secret@127.0.0.1" "user:secret@127.0.0.1" \
  "http://user:s/e:cret@127.0.0.1:$port"; do
  "$qmat" run graph.yaml --cache secret --force --remote-cache "$address" --report secret.json >out.txt 2>err.txt
  "$qmat" cache stats --cache secret --remote-cache "$address" >>out.txt 2>>err.txt
  "$qmat" cache stats --cache secret --remote-cache "$address" --json >>out.txt 2>>err.txt
  holds "the cache is named" grep -qs '\*\*\*@127.0.0.1' err.txt secret.json
  holds "no password is printed" test -z "$(cat out.txt err.txt secret.json | grep -e secret@ -e cret@ -e user:)"
  rm -f secret.json
done

finish
