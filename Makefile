# One runner: everything a person or a machine does here is one of these words.
PYTHON ?= python3
V := .venv
BIN := $(V)/bin

# matrices here have ten rows: threads of the linear algebra only get in each other's way
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: setup demo test slow bench check clean
.DEFAULT_GOAL := setup

$(V)/.ok: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "asflown needs Python 3.11 or newer; $(PYTHON) is older. Try: make setup PYTHON=python3.12"; exit 2; }
	$(PYTHON) -m venv $(V)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	$(BIN)/python -m asflown.cli.prewarm
	@touch $@

setup: $(V)/.ok            ## environment in .venv, from the hashed lock

demo: setup                ## simulate, reconstruct, compare, draw: demo-out/
	$(BIN)/asflown demo --out demo-out

test: setup                ## everything but the slow campaigns
	$(BIN)/python -m pytest -n 2

slow: setup                ## the campaigns that .ci/run adds
	$(BIN)/python -m pytest -n 2 -m slow

bench: setup               ## timings beside the peers, as ratios
	$(BIN)/python benchmarks/torque_speed.py
	$(BIN)/python benchmarks/door.py
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python benchmarks/gates_bootstrap.py

check: setup               ## style and types
	$(BIN)/ruff check src tests studies benchmarks
	$(BIN)/ruff format --check src tests studies benchmarks
	$(BIN)/mypy

clean:
	rm -rf $(V) demo-out .pytest_cache .mypy_cache .ruff_cache
