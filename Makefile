# ravenpose: `make demo` runs the main job, `make test` all tests; both do the set-up that they need.
# Needed beforehand: Rust with cargo, a C++ compiler, Python 3 and make.

PREFIX ?= /usr/local
DESTDIR ?=
BUILD := build
STAGE := $(CURDIR)/$(BUILD)/stage
VERSION := 0.1.0
CARGO ?= cargo
PYTHON3 ?= python3
# One profile for everything: every further one builds tract once more.
CARGO_FLAGS := --release --locked
CFLAGS_STRICT := -O2 -Wall -Wextra -Werror
# The examples find the library where it will be installed, relative to themselves.
RPATH := -Wl,-rpath,'$$ORIGIN/../lib'
PYTHON := $(CURDIR)/$(BUILD)/venv/bin/python3

.PHONY: all build offline demo test install stage examples venv bench bench-ci bench-peers bench-soak bench-neighbours bench-offline worn model prove prove-small faults fuzz emulated chain lint clean

all: build offline examples

# --all-targets: tests and programs share one resolution of features, so nothing is built twice.
build:
	$(CARGO) build $(CARGO_FLAGS) --workspace --all-targets

offline: build
	cd offline && $(CARGO) build $(CARGO_FLAGS) --workspace --all-targets

# Into a folder of our own, as a user would install it.
stage: build offline
	@mkdir -p $(BUILD)
	$(MAKE) --no-print-directory install PREFIX=$(STAGE) DESTDIR=

