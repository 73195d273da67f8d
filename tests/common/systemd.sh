#!/bin/sh
# Runs a command, as root, under a systemd of its own: first process of namespaces of its own, so that the machine's units, journal,
# /etc, /run, /tmp, /var and /dev/shm stay as they are. It knows the journal and no other unit of the machine: what they do at a boot
# (clean /tmp, load modules, set kernel parameters) would be done to the machine. The command's output comes when it has ended.
#
#   systemd.sh COMMAND [ARG ...]     exit status: the command's; 125 where such a systemd cannot be had, with one line that says why
set -eu
[ $# -gt 0 ] || { sed -n '2,6s/^# *//p' "$0" >&2; exit 125; }

if [ "$1" != --inside ]; then
    for program in /lib/systemd/systemd systemctl unshare; do
        command -v "$program" > /dev/null || { echo "systemd.sh: $program is not installed" >&2; exit 125; }
    done
    kept=$(mktemp -d) # survives the namespaces
    trap 'rm -rf "$kept"' EXIT
    status=0
    timeout --kill-after=5 300 unshare --pid --fork --kill-child --mount --mount-proc --cgroup --uts -- \
        /bin/sh "$0" --inside "$kept" "$@" > "$kept/boot" 2>&1 || status=$?
    if [ -e "$kept/output" ]; then
        cat "$kept/output"
        exit "$status"
    fi
    echo "systemd.sh: no systemd of its own could be started: $(tail -n 1 "$kept/boot")" >&2
    exit 125
fi

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
mount -t cgroup2 cgroup2 /sys/fs/cgroup
export -p > /run/command
printf 'cd %s\n' "$(pwd)" >> /run/command
for word in "$@"; do
    printf "'%s' " "$(printf %s "$word" | sed "s/'/'\\\\''/g")"
done >> /run/command
for unit in systemd-journald.service systemd-journald.socket systemd-journald-dev-log.socket exit.target systemd-exit.service; do
    cp "/lib/systemd/system/$unit" /run/units
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
