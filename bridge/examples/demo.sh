#!/usr/bin/env bash
# The main job: a stand-in for RAVEN's control process, the service and a C++ client, as three processes. First on a recording of a
# real robot, where one is at hand, with a network of random weights: the path and its latencies. Then on a simulated worn arm with
# the model that was trained for it: raw and corrected position beside the true one.
# usage: demo.sh [RECORDING [MODEL]]; called by `make demo`, which builds what it needs. With a recording, only that one is played.
# Exit status 0 only if every state was answered in order with the right fields.
set -u
cd "$(dirname "$0")/../.."
bin=build/stage/bin
run=${1:-}
model=${2:-models/untrained.onnx}
recording=../shared/data/raven2-uiuc/real_first_two_thirds.csv
work=$(mktemp -d "${TMPDIR:-/tmp}/ravenpose-demo.XXXXXX")
# A world of our own: a running robot on this machine is not disturbed, and nothing of ours stays.
export RAVENPOSE_PREFIX="rpdemo$$_"
export RAVENPOSE_ROOT="$work/iceoryx2/"
service= client= standin=

clean() {
  # A second Ctrl-C must not stop the cleaning.
  trap - EXIT
  trap '' INT TERM HUP
  local pids="$standin $client $service"
  # shellcheck disable=SC2086
  [ -z "${pids// /}" ] || kill -TERM $pids 2>/dev/null
  for _ in $(seq 1 40); do [ -n "$(jobs -rp)" ] || break; sleep 0.05; done
  # shellcheck disable=SC2046
  [ -z "$(jobs -rp)" ] || kill -KILL $(jobs -rp) 2>/dev/null
  wait 2>/dev/null
  rm -rf "$work"
  rm -f /dev/shm/"$RAVENPOSE_PREFIX"*
}
trap 'clean' EXIT
trap 'echo; echo "demo: interrupted"; clean; exit 130' INT TERM HUP

# play RECORDING MODEL [ORIENTATION_MODEL]: up to 20 s; sets `code` to 1 at any fault.
play() {
  local run=$1 model=$2 orientation=${3:-} truth=
  rm -f "$work"/run.rvs "$work"/truth.csv "$work"/*.log
  $bin/ravenpose convert "$run" "$work/run.rvs" | sed 's/^/  /'
  [ "${PIPESTATUS[0]}" -eq 0 ] || exit 2
  # Where the recording knows it, the true tip is shown beside the corrected one.
  if $bin/ravenpose convert "$run" "$work/truth.csv" > /dev/null 2>&1 && grep -m1 -q '^t_s.*truth_x_mm.*truth_z_mm' "$work/truth.csv"; then
    truth="--truth $work/truth.csv"
  fi
  cat > "$work/ravenposed.toml" <<END
# A network of random weights shows the path, not a better position; without this its poses would be the robot's own.
allow_untrained = true
# Goes on without real-time rights, and says so.
allow_degraded = true
[transport]
prefix = "$RAVENPOSE_PREFIX"
root = "$RAVENPOSE_ROOT"
[loop]
core = $service_core
wait = "sleep"
[gold]
model = "$(realpath "$model")"
[green]
model = "$(realpath "$model")"
$([ -z "$orientation" ] || printf '[gold.orientation]\nmodel = "%s"\n' "$(realpath "$orientation")")
[report]
runtime_dir = "$work/run"
histogram_dir = "$work/histograms"
END
  $bin/ravenposed --config "$work/ravenposed.toml" > "$work/service.log" 2>&1 & service=$!
  for _ in $(seq 1 100); do
    grep -q '^ravenposed: running' "$work/service.log" && break
    kill -0 $service 2>/dev/null || { cat "$work/service.log" >&2; exit 2; }
    sleep 0.05
  done
  # shellcheck disable=SC2086
  $bin/demo_client "$work/run.rvs" --core $robot_core $truth > "$work/client.log" 2>&1 & client=$!
  for _ in $(seq 1 400); do
    grep -q '^connected' "$work/client.log" && break
    kill -0 $client 2>/dev/null || { cat "$work/client.log" >&2; exit 2; }
    sleep 0.05
  done
  echo "playing at 1 kHz: stand-in on core $robot_core, service on core $service_core ..."
  $bin/standin "$work/run.rvs" --seconds 20 --core $robot_core --priority 90 --wait-readers 1 > "$work/standin.log" 2>&1 & standin=$!
  wait $standin; local standin_code=$?; standin=
  wait $client; local client_code=$?; client=
  kill -TERM $service; wait $service; local service_code=$?; service=

  echo
  sed 's/^/  stand-in: /' "$work/standin.log"
  local sent answered failed=0
  sent=$(sed -n 's/^sent \([0-9]*\) .*/\1/p' "$work/standin.log")
  answered=$(sed -n 's/^  states answered [0-9]* of \([0-9]*\);.*/\1/p' "$work/client.log")
  grep -v '^connected' "$work/client.log"
  echo
  $bin/ravenpose stats --runtime-dir "$work/run" | sed -n '/latency/,/^$/p'
  echo "  service said:"
  sed 's/^ravenposed: /    /' "$work/service.log"
  echo
  [ "$standin_code" -eq 0 ] || { echo "demo: the stand-in failed"; failed=1; }
  [ "$client_code" -eq 0 ] || { echo "demo: the client found a fault"; failed=1; }
  [ "$service_code" -eq 0 ] || { echo "demo: the service ended with $service_code"; failed=1; }
  [ -n "$sent" ] && [ "$sent" = "$answered" ] || { echo "demo: $sent states were sent, the last one answered is $answered"; failed=1; }
  [ "$failed" -eq 0 ] && echo "demo: $sent states sent, all accounted for, none reordered, every field right"
  [ "$failed" -eq 0 ] || code=1
}

cores=$(nproc)
if [ "$cores" -ge 2 ]; then robot_core=0; service_core=1; else robot_core=0; service_core=0; fi
code=0
echo "ravenpose demo (research software, no clinical use)"
if [ -n "$run" ]; then
  [ -f "$model" ] || { echo "demo: $model: no such model; give an ONNX file: make demo RUN=FILE MODEL=FILE" >&2; exit 2; }
  echo "recording: $run"
  play "$run" "$model"
  exit $code
fi
if [ -f "$recording" ]; then
  echo
  echo "== 1. $recording (real RAVEN-II, 3 motors), random weights: the path, not a better position"
  play "$recording" models/untrained.onnx
  echo
  echo "== 2. a simulated arm"
else
  echo
  echo "== a simulated arm (no recording at hand; make demo RUN=FILE for your own)"
fi
echo "worn as the paper's was, with the model trained for it (docs/training.md), on a trajectory that it has not seen"
$bin/ravenpose simulate --robot raven2-worn --minutes 0.3333333 --seed 2026 --homing-seed 1 --out "$work/simulated" | sed 's/^/  /'
[ "${PIPESTATUS[0]}" -eq 0 ] || exit 2
play "$work/simulated/run_0001.mcap" models/raven2-worn.onnx models/raven2-worn-orientation.onnx
exit $code
