#!/usr/bin/env bash
# tests - does what a page of docs says, block by block, in a copy of the tree, or with an installed armcal in an empty folder.
#   follow.sh PAGE FOLDER [ARMCAL]
# A block whose first line is a comment with a path is that file; "sh" is run; "text" and "diff" are what the last "sh"
# printed. FOLDER is emptied; ARMCAL stands for build/host/armcal. Without it FOLDER stays empty, and armcal is the one of the PATH.
# A program that a page leaves running is named by a file *.pid.
set -euo pipefail
page=$(realpath "$1") folder=$(realpath -m "$2") armcal=${3:+$(realpath "$3")} top=$PWD

rm -rf "$folder"
# A page that fails leaves no drive behind.
trap 'find "$folder" -name "*.pid" 2>/dev/null | while read -r pid; do kill "$(cat "$pid")" 2>/dev/null || true; done' EXIT
mkdir -p "$folder/blocks"
cd "$folder"
export XDG_CACHE_HOME=$PWD/cache  # nothing is compiled yet
if [[ -n $armcal ]]; then
  cp -r "$top"/{codegen,lib,port,host_sim,toolchains,docs,CMakeLists.txt,LICENSE,package.xml,*.md} .
  mkdir -p build/host
  ln -s "$armcal" build/host/armcal
  export PATH=$PWD/build/host:$PATH
  git init -q . && git add codegen && git -c user.name=test -c user.email=test commit -qm before
fi

# blocks/01.sh, blocks/02.toml, ...
awk '/^```[a-z]/ { kind = substr($0, 4); name = sprintf("blocks/%02d.%s", ++n, kind); printf "" > name; next }
     /^```/ { name = ""; next }
     name { print > name }' "$page"

for block in blocks/*; do
  case $block in
    *.sh)
      echo "== $(basename "$page"), $block"
      cat "$block"
      bash -euo pipefail "$block" >out.txt 2>err.txt || {
        cat out.txt err.txt
        find . -name "*.pid" | while read -r pid; do tail -n 20 "${pid%.pid}.txt" || true; done  # what the drive said
        echo "FAILED: $block"
        exit 1
      } ;;
    *.text | *.diff)
      diff -u "$block" out.txt || { echo "FAILED: the page shows another output (left) than its commands print (right)"; exit 1; } ;;
    *)
      path=$(sed -n '1s,^\(#\|//\|<!--\) \([A-Za-z0-9_/.]*\).*,\2,p' "$block")
      [[ -n $path ]] || { echo "FAILED: $block: its first line names no file"; exit 1; }
      mkdir -p "$(dirname "$path")"
      cp "$block" "$path" ;;
  esac
done
