#!/usr/bin/env bash
# Runs a command on a core that nothing else may use for as long: every task that lets itself be moved goes to the other cores and comes
# back at the end, also after Ctrl-C. Root, and the cpuset hierarchy of control groups, version 1.
# usage: shield.sh CORE COMMAND...
set -eu
core=$1
shift
top=/sys/fs/cgroup/cpuset
others=$top/ravenpose-others
[ -w "$top/tasks" ] || { echo "shield.sh: $top: no cpuset hierarchy of version 1 to write to" >&2; exit 3; }

back() {
  while read -r task; do echo "$task" > "$top/tasks" || true; done < "$others/tasks"
  rmdir "$others"
} 2> /dev/null
if [ -d "$others" ]; then back; fi
mkdir "$others"
trap back EXIT
trap 'exit 130' INT TERM
cat "$top/cpuset.mems" > "$others/cpuset.mems"
seq -s , 0 $(($(nproc --all) - 1)) | tr , '\n' | grep -vx "$core" | paste -sd , > "$others/cpuset.cpus"
# Those of the kernel that belong to one core stay. What begins meanwhile comes from what was moved.
while read -r task; do [ "$task" = $$ ] || echo "$task" > "$others/tasks" || true; done < "$top/tasks" 2> /dev/null
taskset -c "$core" "$@"
