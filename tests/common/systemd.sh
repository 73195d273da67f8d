#!/bin/sh
# Runs a command, as root, under a systemd of its own: first process of namespaces of its own, so that the machine's units, journal,
# kernel parameters, network, control groups, /etc, /run, /tmp, /var and /dev/shm stay as they are. It knows the journal and no other unit of
# the machine: what they do at a boot (clean /tmp, load modules) would be done to the machine. The command's output comes when it has ended.
#
#   systemd.sh COMMAND [ARG ...]     exit status: the command's; 125 where such a systemd cannot be had, 124 where it took more than five
#                                    minutes, 126 where it did not come up; one line says why
set -eu
[ $# -gt 0 ] || { sed -n '2,8s/^# *//p' "$0" >&2; exit 126; }

case $1 in
--apart) # a mount namespace, in which the machine's second hierarchy of control groups can be seen
    kept=$2
    mkdir "$kept/cgroup"
    mount -t cgroup2 cgroup2 "$kept/cgroup"
    group=$kept/cgroup/ravenpose-systemd.$$
    mkdir "$group"
    status=0
    shift
    sh -c 'echo $$ > "$0/cgroup.procs" && exec timeout --kill-after=5 300 unshare --pid --fork --kill-child --mount --mount-proc \
        --cgroup --uts --net -- "$@"' "$group" /bin/sh "$0" --inside "$@" || status=$?
    find "$group" -depth -type d -exec rmdir {} + || true
    umount "$kept/cgroup"
    exit "$status"
    ;;
--inside) ;;
*)
    for program in /lib/systemd/systemd systemctl unshare; do
        command -v "$program" > /dev/null || { echo "systemd.sh: $program is not installed" >&2; exit 125; }
    done
    may='mount -t tmpfs tmpfs /mnt && mount -t cgroup2 cgroup2 /mnt'
    if ! why=$(unshare --pid --fork --mount --mount-proc --cgroup --uts --net -- /bin/sh -c "$may" 2>&1); then
        echo "systemd.sh: no namespaces or no mounts here: $why" >&2
        exit 125
    fi
    kept=$(mktemp -d) # survives the namespaces
    trap 'rm -rf --one-file-system "$kept"' EXIT
    status=0
    unshare --mount -- /bin/sh "$0" --apart "$kept" "$@" > "$kept/boot" 2>&1 || status=$?
    if [ "$status" -ne 124 ] && [ ! -e "$kept/output" ]; then
        echo "systemd.sh: systemd did not come up: $(tail -n 1 "$kept/boot")" >&2
        exit 126
    fi
    [ "$status" -ne 124 ] || echo "systemd.sh: not done after five minutes" >&2
    cat "$kept/output" 2> /dev/null || true
    exit "$status"
    ;;
esac

kept=$2
shift 2
mount --make-rprivate /
mount -t tmpfs tmpfs /run
mkdir -m 0755 /run/layers /run/units /run/kept
mount --bind "$kept" /run/kept # what is written beside the layers
for place in etc tmp var; do
    mkdir "/run/layers/$place" "/run/layers/$place.work"
    mount -t overlay overlay -o "lowerdir=/$place,upperdir=/run/layers/$place,workdir=/run/layers/$place.work" "/$place"
done
mount -t tmpfs tmpfs /dev/shm
mount --bind /proc/sys /proc/sys
mount -o remount,bind,ro /proc/sys
mount -t cgroup2 cgroup2 /sys/fs/cgroup
export -p > /run/command
printf 'cd %s\n' "$(pwd)" >> /run/command
for word in "$@"; do
    printf "'%s' " "$(printf %s "$word" | sed "s/'/'\\\\''/g")"
done >> /run/command
for unit in systemd-journald.service systemd-journald.socket systemd-journald-dev-log.socket exit.target systemd-exit.service; do
    sed '/^Symlinks=/d' "/lib/systemd/system/$unit" > "/run/units/$unit" # /dev is the machine's, and so would /dev/log be
done
for target in sysinit basic sockets shutdown umount final; do
    printf '[Unit]\nDefaultDependencies=no\n' > "/run/units/$target.target"
done
cat > /run/units/command.service << 'END'
[Unit]
DefaultDependencies=no
Requires=systemd-journald.service
After=systemd-journald.service
[Service]
Type=oneshot
ExecStart=/bin/sh -c '/bin/sh /run/command > /run/kept/output 2>&1; systemctl exit $$?'
END
exec env -i container=other PATH="$PATH" SYSTEMD_UNIT_PATH=/run/systemd/system:/run/units \
    /lib/systemd/systemd --system --unit=command.service
