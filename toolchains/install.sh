#!/usr/bin/env bash
# toolchains - installs what armcal is built with, from Debian's own packages (Debian 12).
#   toolchains/install.sh host    compiler and libraries of the PC side
#   toolchains/install.sh tests   what its tests and the Debian package need besides
#   toolchains/install.sh cross   compiler of the Cortex-M images
#   toolchains/install.sh fuzz    clang with libFuzzer, for the long tests
#   toolchains/install.sh fleet   Slurm and GNU parallel, for the long tests
#   toolchains/install.sh fresh   debootstrap, for the long test of the Debian package
#   toolchains/install.sh peers   Python, its headers, pip, a browser, colcon and stunnel, for tests/run.sh peers
#   toolchains/install.sh docs    Sphinx and Doxygen, for the target docs_site
# Several may be named. Does nothing when all is there. Needs root or sudo only when something is missing.
set -euo pipefail

host_packages=(g++ cmake ninja-build pkg-config ca-certificates
  libeigen3-dev liborocos-kdl-dev libmodbus-dev libtomlplusplus-dev nlohmann-json3-dev libcli11-dev libfmt-dev zlib1g-dev
  liburdfdom-dev libkdl-parser-dev libtinyxml2-dev libpagmo-dev libboost-dev
  libjs-dygraphs libssl-dev liblz4-dev libzstd-dev libsqlite3-dev libmatio-dev libfcl-dev libassimp-dev)
tests_packages=(libgtest-dev googletest git dpkg-dev file mbpoll)
cross_packages=(cmake ninja-build gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib
  qemu-system-arm python3)
fuzz_packages=(clang libclang-rt-dev)
fleet_packages=(slurmctld slurmd slurm-client munge parallel)
fresh_packages=(debootstrap)
peers_packages=(python3 python3-dev python3-venv python3-pip chromium colcon python3-colcon-cmake python3-colcon-ros
  stunnel4 openssl libsdformat-dev)
docs_packages=(python3 python3-sphinx python3-myst-parser doxygen)

wanted=()
for group in "${@:-none}"; do
  case $group in
    host) wanted+=("${host_packages[@]}") ;;
    tests) wanted+=("${tests_packages[@]}") ;;
    cross) wanted+=("${cross_packages[@]}") ;;
    fuzz) wanted+=("${fuzz_packages[@]}") ;;
    fleet) wanted+=("${fleet_packages[@]}") ;;
    fresh) wanted+=("${fresh_packages[@]}") ;;
    peers) wanted+=("${peers_packages[@]}") ;;
    docs) wanted+=("${docs_packages[@]}") ;;
    *) sed -n '2,11p' "$0" >&2; exit 2 ;;
  esac
done

missing=()
for package in "${wanted[@]}"; do
  state=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $state == installed ]] || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

as_root=()
if [[ $EUID -ne 0 ]]; then
  command -v sudo >/dev/null || { echo "install.sh: needs root to install: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi

echo "installing ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -y -qq -o DPkg::Lock::Timeout=300 "$@" >"$log" 2>&1; }
{ apt update && apt install --no-install-recommends "${missing[@]}"; } || { cat "$log" >&2; exit 1; }
