#!/usr/bin/env bash
# fuzz - runs libFuzzer on every target, or on those named, for so many seconds each. Needs clang (toolchains/install.sh fuzz).
#   tests/fuzz/fuzz.sh SECONDS [TARGET...]
# What it finds is kept in build/fuzz, so the next run goes on from there; the counts of all runs add up in build/fuzz/<target>.runs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
seconds=${1:?how many seconds}
shift
targets=("$@")
[[ ${#targets[@]} -gt 0 ]] || targets=(rtu tcp engine controller table vendor csv gzip robot mcap json)
mkdir -p build/fuzz

# The readers are linked with the same toml++ library as armcal. In the header-only form of toml++ 3.3 an assert fails on a table
# whose name begins with a wrong character, and the sanitizer stops at some letters outside ASCII. The library reports both as
# faults of the file.
flags=(-std=c++20 -O2 -g -ffp-contract=off -fsanitize=address,undefined -fno-sanitize-recover=undefined -I. -Ilib
  -isystem /usr/include/eigen3 -DFMT_HEADER_ONLY $(pkg-config --cflags tomlplusplus))
wire=(tests/fuzz/wire_targets.cpp host_sim/machine/drive/vendor_block.cpp lib/armcal/link/*.cpp lib/armcal/table/*.cpp)
readers=(tests/fuzz/reader_targets.cpp host_sim/data/files/*.cpp
  host_sim/data/bags/{recording,bag_folder,mapped_file,mcap,lz4,zstd,database,topic_table,definition,cdr,json_message}.cpp codegen/src/io/*.cpp
  codegen/src/robot/{robot,payload,import_urdf,no_urdf}.cpp host_sim/client/table_backup.cpp
  host_sim/diagnose/verdict/verdict_file.cpp)

# Coverage leaves out what steers no search: the standard library, the checksum, the nearest word, the stand-ins of the tests.
printf 'fun:%s\n' '_ZNSt*' '_ZNKSt*' '_ZSt*' '_ZN9__gnu_cxx*' '_ZNK9__gnu_cxx*' '_ZN6armcal4test*' '_ZN6armcal4core3crc*' \
  '_ZN6armcal4core10Crc32Words*' '_ZN6armcal2io7Nearest*' >build/fuzz/no_coverage
# The step of the checksum, a shift of one number, took a sixth of the engine's time with sanitizers. Its unit test has them.
echo 'fun:_ZN6armcal4core3crc*' >build/fuzz/no_sanitizers
flags+=(-fsanitize-coverage-ignorelist=build/fuzz/no_coverage -fsanitize-ignorelist=build/fuzz/no_sanitizers)
newest_header=$(find lib codegen host_sim tests -name '*.hpp' -printf '%T@ %p\n' | sort -n | tail -n 1 | cut -d ' ' -f 2-)
# The wire's targets record no comparisons: recording took 26 to 62 % of their time, and the search reaches as many edges without.
# The readers, whose formats have fixed words to be found, record them.
search_wire=(-fno-sanitize-coverage=trace-cmp) search_readers=()
for part in wire readers; do
  declare -n sources=$part search=search_$part
  mkdir -p "build/fuzz/$part"
  for source in "${sources[@]}"; do
    object=build/fuzz/$part/$(echo "$source" | tr / _).o
    [[ $object -nt $source && $object -nt tests/fuzz/fuzz.sh && $object -nt $newest_header ]] ||
      clang++ "${flags[@]}" -fsanitize=fuzzer-no-link "${search[@]}" -c "$source" -o "$object"
  done
done

# The longest input of each target, in bytes. It holds what the target tells apart: an action takes less than ten bytes, but for a
# request of random bytes. The corpus of engine and controller has the longest of those. Longer inputs repeat that, and cost their length.
declare -A max_len=([rtu]=512 [tcp]=512 [engine]=160 [controller]=160 [table]=256 [vendor]=512 [csv]=512 [gzip]=512 [robot]=2048
  [mcap]=2048 [json]=1024)
# Freed memory is watched until 8 MB more are freed, which is many inputs. A report shows one caller of an allocation; run the input that it
# names again, without these options, to see all.
export ASAN_OPTIONS=quarantine_size_mb=8:malloc_context_size=1${ASAN_OPTIONS:+:$ASAN_OPTIONS}

for target in "${targets[@]}"; do
  part=wire libraries=()
  case $target in
    csv | gzip | robot | mcap | json) part=readers libraries=(-lz -llz4 -lzstd -lsqlite3 $(pkg-config --libs tomlplusplus)) ;;
  esac
  clang++ "${flags[@]}" -fsanitize=fuzzer -DARMCAL_FUZZ="${target^}" tests/fuzz/entry.cpp build/fuzz/$part/*.o \
    "${libraries[@]}" -o "build/fuzz/fuzz_$target"
  mkdir -p "build/fuzz/corpus/$target"
  log=build/fuzz/$target.log
  limits=(-timeout=10 -rss_limit_mb=1500 -artifact_prefix="build/fuzz/$target-")
  # First each input of the repository as it is, since the search cuts those that are longer.
  { "build/fuzz/fuzz_$target" "${limits[@]}" "tests/fuzz/corpus/$target"/* &&
    "build/fuzz/fuzz_$target" "${limits[@]}" -max_total_time="$seconds" -max_len="${max_len[$target]}" -print_funcs=0 -entropic=0 \
      -print_final_stats=1 "build/fuzz/corpus/$target" "tests/fuzz/corpus/$target"; } >"$log" 2>&1 ||
    { tail -n 40 "$log"; echo "$target: FAILED"; exit 1; }
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -n 1)
  total=$((runs + $(cat "build/fuzz/$target.runs" 2>/dev/null || echo 0)))
  echo "$total" >"build/fuzz/$target.runs"
  echo "$target: $runs executions, $total in all runs"
done
