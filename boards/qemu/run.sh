#!/bin/sh
# Runs an image in QEMU: `run.sh ELF [QEMU OPTION...]`. The one place that holds the machine's options. The
# process becomes QEMU (exec), so whoever kills it kills QEMU; its exit status is the firmware's.
#
#   SERIAL  chardev of UART0            default null
#   ICOUNT  virtual time                default shift=5,sleep=off (README.md says why)
#   LOG     file for the defmt frames   default: standard output. With LOG, standard output is free for
#           frames: let the links to_device -> /dev/stdin and to_host -> /dev/fd/3 stand in the working
#           directory, and a run is a plain child process with two pipes.
set -eu
elf=$1
shift
if [ -n "${LOG:-}" ]; then
  exec 3>&1 >"$LOG"
fi
exec qemu-system-arm -machine mps2-an386 -cpu cortex-m4 -display none -monitor none \
  -serial "${SERIAL:-null}" -icount "${ICOUNT:-shift=5,sleep=off}" \
  -semihosting-config enable=on,target=native -kernel "$elf" "$@"
