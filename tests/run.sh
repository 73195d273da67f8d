#!/usr/bin/env bash
# Every test, and their sum in one line: "N passed, N failed". Called by `make test`, which has built everything.
# usage: run.sh STAGE PYTHON
set -u
cd "$(dirname "$0")/.."
stage=$1
python=$2
if "$python" -c 'import iceoryx2' 2>/dev/null; then export RAVENPOSE_PYTHON=$python; fi
log=$(mktemp "${TMPDIR:-/tmp}/ravenpose-test.XXXXXX")
trap 'rm -f "$log"' EXIT
status=0
run() { "$@" 2>&1 | tee -a "$log"; [ "${PIPESTATUS[0]}" -eq 0 ] || status=1; }

# One program after the other, and no two tests of one at a time where they need the machine's cores for themselves.
run cargo test --release --locked --workspace --no-fail-fast -- --show-output
( cd offline && cargo test --release --locked --workspace --no-fail-fast -- --show-output ) 2>&1 | tee -a "$log"
[ "${PIPESTATUS[0]}" -eq 0 ] || status=1
run tests/packaging/run.sh "$stage" "$(dirname "$python")"

echo
if [ "$status" -ne 0 ]; then
  echo "What failed, once more:"
  grep -hE -A4 "panicked at|FAILED\$|^error(:|\[)" "$log" | tail -n 60
fi
grep -ho 'skipped[: ].*' "$log" | sort | uniq -c | sed 's/^/  /'
passed=$(sed -n -e 's/^test result: .* \([0-9]*\) passed.*/\1/p' -e 's/^\([0-9]*\) passed, .* failed$/\1/p' "$log" | awk '{s+=$1} END {print s+0}')
failed=$(sed -n -e 's/^test result: .* \([0-9]*\) failed.*/\1/p' -e 's/^.* passed, \([0-9]*\) failed$/\1/p' "$log" | awk '{s+=$1} END {print s+0}')
# A program that does not build or dies without a result is a failure too.
if [ "$status" -ne 0 ] && [ "$failed" -eq 0 ]; then failed=1; fi
echo "$passed passed, $failed failed"
[ "$status" -eq 0 ] && [ "$failed" -eq 0 ]
