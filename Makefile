# make demo · make test · make check · make bench · make wheels · make docs · make clean
# Needed beforehand: Python 3.10 or newer (PYTHON names another one) and Rust 1.89 or newer.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUST := $(shell find rust -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock

export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PYO3_PYTHON := $(VIRTUAL_ENV)/bin/python
# cargo runs as many jobs as there are cores, not as many as make.
CARGO := MAKEFLAGS= cargo
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_QUIET := 1
# The backend is maturin, by way of packaging/backend.py.
export MATURIN_NO_MISSING_BUILD_BACKEND_WARNING := 1

.PHONY: build demo test test-rust test-python test-checked fuzz fuzz-kernels interrupt mutants check lint-rust lint-python bench \
	docs docs-fields wheels test-aarch64 footprint boards audit docs-pictures clean

demo: build
	$(BIN)/python -m divespot demo

test: test-rust test-python

# While one core links the release, the other compiles the tests.
check:
	+$(MAKE) --jobs=2 build lint-rust test-rust
	+$(MAKE) lint-python test-python test-checked

build: $(VENV)/built

# maturin installs the dependency groups too, which needs pip 25.1.
$(VENV)/made:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "Python 3.10 or newer is needed")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --upgrade 'pip>=25.1' 'maturin>=1.9.4,<2'
	touch $@

$(VENV)/built: $(VENV)/made $(RUST) pyproject.toml
	$(BIN)/python -m maturin develop --release --extras plot --group dev --quiet
	@$(BIN)/python -m pip install --only-binary :all: hdbscan \
	|| echo 'hdbscan has no wheel for this machine: the tests against it are skipped'
	touch $@

# The binding has no tests: with it, test-checked finds its libraries compiled.
test-rust: $(VENV)/made
	$(CARGO) test --package divespot-core --package divespot-py --quiet

# On all cores, a file of tests in one process: they share what they simulate.
PYTEST := $(BIN)/python -m pytest -W error --numprocesses auto --dist loadfile

test-python: build
	$(PYTEST)

# The kernels again, built so that a sum that overflows or an assertion that fails is a panic.
CHECKED := target/debug/python
KERNELS := points voxel neighbors hdbscan histogram plane grid spacing

test-checked: build
	$(CARGO) build --quiet --package divespot-core --package divespot-py
	rm -rf $(CHECKED) && mkdir $(CHECKED) && cp -R python/divespot $(CHECKED)
	cp "$$(ls target/debug/lib_native.so target/debug/lib_native.dylib 2>/dev/null)" \
	"$$(ls $(CHECKED)/divespot/_native*.so)"
	PYTHONPATH=$(CHECKED) $(PYTEST) $(KERNELS:%=tests/test_%.py)

lint-rust: $(VENV)/made
	@if cargo fmt --version >/dev/null 2>&1; then echo cargo fmt --check; cargo fmt --all --check; \
	else echo 'NOT CHECKED: the format of Rust (rustup component add rustfmt)'; fi
	@if cargo clippy --version >/dev/null 2>&1; then echo cargo clippy; \
	$(CARGO) clippy --workspace --all-targets --quiet -- -D warnings; \
	else echo 'NOT CHECKED: the lints of Rust (rustup component add clippy)'; fi

lint-python: build
	$(BIN)/python -m ruff check --no-cache
	$(BIN)/python -m ruff format --no-cache --check
	$(BIN)/python -m mypy
	$(BIN)/python -m mypy.stubtest divespot._native

# Another FIRST reads other inputs: FIRST=1000000 SECONDS=600 make fuzz
SECONDS ?= 60
FIRST ?= 0

fuzz: build
	$(BIN)/python tests/fuzz.py $(SECONDS) $(FIRST)

# The kernels, with overflow checks and assertions; coverage-guided with a nightly toolchain:
# cd fuzz && cargo fuzz run piles
fuzz-kernels:
	cd fuzz && cargo run --release --quiet --no-default-features --example drive -- $(SECONDS) $(FIRST)

# Half an hour, and a machine that does nothing else.
POINTS ?= 10000000

interrupt: build
	$(BIN)/python tests/interrupt.py $(POINTS)

# ONLY="piles/* * COMMON": some of the constants. OPTIONS=--unit: the core's unit tests alone.
mutants: build
	PYTHONPATH=benches $(BIN)/python -m mutants $(OPTIONS) $(ONLY)

bench: build
	cargo bench --package divespot-benches -- --quick
	$(PYTHON) benches/gate.py || test $$? -eq 2 # 2: no valgrind, which it says
	$(PYTHON) benches/rivals.py

# What a release consists of, in dist/. zig links against the glibc 2.17 of manylinux2014. One wheel
# is for every Python but the free-threaded one; neither need be here: maturin knows their headers.
PYTHONS := python3.10 python3.14t
TARGETS := x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu
MUSL := x86_64-unknown-linux-musl aarch64-unknown-linux-musl
ARM_WHEEL = $(wildcard dist/divespot-*-abi3-manylinux*_aarch64.whl)
HOST_WHEEL = $(wildcard dist/divespot-*-abi3-manylinux*_$(shell uname -m).whl)

wheels: $(VENV)/made
	@for target in $(TARGETS) $(MUSL); do test -d "$$(rustc --print target-libdir --target $$target)" \
	|| { echo "Rust for $$target is needed: rustup target add $$target"; exit 1; }; done
	$(BIN)/python -m pip install --group wheels
	rm -rf dist
	$(BIN)/python -m maturin sdist --out dist
	set -e; for target in $(TARGETS); do PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m maturin build \
	--release --zig --target $$target --interpreter $(PYTHONS) --compatibility manylinux2014 --out dist; done
	set -e; for target in $(MUSL); do PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m maturin build \
	--release --zig --target $$target --interpreter $(PYTHONS) --compatibility musllinux_1_2 --out dist; done

# Needs Debian's qemu-user-static, and dist/ from make wheels. Rust brings a linker for musl along.
test-aarch64: build
	$(BIN)/python packaging/aarch64.py $(or $(ARM_WHEEL),$(error make wheels first))
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUSTFLAGS='-Clinker=rust-lld -Clinker-flavor=ld.lld' \
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUNNER='qemu-aarch64-static -cpu cortex-a57' \
	cargo test --package divespot-core --lib --target aarch64-unknown-linux-musl \
	--config profile.dev.opt-level=2 --config profile.dev.debug=false --quiet

footprint: build
	$(BIN)/python benches/footprint.py $(or $(HOST_WHEEL),$(error make wheels first))

# Needs valgrind.
boards: build
	$(BIN)/python benches/boards.py

# Licences, sources and advisories of all crates (deny.toml); the advisories are fetched.
# cargo install cargo-deny
audit:
	cargo deny --workspace check licenses bans sources
	cargo deny --workspace check advisories

docs-pictures: build
	$(BIN)/python docs/pictures.py

# The JSON Schema of the report, and the pages of its fields and of the settings.
docs-fields: build
	$(BIN)/python docs/fields.py

docs: build
	$(BIN)/python -m pip install --group docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

clean:
	rm -rf $(VENV) target fuzz/target dist site divespot-demo .mypy_cache .ruff_cache .pytest_cache .hypothesis
	rm -f python/divespot/_native*.so
	find python tests benches -name __pycache__ -prune -exec rm -rf {} +
