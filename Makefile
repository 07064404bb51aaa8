# `make` lists the targets. Every target sets up what it needs: nothing has to be installed before
# but Python 3.11 or newer, git and make.

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
RENDERS := $(VENV)/.renders
KERNELS := $(VENV)/.kernels

# Drivers whose robots' packages are tried, each in an environment of its own.
DRIVERS := franka gige realsense ros2 so101 ur

PYTEST_ARGS ?=

# Images are rendered without a screen.
export MUJOCO_GL ?= egl

.PHONY: help setup drivers test-drivers test-images test-browser demo test docs bench footage peers format clean
.PHONY: check kernels wheel test-wheel lint lint-format lint-rules lint-types lint-page bounds fuzz soak

help:
	@echo "make demo     set up, then servo a Puma 560 on rendered images and write a report"
	@echo "make test     set up, then run the whole test suite (PYTEST_ARGS='-k name' for a part)"
	@echo "make bounds   run the test suite with kernels that check every index they use (slow)"
	@echo "make fuzz     try untrusted input by the ten thousand (in make test: by the hundred)"
	@echo "make test-drivers  test the drivers of real robots with the robots' own packages"
	@echo "make soak     run the loop at 500 Hz for an hour (MINUTES=5 for less), watch its time and memory"
	@echo "make kernels  compile now what first runs of all kinds of cells would compile"
	@echo "make wheel    build the wheel, with compiled kernels in it, and the source archive into dist/"
	@echo "make test-wheel  build the wheel, install it into a bare environment and run a cell from it"
	@echo "make docs     build the documentation into docs/_build; a warning is an error"
	@echo "make check    everything CI checks: formatting, lints, types, documentation, tests"
	@echo "make lint     formatting, lints and types only"
	@echo "make format   format the code and apply the safe fixes"
	@echo "make bench    run the benchmarks, peers beside us"
	@echo "make footage  measure perception on real images, beside ViSP and OpenCV (3 minutes)"
	@echo "make peers    build and install what the benchmarks compare us with (ViSP, Python packages)"
	@echo "make setup    only set up: the virtual environment, the renderer, the first kernels"
	@echo "make clean    remove everything that was built, the virtual environment too"

# CI compiles its kernels once, for the wheel.
setup: $(INSTALLED) $(RENDERS) $(if $(CI),,$(KERNELS))

$(INSTALLED): pyproject.toml constraints.txt scripts/make-venv
	@scripts/make-venv $(VENV)
	@touch $@

$(RENDERS): $(INSTALLED) scripts/ensure-rendering
	@scripts/ensure-rendering $(BIN)/python
	@touch $@

$(KERNELS): $(RENDERS) scripts/build-kernels
	@scripts/build-kernels --first $(BIN)/python
	@touch $@

test-images:
	@scripts/ensure-test-images

test-browser:
	@scripts/ensure-browser $(VENV)

demo: setup
	$(BIN)/vergence run puma560

test: setup test-images test-browser
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile $(PYTEST_ARGS)

drivers: $(DRIVERS:%=.drivers/%/.installed)

test-drivers: $(DRIVERS:%=test-driver-%)

test-driver-%: .drivers/%/.installed $(RENDERS)
	.drivers/$*/bin/python -m pytest tests/drivers/protocol_$*.py $(PYTEST_ARGS)

.PRECIOUS: .drivers/%/.installed
.drivers/%/.installed: $(INSTALLED) scripts/make-driver-venv scripts/build-tf2-msgs
	@scripts/make-driver-venv $* $(VENV)
	@touch $@

bounds: setup
	@caches=$$(mktemp -d) && NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$$caches \
	    $(BIN)/python -m pytest --numprocesses 2 --dist loadfile $(PYTEST_ARGS); \
	    status=$$?; rm -rf $$caches; exit $$status

fuzz: setup
	VERGENCE_FUZZ=long $(BIN)/python -m pytest tests/fuzz $(PYTEST_ARGS)

MINUTES ?= 60
soak: setup
	$(BIN)/python benchmarks/soak.py --minutes $(MINUTES)

lint: lint-format lint-rules lint-types lint-page

lint-format: $(INSTALLED)
	$(BIN)/ruff format --check .

lint-rules: $(INSTALLED)
	$(BIN)/ruff check .

lint-types: $(INSTALLED)
	$(BIN)/mypy

lint-page: $(INSTALLED)
	@scripts/check-page $(VENV)/typescript

docs: $(INSTALLED)
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --builder html docs docs/_build
	@echo "documentation: docs/_build/index.html"

kernels: setup
	@scripts/build-kernels $(BIN)/python

wheel: setup
	@scripts/build-wheel $(BIN)/python dist

test-wheel: setup
	@scripts/try-wheel $(BIN)/python dist

check: lint docs test test-drivers test-wheel

bench: setup
	$(BIN)/python benchmarks/run.py

footage: setup test-images
	$(BIN)/python benchmarks/footage.py

peers:
	@scripts/make-peers

format: $(INSTALLED)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:
	rm -rf $(VENV) .drivers build dist docs/_build .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
