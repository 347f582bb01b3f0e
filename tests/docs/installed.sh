#!/usr/bin/env bash
# tests - the Debian package on a fresh Debian 12: apt installs it with what it needs, and the two tutorials and the demo are run with it.
#   installed.sh BUILD_FOLDER ROOT
# ROOT is a folder that becomes the root of that Debian; what stands there is deleted. Needs root, debootstrap and a Debian mirror, else 77.
set -euo pipefail
build=$(realpath "$1") root=$(realpath -m "$2") here=$(dirname "$(realpath "$0")")
[[ $EUID == 0 ]] && command -v debootstrap >/dev/null || { echo "needs root and debootstrap"; exit 77; }
# The mirror that this machine's apt uses, and its way there.
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Identifier: Packages' 'Codename: bookworm' 'Component: main' | head -n 1)
[[ -n $mirror ]] || { echo "apt knows no mirror of Debian 12"; exit 77; }

trap 'umount "$root/proc" 2>/dev/null || true' EXIT
umount "$root/proc" 2>/dev/null || true
rm -rf --one-file-system "$root"
mkdir -p "$root"
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1 || { tail -n 20 "$root.log"; exit 1; }
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d"
cp -L /etc/resolv.conf "$root/etc"
mount -t proc proc "$root/proc"

(cd "$build" && cpack -G DEB -B "$root/srv" >"$root.log" 2>&1) || { cat "$root.log"; exit 1; }
cp "$here"/follow.sh "$here"/../../docs/tutorial_{arm,logs}.md "$root/srv"
in_root() {
  chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive bash -euo pipefail -c "$1"
}
in_root 'cd /srv && apt-get update -qq && apt-get install -y -qq ./armcal_*.deb' >"$root.log" 2>&1 || { tail -n 40 "$root.log"; exit 1; }
for page in tutorial_arm tutorial_logs; do in_root "cd /srv && bash follow.sh $page.md /tmp/$page"; done
in_root 'mkdir /tmp/demo && cd /tmp/demo && armcal demo && test -s build/demo/report.html'
