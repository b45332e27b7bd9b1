#!/bin/sh
# Compares this crate's fusion with MRPT's on the same readings, in one run; CPU time of one thread each.
#   run.sh sonar|laser FILE [REPEATS]
# Needs Debian's libmrpt-maps-dev and libmrpt-obs-dev, cmake, a C++ compiler. FILE: one scan per line, `x y heading range...`.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
kind=$1 file=$2 repeats=${3:-31}
build=${TMPDIR:-/tmp}/global-grid-peers
mkdir -p "$build"
cmake -S "$here" -B "$build" -DCMAKE_BUILD_TYPE=Release > "$build/cmake.log"
cmake --build "$build" >> "$build/cmake.log"
cargo build --release --quiet --manifest-path "$here/../../Cargo.toml" --example known_poses
target=${CARGO_TARGET_DIR:-$here/../../../../target}
for turn in 1 2 3; do
    "$build/mrpt_grid" "$kind" "$file" "$repeats" "$build/mrpt.pgm"
    "$target/release/examples/known_poses" "$kind" "$file" "$repeats" "$build/ours"
done
