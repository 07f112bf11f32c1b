# `make` prints what can be asked for. Whatever a target needs is installed once, and said.

CARGO_TARGET_DIR ?= $(CURDIR)/target
export CARGO_TARGET_DIR
export TEAMPULSE := $(CARGO_TARGET_DIR)/release/teampulse

ready := $(CARGO_TARGET_DIR)/ready
python := .venv/bin/python
nextest := $(shell command -v cargo-nextest 2>/dev/null)
# Programs that measure have no tests of their own: lints compile them.
tested := --workspace --exclude 'bench-*'
fuzz_secs ?= 60
# Most end-to-end tests wait for a session: several run side by side, each process on a network of its own.
processes ?= 6
# They run the binary with which the crates are tested, its assertions included, so that libraries are compiled once;
# `binary=release` tests the one for sessions.
binary ?= debug

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-15s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# --- using it

# Compiled without optimisation in a third of the time, unless the optimised binary exists.
demo_profile := $(if $(wildcard $(TEAMPULSE)),release,demo)

demo: $(ready)-build ## a simulated operator and five robots on ROS 2, watched and recorded, until q, then y (ARGS="--duration 60")
	cargo build --profile $(demo_profile) --locked --package teampulse
	$(CARGO_TARGET_DIR)/$(demo_profile)/teampulse demo $(ARGS)

picture: build ## docs/demo.svg, made anew from the demo's screen
	@.ci/apt-install "to see the demo's screen" tmux
	docs/screenshot.py

build: $(ready)-build ## the binary for sessions, in target/release
	cargo build --release --locked --package teampulse

web: web/node_modules/.package-lock.json ## the dashboard's pages, built from web/ into crates/dashboard/assets (needs Node.js)
	cd web && npm run --silent check && npm test --silent && npm run --silent build

web/node_modules/.package-lock.json: web/package-lock.json
	cd web && npm ci --silent --no-audit --no-fund

# --- testing it

test: peers test-rust test-peers ## every test: of the crates, and of the binary with independent peers

test-build: $(ready)-build
	cargo test --no-run $(tested) --locked --quiet

test-rust: test-build ## the tests of the crates
	@.ci/apt-install "to test Bluetooth wearables" dbus-daemon
ifdef nextest
	tests/isolated cargo nextest run $(tested) --offline
	tests/isolated cargo test $(tested) --offline --doc --quiet
else
	tests/isolated cargo test $(tested) --offline
endif

test-peers: export TEAMPULSE := $(CARGO_TARGET_DIR)/$(binary)/teampulse
test-peers: $(if $(filter release,$(binary)),build,test-build) peers ## the binary, end to end (ARGS="-k replay" for a part)
	$(python) -m ruff check --quiet bench docs tests
	tests/isolated $(python) -m pytest tests -n $(processes) --dist loadfile --no-loadscope-reorder $(ARGS)

test-vm: build .venv/ready .venv-vm/ready target/vm/kernel/ready ## straps through a real Bluetooth stack, and the kernel's own camera, keyboard, mouse and sound card, under qemu (Debian on x86-64; 8 minutes)
	$(python) -m pytest tests/vm $(ARGS)

check: lint $(if $(shell command -v npm),check-web) ## format, lints and unit tests: before every commit
	$(if $(nextest),cargo nextest run --workspace --lib --bins,cargo test --workspace --lib --bins --quiet)

check-web: web ## the dashboard's pages: types, tests, and that those committed are what web/ builds
	@git diff --exit-code --stat -- crates/dashboard/assets || { echo "crates/dashboard/assets is not what web/ builds: commit it with its source"; exit 1; }

lint: $(ready)-build ## format, words and lints
	cargo fmt --all --check
	.ci/words
	cargo clippy --workspace --all-targets --locked -- --deny warnings
	$(if $(shell command -v cargo-deny),cargo deny --log-level error check,@echo "cargo-deny is not installed: licences are not checked")

# SQLite and Cyclone DDS have statics of one name in several files, which the sanitizer takes for one.
fuzz: ## arbitrary bytes into every decoder, for fuzz_secs=60 each (needs cargo-fuzz and a nightly Rust)
	cd fuzz && for target in $$(cargo +nightly fuzz list); do \
	  ASAN_OPTIONS=detect_odr_violation=0 cargo +nightly fuzz run $$target -- -max_total_time=$(fuzz_secs) || exit 1; done

