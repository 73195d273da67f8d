#!/usr/bin/env bash
# The installed package as outside projects use it: by pkg-config, statically, and by CMake; each program then really talks.
# usage: run.sh STAGE [VENV_BIN]; called by `make test`. Prints "N passed, N failed".
set -u
stage=$1
export PATH="${2:+$2:}$PATH"
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/ravenpose-packaging.XXXXXX")
export RAVENPOSE_PREFIX="rppack$$_" RAVENPOSE_ROOT="$work/iceoryx2/" LD_LIBRARY_PATH="$stage/lib"
trap 'kill $(jobs -p) 2>/dev/null; wait; rm -rf "$work"; rm -f /dev/shm/"$RAVENPOSE_PREFIX"*' EXIT
passed=0 failed=0
try() {
  local name=$1; shift
  if "$@" > "$work/log" 2>&1; then passed=$((passed + 1)); echo "packaging: $name ... ok"
  else failed=$((failed + 1)); echo "packaging: $name ... FAILED"; sed 's/^/    /' "$work/log"; fi
}

strict="-O2 -Wall -Wextra -Werror"
flags() { PKG_CONFIG_PATH="$stage/lib/pkgconfig" pkg-config "$@" ravenpose; }
by_pkg_config() {
  # pkg-config itself may be absent: then its file is read as it would.
  if command -v pkg-config > /dev/null; then cflags=$(flags --cflags); libs=$(flags --libs)
  else cflags="-I$stage/include"; libs="-L$stage/lib -lravenpose_bridge"; grep -q -- '-lravenpose_bridge' "$stage/lib/pkgconfig/ravenpose.pc" || return 1; fi
  # shellcheck disable=SC2086
  cc -std=c99 $strict $cflags "$root/bridge/examples/c/pose_reader.c" -o "$work/reader" $libs
}
static() {
  cc -std=c99 $strict -I"$stage/include" "$root/bridge/examples/c/publisher.c" -o "$work/publisher" \
    "$stage/lib/libravenpose_bridge.a" -lpthread -ldl -lm -lrt && ! ldd "$work/publisher" | grep -q ravenpose
}
both_standards() {
  for f in "$root"/bridge/examples/c/*.c; do cc -std=c99 $strict -pedantic -I"$stage/include" -c "$f" -o "$work/o.o" || return 1; done
  for f in "$root"/bridge/examples/cxx/*.cpp; do c++ -std=c++17 $strict -pedantic -I"$stage/include" -c "$f" -o "$work/o.o" || return 1; done
  for f in "$root"/bridge/examples/c/*.c; do c++ -x c++ -std=c++17 $strict -I"$stage/include" -c "$f" -o "$work/o.o" || return 1; done
}
cmake_project() {
  cmake -S "$root/tests/packaging/cmake" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$stage" -DEXAMPLES="$root/bridge/examples" \
    && cmake --build "$work/cmake"
}
talks() {
  cat > "$work/c.toml" <<END
allow_untrained = true
allow_degraded = true
[limits]
stale_us = 1000000
budget_us = 100000
[transport]
prefix = "$RAVENPOSE_PREFIX"
root = "$RAVENPOSE_ROOT"
[gold]
model = "$stage/share/ravenpose/models/untrained.onnx"
[report]
runtime_dir = "$work/run"
END
  "$stage/bin/ravenposed" --config "$work/c.toml" & service=$!
  for _ in $(seq 1 1200); do [ -f "$work/run/stats.json" ] && break; sleep 0.05; done
  "$work/reader" 3500 > "$work/read" & reader=$!
  sleep 0.3
  "$work/publisher" 3000 || return 1
  wait $reader; cat "$work/read"
  kill -TERM $service; wait $service || return 1
  grep -q ', corrected, flags' "$work/read"
}
# A shared machine may stop for so long that the service's watchdog ends it.
talks_in_three_attempts() {
  for attempt in 1 2 3; do
    talks && return 0
    echo "attempt $attempt failed"
    kill "$service" 2> /dev/null; wait; rm -rf "$work/run"
  done
  return 1
}
uninstalled_symbols() {
  # Only our own names are exported to the controller.
  # (one name of the transport library cannot be hidden: it has to be unique in a process)
  ! nm -D --defined-only "$stage/lib/libravenpose_bridge.so.1" | awk '{print $3}' | grep -v -e "^ravenpose_" -e "^__internal_default_logger$" | grep .
}

try "pkg-config, shared, C99" by_pkg_config
try "static library alone" static
try "every example as C99 and C++17, pedantic" both_standards
try "exports nothing but ravenpose_*" uninstalled_symbols
try "publisher, service and reader talk" talks_in_three_attempts
if command -v cmake > /dev/null; then try "CMake find_package, shared and static" cmake_project
else echo "packaging: skipped CMake: it is not installed"; fi
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