install:
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/lib/cmake/ravenpose
	install -d $(DESTDIR)$(PREFIX)/include $(DESTDIR)$(PREFIX)/share/ravenpose/models/examples $(DESTDIR)$(PREFIX)/share/doc/ravenpose
	install -m 755 target/release/ravenposed $(DESTDIR)$(PREFIX)/bin/
	if [ -x target/release/ravenpose ]; then install -m 755 target/release/ravenpose $(DESTDIR)$(PREFIX)/bin/; fi
	for p in ravenpose-generate ravenpose-score; do if [ -x target/release/$$p ]; then install -m 755 target/release/$$p $(DESTDIR)$(PREFIX)/bin/; fi; done
	install -m 644 bridge/include/ravenpose.h bridge/include/ravenpose.hpp $(DESTDIR)$(PREFIX)/include/
	install -m 644 target/release/libravenpose_bridge.a $(DESTDIR)$(PREFIX)/lib/
	install -m 755 target/release/libravenpose_bridge.so $(DESTDIR)$(PREFIX)/lib/libravenpose_bridge.so.1
	ln -sf libravenpose_bridge.so.1 $(DESTDIR)$(PREFIX)/lib/libravenpose_bridge.so
	sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@VERSION@|$(VERSION)|' bridge/pkgconfig/ravenpose.pc.in > $(DESTDIR)$(PREFIX)/lib/pkgconfig/ravenpose.pc
	install -m 644 bridge/cmake/ravenposeConfig.cmake $(DESTDIR)$(PREFIX)/lib/cmake/ravenpose/
	sed -e 's|@VERSION@|$(VERSION)|' bridge/cmake/ravenposeConfigVersion.cmake.in > $(DESTDIR)$(PREFIX)/lib/cmake/ravenpose/ravenposeConfigVersion.cmake
	install -m 644 models/raven2-*.toml models/gap-vocabulary.json models/gap-report.schema.json $(DESTDIR)$(PREFIX)/share/ravenpose/models/
	install -m 644 models/examples/*.toml $(DESTDIR)$(PREFIX)/share/ravenpose/models/examples/
	cp -R systemd $(DESTDIR)$(PREFIX)/share/ravenpose/
	install -m 644 models/untrained.onnx models/untrained.onnx.sha256 models/raven2-worn.onnx models/raven2-worn.onnx.sha256 \
	  models/raven2-worn-orientation.onnx models/raven2-worn-orientation.onnx.sha256 \
	  $(DESTDIR)$(PREFIX)/share/ravenpose/models/
	install -m 644 README.md LICENSE-MIT LICENSE-APACHE docs/*.md $(wildcard docs/*.svg) $(DESTDIR)$(PREFIX)/share/doc/ravenpose/

# Against the staged installation, as C99 and C++17, without a warning.
examples: stage
	for f in bridge/examples/c/*.c; do \
	  $(CC) -std=c99 $(CFLAGS_STRICT) -I$(STAGE)/include $$f -o $(STAGE)/bin/$$(basename $$f .c) -L$(STAGE)/lib -lravenpose_bridge $(RPATH) || exit 1; done
	for f in bridge/examples/cxx/*.cpp; do \
	  $(CXX) -std=c++17 $(CFLAGS_STRICT) -I$(STAGE)/include $$f -o $(STAGE)/bin/$$(basename $$f .cpp) -L$(STAGE)/lib -lravenpose_bridge $(RPATH) || exit 1; done

# RUN=FILE plays a recording of your own, MODEL=FILE with a model of your own.
demo: offline examples
	bridge/examples/demo.sh "$(RUN)" $(if $(MODEL),"$(MODEL)")

# The official iceoryx2 package for the independent client, and CMake for the packaging test.
# Where there is none to be had, the tests that want them say that they skip.
venv: $(BUILD)/venv/.done
$(BUILD)/venv/.done: tests/python/requirements.txt
	mkdir -p $(BUILD)
	$(PYTHON3) -m venv $(BUILD)/venv || { rm -rf $(BUILD)/venv; \
	  { [ "$$(id -u)" = 0 ] && apt-get update -q && apt-get install -qy python3-venv && $(PYTHON3) -m venv $(BUILD)/venv; }; } || \
	  echo "note: no virtual environment for Python here: install python3-venv"
	if $(PYTHON) -m pip install --quiet --disable-pip-version-check -r tests/python/requirements.txt; then touch $@; \
	else echo "note: the Python package iceoryx2 cannot be installed here: its test will skip"; fi

# Ends with a line "N passed, N failed".
test: offline examples venv
	tests/run.sh $(STAGE) $(PYTHON)

# 10,000 kills and restarts of each process in KILL_LANES worlds at a time, a hundred million cycles of mixed faults, random bytes: 45 minutes with the machine to
# itself.
KILL_LANES ?= 3
faults: build
	RAVENPOSE_KILLS=10000 RAVENPOSE_KILL_LANES=$(KILL_LANES) $(CARGO) test $(CARGO_FLAGS) --workspace --test processes -- --nocapture fifty_kills
	RAVENPOSE_FAULT_CYCLES=100000000 $(CARGO) test $(CARGO_FLAGS) --workspace --test faults -- --nocapture a_million_cycles
	RAVENPOSE_FAULT_CYCLES=1000000000 $(CARGO) test $(CARGO_FLAGS) --workspace --test faults -- f18_random

# Simulation, images, tracking, pairs, the shipped model's error: some 3 minutes.
chain: offline
	tests/chain/run.sh $(BUILD)/chain

# The kernels on processors that this machine is not: NEON under QEMU, AVX-512 with VNNI under Bochs. Root, 4 GB, an hour; EMULATED=neon or
# avx512 for one of them.
emulated:
	tests/emulated/run.sh $(BUILD)/emulated $(EMULATED)

# Two minutes: the network beside tract, and input to output through shared memory, in one run.
bench-ci: build
	target/release/ravenpose-bench ci

# Writes docs/performance.md and .svg, and build/bench/results.json.
bench: build venv bench-offline
	target/release/ravenpose-bench full --write

# What it costs the others when clients or the service are killed, or 126 clients never read: NEIGHBOUR_MINUTES of each condition, seven in all, and a
# fifth more between them.
NEIGHBOUR_MINUTES ?= 3
bench-neighbours: build
	target/release/ravenpose-bench neighbours $(NEIGHBOUR_MINUTES)

# Half an hour of the service with memory and disk busy, 126 idle clients and faults in what it is sent; fails on a wrong answer, a loss
# or a page fault. SOAK_MINUTES=N for another time.
SOAK_MINUTES ?= 30
bench-soak: build
	target/release/ravenpose-bench soak $(SOAK_MINUTES)

# OpenVINO in the same tables, and the network as the published scripts run it (Keras): packages of 2 GB.
bench-peers: build venv $(BUILD)/peers/.done
	RAVENPOSE_BENCH_ONLY=kernel target/release/ravenpose-bench full
	$(BUILD)/peers/bin/python3 bench/keras_predict.py --out $(BUILD)/bench/peers.txt

$(BUILD)/peers/.done: bench/requirements-peers.txt
	mkdir -p $(BUILD)
	$(PYTHON3) -m venv $(BUILD)/peers
	$(BUILD)/peers/bin/python3 -m pip install --quiet --disable-pip-version-check -r bench/requirements-peers.txt
	touch $@

# Simulator and recordings: times real time, MB/s, peak memory.
bench-offline: offline
	$(PYTHON3) bench/offline.py --out $(BUILD)/bench/offline.txt

# How far the shipped robots are off, over twenty homings.
worn: offline
	target/release/examples/worn

# Concealed-truth trials of `ravenpose gap` (docs/proof.md): a few minutes, or the whole matrix, hours. Stopped, they go on where
# they were. Exit status 1 if a target of the design is missed.
PROOF_SEED ?= 1
prove-small: offline
	target/release/ravenpose prove --matrix small --seed $(PROOF_SEED) --out $(BUILD)/proof/small-$(PROOF_SEED)

prove: offline
	target/release/ravenpose prove --matrix full --seed $(PROOF_SEED) --out $(BUILD)/proof/full-$(PROOF_SEED)

# The shipped models again, from nothing: simulate 140 minutes after one homing (4 GB in build/training), let cameras see the first minute of
# one run and take that in its place, train for the position and for the orientation, judge on the runs that training left sealed.
# MODEL_PRESET=one-state for the same without a memory. Four sessions of 35 minutes: cold starts, and an arm that has warmed up.
MODEL_PRESET ?= default
TRAINING := $(BUILD)/training
SESSION := 7
# By cameras instead of the simulator; the split of seed 1 learns from it.
SEEN := run_0002
DATA = $$(ls $(TRAINING)/runs/run_*.mcap | sed 's|.*/$(SEEN).mcap|$(TRAINING)/$(SEEN)_seen.mcap|')
model: offline
	if ! grep -qs "per session = $(SESSION)" $(TRAINING)/runs/simulation.txt; then rm -rf $(TRAINING)/runs $(TRAINING)/$(SEEN)_seen.mcap; \
	  target/release/ravenpose simulate --minutes 140 --seed 1 --homing-seed 1 --runs-per-session $(SESSION) --robot raven2-worn --out $(TRAINING)/runs; fi
	if [ ! -f $(TRAINING)/$(SEEN)_seen.mcap ]; then \
	  models/see.sh $(TRAINING)/runs/$(SEEN).mcap 60 hard $(TRAINING)/seen $(TRAINING)/$(SEEN)_seen.mcap; fi
	target/release/ravenpose train --data $(DATA) --preset $(MODEL_PRESET) --truth-noise 0.5 --seed 1 --out $(TRAINING)/raven2-worn.onnx
	target/release/ravenpose evaluate --model $(TRAINING)/raven2-worn.onnx --data $(DATA) --seed 1 --out $(TRAINING)/report
	target/release/ravenpose train --data $(DATA) --preset $(MODEL_PRESET) --target orientation --truth-noise 0.5 --seed 1 \
	  --out $(TRAINING)/raven2-worn-orientation.onnx
	target/release/ravenpose evaluate --model $(TRAINING)/raven2-worn-orientation.onnx --data $(DATA) --seed 1 --out $(TRAINING)/report-orientation

# Every reader of recordings under cargo-fuzz, FUZZ_SECONDS each.
FUZZ_SECONDS ?= 600
fuzz:
	command -v cargo-fuzz > /dev/null || $(CARGO) install --locked cargo-fuzz
	for target in mcap rosbag ravenstate_message text_columns tidy_csv parquet statefile; do \
	  RUSTC_BOOTSTRAP=1 $(CARGO) fuzz run $$target -- -max_total_time=$(FUZZ_SECONDS) -max_len=65536 || exit 1; done

lint:
	$(CARGO) fmt --all --check
	cd offline && $(CARGO) fmt --all --check
	$(CARGO) clippy $(CARGO_FLAGS) --workspace --all-targets -- -D warnings
	cd offline && $(CARGO) clippy $(CARGO_FLAGS) --workspace --all-targets -- -D warnings

clean:
	rm -rf $(BUILD) target
