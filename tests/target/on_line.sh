#!/usr/bin/env bash
# target - runs a program of the PC against the example firmware on an emulated board.
#   on_line.sh BOARD IMAGE PROGRAM [WORDS...]
# The program finds the board's serial line in ARMCAL_MODBUS_TTY, and in ARMCAL_MODBUS_SILENCE_MS the pause that ends a frame there.
# 77: there is no QEMU, or the program is not built.
set -euo pipefail
board=$1 image=$2
shift 2
command -v qemu-system-arm >/dev/null || { echo "skipped: no qemu-system-arm (toolchains/install.sh cross)"; exit 77; }
[[ -x $1 ]] || { echo "skipped: $1 is not built (tests/run.sh all)"; exit 77; }

coproc emulator { exec qemu-system-arm -M "$board" -display none -monitor none -serial null -serial pty -kernel "$image"; }
trap 'kill "$emulator_PID"' EXIT
read -r said <&"${emulator[0]}"
[[ $said =~ /dev/[a-z0-9/]+ ]] || { echo "QEMU named no terminal: $said"; exit 1; }
ARMCAL_MODBUS_TTY=${BASH_REMATCH[0]} ARMCAL_MODBUS_SILENCE_MS=200 "$@"
