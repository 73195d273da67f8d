#!/usr/bin/env bash
# The whole way on images: a run that no model has seen is simulated, rendered as four webcams see it, the cameras are found, the balls tracked,
# truth and states paired, and the shipped model judged against that truth and against the simulator's own. Some 3 minutes for 20 s of motion.
# usage: run.sh DIRECTORY [SECONDS [SCENE]]
set -eu
cd "$(dirname "$0")/../.."
work=$(realpath -m "$1")
seconds=${2:-20}
scene=${3:-hard}
ravenpose=$PWD/target/release/ravenpose
models=$PWD/models
model=$models/raven2-worn.onnx
rm -rf "$work"
mkdir -p "$work"
cd "$work"

minutes=$(python3 -c "print(($seconds + 10) / 60)")
"$ravenpose" simulate --minutes "$minutes" --run-minutes "$minutes" --seed 77 --homing-seed 1 --robot raven2-worn --out runs > simulate.txt
"$models/see.sh" runs/run_0001.mcap "$seconds" "$scene" seen seen.mcap
mv seen/run.mcap run.mcap

for run in seen run; do
  "$ravenpose" evaluate --alone --model "$model" --data $run.mcap --out "report-$run" > "$run.txt"
done
# Against the cameras, and against the simulator: the first holds what the cameras are off by as well.
python3 - << 'PYTHON'
import json, sys
def left(run):
    methods = {one["name"]: one["exact"]["vector"]["rms"] for one in json.load(open(f"report-{run}/report.json"))["methods"]}
    return methods["raw"], methods["model"]
seen, true = left("seen"), left("run")
print(f"by the cameras: {seen[0]:.3f} mm RMS as reported, {seen[1]:.3f} with the model")
print(f"by the simulator: {true[0]:.3f} mm RMS as reported, {true[1]:.3f} with the model")
# The cameras' own 0.5 mm and what the model leaves.
sys.exit(not (abs(seen[0] - true[0]) < 0.2 and seen[1] < (true[1] ** 2 + 0.5 ** 2) ** 0.5))
PYTHON
