#!/bin/bash
# Measures a GPU, from the repository's root: tools/gpu/measure.sh FOLDER
#
# The tests that hold its pictures against a processor's, then what the parts of a frame cost, by
# day, by night and in rain, then a first picture, cold and warm. About four minutes on a
# data-centre GPU. A machine without one says so at once.
set -euo pipefail
out=${1:?give a folder for what is measured}
mkdir -p "$out"
sumo3dviz-pt doctor | tee "$out/doctor.txt"
python -m pytest -q -m "slow or not slow" tests/film/test_gpu.py | tee "$out/test_gpu.txt"
parts() { python tests/bench/frame_parts.py --variant cuda -o "$out/$1" --size "$1" "${@:2}"; }
parts 1280x720 --presets preview standard
parts 1920x1080 --presets standard --films overview driver
still=(sumo3dviz-pt still examples/ronda/scene.yaml --camera overview --time 488 --variant cuda)
for turn in cold warm; do
    /usr/bin/env time -f "$turn: %e s, %U CPU-s" "${still[@]}" --quality preview --size 480x270 \
        --overwrite -o "$out/first.png" 2>&1 | tee -a "$out/first.txt"
done
