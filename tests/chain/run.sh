#!/usr/bin/env bash
# The whole way on images: a run that no model has seen is simulated, rendered as four webcams see it, the cameras are found, the balls tracked,
# truth and states paired, and the shipped models judged against that truth and against the simulator's own. Some 3 minutes for 20 s of motion.
# usage: run.sh DIRECTORY [SECONDS [SCENE]]
set -eu
cd "$(dirname "$0")/../.."
work=$(realpath -m "$1")
seconds=${2:-20}
scene=${3:-hard}
ravenpose=$PWD/target/release/ravenpose
models=$PWD/models
rm -rf "$work"
mkdir -p "$work"
cd "$work"

minutes=$(python3 -c "print(($seconds + 10) / 60)")
"$ravenpose" simulate --minutes "$minutes" --run-minutes "$minutes" --seed 77 --homing-seed 1 --robot raven2-worn --out runs > simulate.txt
"$models/see.sh" runs/run_0001.mcap "$seconds" "$scene" seen seen.mcap
mv seen/run.mcap run.mcap

for run in seen run; do
  for model in raven2-worn raven2-worn-orientation; do
    "$ravenpose" evaluate --alone --model "$models/$model.onnx" --data $run.mcap --out "report-$run-$model" > "$run-$model.txt"
  done
done
# Against the cameras, and against the simulator: the first holds what the cameras are off by as well.
python3 - << 'PYTHON'
import json, sys
def left(run, model):
    methods = {one["name"]: one["exact"]["vector"]["rms"] for one in json.load(open(f"report-{run}-{model}/report.json"))["methods"]}
    return methods["raw"], methods["model"]
good = True
# Of the cameras themselves: mm and degrees.
for model, unit, own in [("raven2-worn", "mm", 0.5), ("raven2-worn-orientation", "deg", 0.4)]:
    seen, true = left("seen", model), left("run", model)
    print(f"by the cameras: {seen[0]:.3f} {unit} RMS as reported, {seen[1]:.3f} with the model")
    print(f"by the simulator: {true[0]:.3f} {unit} RMS as reported, {true[1]:.3f} with the model")
    good &= abs(seen[0] - true[0]) < 0.2 and seen[1] < (true[1] ** 2 + own ** 2) ** 0.5
sys.exit(not good)
PYTHON
