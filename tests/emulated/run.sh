#!/usr/bin/env bash
# The kernels on processors that this machine is not: NEON under QEMU, where the whole service is built for Arm as well, and AVX-512 with
# VNNI under Bochs, in a small Linux of its own. Says what is right, not how fast. Root, 4 GB of disk, some 20 and 40 minutes.
# usage: run.sh DIRECTORY [neon|avx512]
set -eu
cd "$(dirname "$0")/../.."
repository=$PWD
work=$(realpath -m "$1")
only=${2:-}
root=$work/debian
target=aarch64-unknown-linux-gnu
tests="--lib --test golden --test faults"

[ "$(id -u)" = 0 ] || { echo "skipped: needs root, for a second system in $root"; exit 0; }
command -v debootstrap > /dev/null || { apt-get update -q && apt-get install -qy debootstrap cpio; }

# A second Debian: its compiler comes with Rust's library for Arm, and it has newer emulators.
if [ ! -e "$root/.done" ]; then
  rm -rf "$root"
  mkdir -p "$work"
  debootstrap --variant=minbase --include=ca-certificates trixie "$root"
  chroot "$root" dpkg --add-architecture arm64
  chroot "$root" apt-get update -q
  DEBIAN_FRONTEND=noninteractive chroot "$root" apt-get install -qy --no-install-recommends cargo-web rustc-web \
    libstd-rust-web-dev:arm64 gcc g++ gcc-aarch64-linux-gnu g++-aarch64-linux-gnu libc6-dev-arm64-cross libclang-dev qemu-user \
    bochs bochsbios isolinux syslinux-common xorriso busybox-static
  image=$(chroot "$root" apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: \(linux-image-[0-9][^ ]*\).*/\1/p' | head -n 1)
  chroot "$root" bash -c "cd /root && apt-get download -q $image && dpkg -x $image*.deb linux && rm $image*.deb"
  touch "$root/.done"
fi

mounted=()
trap 'for place in "${mounted[@]}"; do umount "$place"; done' EXIT
mounts() { mkdir -p "$2"; mount --bind "$1" "$2"; mounted=("$2" "${mounted[@]}"); }
mounts /proc "$root/proc"
mounts /dev "$root/dev"
mounts "$repository" "$root/src"
if [ -d "$repository/../shared" ]; then mounts "$repository/../shared" "$root/shared"; fi

neon() {
  cargo fetch --locked --quiet
  mounts "${CARGO_HOME:-$HOME/.cargo}" "$root/cargo"
  chroot "$root" env -i PATH=/usr/bin:/bin HOME=/root CARGO_HOME=/cargo CARGO_TARGET_DIR=/root/target \
    CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc \
    CXX_aarch64_unknown_linux_gnu=aarch64-linux-gnu-g++ RAVENPOSE_FAULT_CYCLES=100000 \
    CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu" \
    BINDGEN_EXTRA_CLANG_ARGS_aarch64_unknown_linux_gnu="--sysroot=/usr/aarch64-linux-gnu -I/usr/aarch64-linux-gnu/include" \
    bash -c "cd /src && cargo build --release --locked --offline --workspace --all-targets --target $target &&
      cargo test --release --locked --offline --workspace --no-fail-fast --target $target $tests -- --show-output"
}

avx512() {
  local guest=$work/guest image=$work/image program
  rm -rf "$guest" "$image" "$work/boot.iso"
  mkdir -p "$guest"/{bin,lib64,lib/x86_64-linux-gnu,proc,tmp,"$repository"} "$image"
  program=$(cargo test --release --locked --workspace --test golden --no-run --message-format=json \
    | sed -n 's/.*"name":"golden".*"executable":"\([^"]*\)".*/\1/p')
  cp "$program" "$guest/bin/golden"
  strip "$guest/bin/golden"
  ldd "$program" | grep -o '/[^ ]*' | while read -r library; do cp -L --parents "$library" "$guest"; done
  cp "$root/bin/busybox" "$guest/bin/"
  cp -r models "$guest/$repository/"
  if [ -d ../shared/models ]; then cp -r --parents "$(realpath ../shared/models)" "$guest"; fi
  printf '%s\n' '#!/bin/busybox sh' '/bin/busybox mount -t proc proc /proc' \
    "/bin/busybox grep -m1 flags /proc/cpuinfo | /bin/busybox tr ' ' '\n' | /bin/busybox grep -q avx512_vnni || echo 'no VNNI'" \
    "cd $repository" '/bin/golden --test-threads=1' 'echo "ended: $?"' '/bin/busybox sleep 600' > "$guest/init"
  chmod +x "$guest/init"
  (cd "$guest" && find . | cpio -o -H newc --quiet | gzip -1) > "$image/initrd.gz"
  cp "$root"/root/linux/boot/vmlinuz-* "$image/vmlinuz"
  cp "$root/usr/lib/ISOLINUX/isolinux.bin" "$root/usr/lib/syslinux/modules/bios/ldlinux.c32" "$image/"
  printf '%s\n' 'default tests' 'label tests' 'kernel vmlinuz' \
    'append initrd=initrd.gz console=ttyS0 tsc=reliable mitigations=off nokaslr quiet random.trust_cpu=on' > "$image/isolinux.cfg"
  mounts "$work" "$root/work"
  chroot "$root" xorriso -as mkisofs -quiet -o /work/boot.iso -b isolinux.bin -c boot.cat -no-emul-boot -boot-load-size 4 \
    -boot-info-table "/work/image"
  printf '%s\n' 'cpu: model=tigerlake, count=1, ips=50000000, ignore_bad_msrs=1' 'memory: guest=1024, host=1024' \
    'romimage: file=/usr/share/bochs/BIOS-bochs-latest' 'vgaromimage: file=/usr/share/bochs/VGABIOS-lgpl-latest' \
    'display_library: rfb, options="timeout=0"' 'ata0-master: type=cdrom, path=/work/boot.iso, status=inserted' 'boot: cdrom' \
    'com1: enabled=1, mode=file, dev=/work/serial.txt' 'log: /work/bochs.log' 'panic: action=fatal' 'error: action=ignore' \
    'info: action=ignore' 'clock: sync=none' > "$work/bochsrc"
  echo c > "$work/bochs.commands"
  : > "$work/serial.txt"
  chroot "$root" bash -c 'exec bochs -q -f /work/bochsrc -rc /work/bochs.commands' < /dev/null > "$work/bochs.out" 2>&1 &
  local emulator=$!
  tail -f --pid=$emulator "$work/serial.txt" &
  # The guest goes on after that, or the line would be lost in its serial port.
  until grep -q "^ended: " "$work/serial.txt" || ! kill -0 $emulator 2>/dev/null; do sleep 5; done
  kill -KILL $emulator 2>/dev/null || true
  wait || true
  if grep -q "no VNNI" "$work/serial.txt"; then echo "the emulated processor has no VNNI"; return 1; fi
  grep -q "^ended: 0" "$work/serial.txt"
}

status=0
for part in neon avx512; do
  if [ -n "$only" ] && [ "$only" != $part ]; then continue; fi
  echo "== $part"
  $part || status=1
done
exit $status
