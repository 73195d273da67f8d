#!/usr/bin/env bash
# The main job on real input: a stand-in for RAVEN's control process, the service and a C++ client, as three processes.
# usage: demo.sh [RECORDING]; called by `make demo`, which builds what it needs.
# Exit status 0 only if every state was answered in order with the right fields.
set -u
cd "$(dirname "$0")/../.."
bin=build/stage/bin
run=${1:-}
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

echo "ravenpose demo (research software, no clinical use)"
if [ -n "$run" ]; then
  echo "recording: $run"
elif [ -f "$recording" ]; then
  run=$recording
  echo "recording: $run (real RAVEN-II, 3 motors)"
else
  echo "no recording at hand: a simulated arm, worn as the paper's was, 20 s (make demo RUN=FILE for your own)"
  $bin/ravenpose simulate --robot raven2-worn --minutes 0.3333333 --seed 1 --out "$work/simulated" | sed 's/^/  /'
  [ "${PIPESTATUS[0]}" -eq 0 ] || exit 2
  run=$work/simulated/run_0001.mcap
fi
$bin/ravenpose convert "$run" "$work/run.rvs" | sed 's/^/  /'
[ "${PIPESTATUS[0]}" -eq 0 ] || exit 2
# Where the recording knows it, the true tip is shown beside the corrected one.
truth=
if $bin/ravenpose convert "$run" "$work/truth.csv" > /dev/null 2>&1 && grep -m1 -q '^t_s.*truth_x_mm.*truth_z_mm' "$work/truth.csv"; then
  truth="--truth $work/truth.csv"
fi

cores=$(nproc)
if [ "$cores" -ge 2 ]; then robot_core=0; service_core=1; else robot_core=0; service_core=0; fi
cat > "$work/ravenposed.toml" <<END
# The shipped model is not trained yet: its numbers show the path, not a better position.
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
model = "$PWD/models/untrained.onnx"
[green]
model = "$PWD/models/untrained.onnx"
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
sleep 0.3
echo "playing at 1 kHz: stand-in on core $robot_core, service on core $service_core ..."
$bin/standin "$work/run.rvs" --seconds 20 --core $robot_core --priority 90 --wait-readers 1 > "$work/standin.log" 2>&1 & standin=$!
wait $standin; standin_code=$?; standin=
wait $client; client_code=$?; client=
kill -TERM $service; wait $service; service_code=$?; service=

echo
sed 's/^/  stand-in: /' "$work/standin.log"
sent=$(sed -n 's/^sent \([0-9]*\) .*/\1/p' "$work/standin.log")
answered=$(sed -n 's/^  states answered [0-9]* of \([0-9]*\);.*/\1/p' "$work/client.log")
cat "$work/client.log"
echo
$bin/ravenpose stats --runtime-dir "$work/run" | sed -n '/latency/,/^$/p'
echo "  service said:"
sed 's/^ravenposed: /    /' "$work/service.log"
echo
code=0
[ "$standin_code" -eq 0 ] || { echo "demo: the stand-in failed"; code=1; }
[ "$client_code" -eq 0 ] || { echo "demo: the client found a fault"; code=1; }
[ "$service_code" -eq 0 ] || { echo "demo: the service ended with $service_code"; code=1; }
[ -n "$sent" ] && [ "$sent" = "$answered" ] || { echo "demo: $sent states were sent, the last one answered is $answered"; code=1; }
[ "$code" -eq 0 ] && echo "demo: $sent states sent, all accounted for, none reordered, every field right"
exit $code
