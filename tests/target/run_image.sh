#!/usr/bin/env bash
# tests - runs an image on an emulated board and passes its answer on; what it prints goes to standard output.
#   run_image.sh BOARD IMAGE [--input FILE] [--same-as PROGRAM] [--trace FILE]
# --same-as: PROGRAM is the image's own source compiled for the PC; both must print the same, byte for byte, or the answer is 1 and
# the first lines that differ. --trace: QEMU writes to FILE the address of every instruction. 77: PROGRAM or FILE is not built, so nothing
# was compared. 124: the image did not end.
set -uo pipefail
board=$1 image=$2
shift 2
input="" program="" trace=()
while (($# > 0)); do
  case $1 in
    --input) input=$2 ;;
    --same-as) program=$2 ;;
    --trace) trace=(-singlestep -d "exec,nochain" -D "$2") ;;
    *) sed -n '2,6p' "$0" >&2; exit 2 ;;
  esac
  shift 2
done
for needed in "$input" "$program"; do
  if [[ -n $needed && ! -e $needed ]]; then
    echo "skipped: $needed is not built (cmake --preset host && cmake --build --preset host)"
    exit 77
  fi
done
command -v qemu-system-arm >/dev/null || { echo "skipped: no qemu-system-arm (toolchains/install.sh cross)"; exit 77; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
timeout 180 qemu-system-arm -M "$board" -display none -monitor none -serial null -icount shift=7 "${trace[@]}" \
  -chardev file,id=out,path="$work/target" -semihosting-config enable=on,target=native,chardev=out,arg="$input" \
  -kernel "$image"
code=$?
if ((code != 0)) || [[ -z $program ]]; then
  cat "$work/target"
  exit $code
fi

"$program" ${input:+"$input"} >"$work/host" || { echo "$program: answered $?"; exit 1; }
[[ -s $work/host ]] || { echo "$program printed nothing"; exit 1; }
if ! cmp -s "$work/host" "$work/target"; then
  echo "the PC's bits (<) differ from the target's (>); is $program as new as $image?"
  diff "$work/host" "$work/target" | head -n 20
  exit 1
fi
echo "$(wc -l <"$work/host") lines, the same bits on the PC and on $board"
