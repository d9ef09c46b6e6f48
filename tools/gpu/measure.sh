#!/bin/bash
# Measures a GPU, from the repository's root: tools/gpu/measure.sh FOLDER [VARIANT [SIZE [LARGE]]]
#
# The tests that hold its pictures against a processor's, then what the parts of a frame cost, by
# day, by night and in rain, then a first picture, cold and warm. About four minutes on a
# data-centre GPU. `llvm 160x90 320x180` rehearses it where there is none.
set -euo pipefail
out=${1:?give a folder for what is measured}
variant=${2:-cuda} size=${3:-1280x720} large=${4:-1920x1080}
mkdir -p "$out"
# Where there is no encoder `doctor` complains, but nothing here makes a film.
python3 -m sumo3dviz_pt.cli doctor | tee "$out/doctor.txt" || true
# What fails is told at the end, as time on such machines is short.
failed=0
python3 -m pytest -q -rs --noconftest -o addopts= tests/film/test_gpu.py | tee "$out/test_gpu.txt" ||
    failed=1
parts() { python3 tests/bench/frame_parts.py --variant "$variant" -o "$out/$1" --size "$@"; }
parts "$size" --presets preview standard
parts "$large" --presets standard --films overview driver
still=(python3 -m sumo3dviz_pt.cli still examples/ronda/scene.yaml --camera overview --time 488)
still+=(--variant "$variant" --quality preview --size 480x270 --overwrite -o "$out/first.png")
cache=$(mktemp -d)
export SUMO3DVIZ_PT_CACHE=$cache/ours DRJIT_CACHE_DIR=$cache/kernels
for turn in cold warm; do
    echo "$turn first picture" | tee -a "$out/first.txt"
    { time "${still[@]}"; } 2>&1 | tee -a "$out/first.txt"
done
rm -r "$cache"
exit $failed
