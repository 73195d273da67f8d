#!/usr/bin/env bash
# What cameras make of a recording: its first seconds rendered as four webcams see them, the cameras found from their chessboards and
# markers, the balls tracked, and states and truth paired. About ten seconds of work for one of motion.
# usage: see.sh RECORDING SECONDS SCENE WORK OUT
set -eu
ravenpose=$(realpath "$(dirname "$0")/../target/release/ravenpose")
recording=$(realpath "$1")
seconds=$2
scene=$3
work=$(realpath -m "$4")
out=$(realpath -m "$5")
rm -rf "$work"
mkdir -p "$work"
cd "$work"

"$ravenpose" convert "$recording" run.mcap --from 0 --to "$seconds" > convert.txt
"$ravenpose" vision render run.mcap --out scene --scene "$scene" --seed 5 --seconds "$seconds" > render.txt
"$ravenpose" vision calibrate scene --out cameras.toml
"$ravenpose" vision track scene --cameras cameras.toml --out truth.csv > track.txt 2>&1
# A lab measures the frame once, with markers on the base; the renderer knows it.
python3 - << 'PYTHON'
import json
frame = json.load(open("scene/registration_true.json"))["world_to_frame_0"]
with open("cameras.toml", "a") as file:
    file.write(f"\n[registration]\nrotation = {frame['rotation']}\ntranslation_mm = {frame['translation_mm']}\n")
PYTHON
"$ravenpose" pair run.mcap --truth truth.csv --cameras cameras.toml --clock-known --mounting-known --out "$out" > pair.txt
# Gigabytes.
rm -rf scene/frames