# --- measuring it: each folder of bench/ has a program `run`, which prints a line a figure

bench: $(patsubst bench/%/run,bench-%,$(sort $(wildcard bench/*/run))) ## every figure; fails when one misses its bar

bench-%: build peers
	bench/$*/run $(ARGS)

bench-ros: ## the bus alone: losses, latency and CPU
bench-bag: ## the bag writer against ROS 1's
bench-recorder: ## from a publisher in another process into the bag: losses and CPU
bench-crash: ## kill -9 at 20 random moments: what the bag still holds
bench-timefilter: ## the time filter against message_filters: sets, speed, accuracy
bench-people: ## 30 simulated operators over ROS for 6 minutes: what features find, cost, and how late they are
bench-soak: ## eight accelerated hours, very many topics and robots, bad workers: memory, CPU and delays
bench-wearables: ## everything that a person can wear, and 30 straps: CPU, losses, and how soon readings are recorded
bench-cameras: ## two cameras, a microphone and all wearables, with and without a model: CPU, losses, delays; faces hidden in 10,000 pictures
bench-dashboard: ## the dashboard in a browser without a GPU: frames, latency, CPU, cameras; many viewers, a slow link, a long replay, eight accelerated hours
bench-signal: .venv/signal-ready ## signals of people: accuracy on recorded ones, speed against NeuroKit2, voices against Praat and librosa

# --- setting up

setup: $(ready)-build peers ## all that the other targets install, and nothing else

peers: $(ready)-peers $(if $(shell command -v npm),web/node_modules/.package-lock.json) .venv/ready .venv-myo/ready tests/build/fastdds_peer

$(ready)-build:
	@.ci/apt-install "to build teampulse" build-essential cmake libclang-dev pkg-config
	@mkdir -p $(@D) && touch $@

$(ready)-peers:
	@.ci/apt-install "to test on a network of its own" iproute2 util-linux
	@.ci/apt-install "to test Bluetooth wearables" dbus-daemon
	@.ci/apt-install "to test the dashboard's pages" --if-available chromium
	@.ci/apt-install "to test microphones with known speech" espeak-ng pulseaudio pulseaudio-utils
	@.ci/apt-install "to test keyboards and mice" --if-available xvfb xdotool
	@.ci/apt-install "to test against Fast DDS" --if-available fastddsgen g++ libfastrtps-dev
	@mkdir -p $(@D) && touch $@

.venv/ready: tests/peers/requirements.txt
	@python3 -c 'import ensurepip, venv' 2>/dev/null || .ci/apt-install "to test against Python peers" python3-venv
	@echo "setting up .venv with the Python peers of tests/peers/requirements.txt"
	@python3 -m venv .venv
	@.venv/bin/pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

.venv-myo/ready: tests/peers/requirements-myo.txt .venv/ready
	@echo "setting up .venv-myo with dl-myo, which needs an older bleak"
	@python3 -m venv .venv-myo
	@.venv-myo/bin/pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

.venv-vm/ready: tests/vm/requirements.txt
	@echo "setting up .venv-vm with the Bluetooth devices of tests/vm/requirements.txt"
	@python3 -m venv .venv-vm
	@.venv-vm/bin/pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

target/vm/kernel/ready: tests/vm/get-kernel
	@.ci/apt-install "to test with a Bluetooth stack and devices of the kernel in a virtual machine" qemu-system-x86 bluez dbus kmod v4l-utils pulseaudio pulseaudio-utils
	@tests/vm/get-kernel $(@D) && touch $@

.venv/signal-ready: bench/signal/requirements.txt .venv/ready
	@.ci/apt-install "to measure voice activity in known speech" espeak-ng
	@echo "adding the Python peers of bench/signal/requirements.txt to .venv"
	@.venv/bin/pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

tests/build/fastdds_peer: $(wildcard tests/peers/fastdds/*) | $(ready)-peers
	@tests/peers/fastdds/build $@

.PHONY: help demo picture build web check-web test test-build test-rust test-peers test-vm check lint fuzz bench setup peers
