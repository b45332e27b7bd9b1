#!/bin/sh
# Compares this crate's fusion with MRPT's and with the crate `costmap` on the same readings, in one run, in turn;
# CPU time of one thread each, the median of REPEATS.
#   run.sh sonar|laser FILE [REPEATS]
# FILE: one scan per line, `x y heading range...`. Needs Debian's libmrpt-maps-dev and libmrpt-obs-dev, cmake, a C++ compiler;
# without MRPT it is left out, and said so. The maps of sonar are left in $TMPDIR/global-grid-peers: mrpt.pgm, costmap.pgm,
# ours-CALCULUS.pgm.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
kind=$1 file=$2 repeats=${3:-31}
build=${TMPDIR:-/tmp}/global-grid-peers
mkdir -p "$build"
mrpt=no
if cmake -S "$here" -B "$build" -DCMAKE_BUILD_TYPE=Release > "$build/cmake.log" 2>&1 \
    && cmake --build "$build" >> "$build/cmake.log" 2>&1; then
    mrpt=yes
else
    echo "MRPT is left out: $build/cmake.log says why" >&2
fi
cargo build --release --quiet --manifest-path "$here/costmap/Cargo.toml" --target-dir "$build/costmap"
cargo build --release --quiet --manifest-path "$here/../../Cargo.toml" --example known_poses
target=${CARGO_TARGET_DIR:-$here/../../../../target}
for turn in 1 2 3; do
    if [ $mrpt = yes ]; then "$build/mrpt_grid" "$kind" "$file" "$repeats" "$build/mrpt.pgm"; fi
    "$build/costmap/release/costmap-grid" "$kind" "$file" "$repeats" "$build/costmap.pgm"
    for calculus in fuzzy bayes dempster-shafer; do
        printf '%s ' "$calculus"
        "$target/release/examples/known_poses" "$kind" "$file" "$repeats" "$build/ours-$calculus" "$calculus"
    done
done
