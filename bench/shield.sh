#!/usr/bin/env bash
# Runs a command on a core that nothing else may use for as long: every task that lets itself be moved goes to the other cores and comes
# back at the end, also after Ctrl-C. Root, and the cpuset hierarchy of control groups, version 1. Tasks in other groups of that hierarchy
# (containers) stay where they are. Before Linux 6.2 a task that is moved loses the cores that it had chosen itself.
# usage: shield.sh CORE COMMAND...
set -eu
core=$1
shift
top=/sys/fs/cgroup/cpuset
others=$top/ravenpose-others
[ -w "$top/tasks" ] || { echo "shield.sh: $top: no cpuset hierarchy of version 1 to write to" >&2; exit 3; }

# Moves all tasks but this one from a group to another, again until a pass finds no more that can be: what is moved may begin others.
# Those of the kernel that belong to one core stay.
moves() {
  local task moved=1 passes=0
  while [ $moved -gt 0 ] && [ $passes -lt 20 ]; do
    moved=0
    passes=$((passes + 1))
    while read -r task; do
      if [ "$task" != $$ ] && echo "$task" 2> /dev/null > "$2/tasks"; then moved=$((moved + 1)); fi
    done < "$1/tasks"
  done 2> /dev/null
}

back() {
  moves "$others" "$top"
  rmdir "$others" || { echo "shield.sh: tasks are still kept off core $core: move them from $others/tasks to $top/tasks" >&2; exit 4; }
}
if [ -d "$others" ]; then back; fi
mkdir "$others"
trap back EXIT
trap 'exit 130' INT TERM
cat "$top/cpuset.mems" > "$others/cpuset.mems"
seq -s , 0 $(($(nproc --all) - 1)) | tr , '\n' | grep -vx "$core" | paste -sd , > "$others/cpuset.cpus"
moves "$top" "$others"
taskset -c "$core" "$@"
