#!/usr/bin/env bash
# tests - the Debian package: it is made of what is built, and runs where there is no checkout.
#   debian_package.sh BUILD_FOLDER WORK_FOLDER
set -euo pipefail
build=$(realpath "$1") work=$2 here=$(dirname "$(realpath "$0")")
rm -rf "$work"
mkdir -p "$work/unpacked"
work=$(realpath "$work")
trap '[[ $? == 0 ]] || cat "$work/log"' EXIT
cd "$build"
cpack -G DEB -B "$work/package" >"$work/log" 2>&1
packages=("$work"/package/*.deb)
[[ ${#packages[@]} == 1 ]]
depends=$(dpkg-deb -f "${packages[0]}" Depends)
for library in libc6 libmodbus5 libpagmo8 libfmt9; do [[ $depends == *"$library "* ]] || { echo "no $library: $depends"; exit 1; }; done
dpkg-deb -x "${packages[0]}" "$work/unpacked"
rm -rf "$work/package/_CPack_Packages"

# Away from the checkout, with nothing that names it.
usr=$work/unpacked/usr
cd "$work"
unset ARMCAL_HOME
armcal() { "$usr/bin/armcal" "$@" >>"$work/log" 2>&1; }
armcal excite --robot er20_like --starts 1 --search-seconds 1 --out "$work/motion.csv"
[[ -s $work/motion.csv ]]
[[ -s $usr/share/man/man1/armcal-excite.1 && -s $usr/share/bash-completion/completions/armcal ]]
[[ -s $usr/share/doc/armcal/README.md && -s $usr/share/doc/armcal/LICENSE ]]
# Each link of a page to a file leads to one.
find "$usr/share/doc/armcal" -name '*.md' | while read -r page; do
  { grep -o '](\([^):#]*\)[)#]' "$page" || true; } | sed 's/^](//; s/[)#]$//' | while read -r link; do
    [[ -z $link || -e $(dirname "$page")/$link ]] || { echo "$page: no $link" >>"$work/log"; exit 1; }
  done
done
cmake -S "$here/consumer" -B "$work/consumer" -G Ninja -DWAY=package -DCMAKE_PREFIX_PATH="$usr" >>"$work/log" 2>&1
cmake --build "$work/consumer" -j2 >>"$work/log" 2>&1
"$work/consumer/consumer"
echo "$(basename "${packages[0]}"): $depends"
