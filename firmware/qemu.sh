#!/usr/bin/env bash
# Runs an image in QEMU: ./qemu.sh MACHINE IMAGE. Exit code: the image's own; 124 where it did not end within 60 s.
# -icount: one instruction takes 2^8 ns of emulated time, so that the image can count its own instructions exactly.
set -euo pipefail
machine=$1 image=$2
case $machine in
virt) emulator=qemu-system-riscv32 package=qemu-system-misc more=(-bios none) ;;
*) emulator=qemu-system-arm package=qemu-system-arm more=() ;;
esac
command -v "$emulator" >/dev/null || { echo "$emulator is needed; on Debian or Ubuntu: apt install $package" >&2; exit 127; }
exec timeout 60 "$emulator" -M "$machine" "${more[@]}" -display none -monitor none -serial none -icount shift=8 \
    -semihosting-config enable=on,target=native -kernel "$image" </dev/null
