# Every target sets the project up first; a second call does nothing that is already done.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
DEMO := demo-results

# Two BLAS threads make the small factorisations of this project about 100 times slower.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
# Tests start many processes, and each would compile what it imports, pytest all assertions again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo setup test test-slow test-all check docs bench bench-smoke bench-peers bench-diagnosis bench-regress bench-fmus lock clean

demo: setup
	@echo "An arm with a hidden effect: which one is it?"
	@$(BIN)/misfit discover arm tests/cases/arm/case_009 --out $(DEMO)/arm --html $(DEMO)/arm.html
	@echo "A real rat muscle, against its published Hill parameters:"
	@$(BIN)/misfit discover rat-muscle tests/cases/rat_muscle --out $(DEMO)/rat-muscle --html $(DEMO)/rat-muscle.html
	@echo "Reports: $(DEMO)/arm.html and $(DEMO)/rat-muscle.html"

setup: $(STAMP)

$(STAMP): requirements.lock pyproject.toml .ci/setup
	@PYTHON="$(PYTHON)" sh .ci/setup $(VENV)

# Within 8 minutes on two cores. What takes longer is marked `slow` and runs in `make test-all`; docs/decisions/019 says what guards what.
# A file stays with one process (`loadfile`), so what its tests share is built once; C of FMUs is compiled in half the time (`-O0`),
# which changes no bit of what they compute. `make test-slow` compiles as users do.
test: setup
	@CFLAGS=-O0 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not slow" tests

test-slow: setup
	@$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m slow tests

test-all: setup
	@$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder tests

check: setup
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/python -m pytest tests/house/test_imports.py
	@MISFIT_PURE=1 $(BIN)/python -m pytest --doctest-modules misfit.py fmus orchestrator hil

# The documentation site, in build/site: open build/site/index.html; nothing is fetched. Effects, commands and formats come from code.
docs: setup
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "build/site/index.html"

bench: $(VENV)/.bench
	@$(BIN)/python tests/benchmarks/run.py
	@$(BIN)/python tests/benchmarks/cosim/run.py
	@$(BIN)/python -m tests.benchmarks.regress.run
	@$(BIN)/python tests/benchmarks/gp/run.py
	@$(BIN)/python tests/benchmarks/study/run.py
	@$(BIN)/python -m tests.benchmarks.constructs.run

# Each benchmark at its smallest size, in about a minute: that it comes to its end, not how fast it is.
bench-smoke: setup
	@$(BIN)/python tests/benchmarks/smoke.py

# Tools for the comparison that ask for other versions of shared packages; `make bench` uses them when they are there.
# `make bench-peers MORE=gpytorch` adds GPyTorch, whose PyTorch may take 5 GB.
bench-peers:
	@$(PYTHON) -m venv build/peers
	@build/peers/bin/python -m pip install --quiet --disable-pip-version-check --no-input cofmupy ecospy pyfunnel tbb tinygp ziglang $(MORE)

# SIZE=tiny, small (at most about 15 minutes on two cores), medium or full; a run that was stopped goes on where it was.
SIZE ?= small
WORKERS ?= 2
SEED ?= 20
# Seconds after which no further case begins; the report says how many were done.
BUDGET ?= $(if $(filter small,$(SIZE)),780,inf)
bench-diagnosis: $(VENV)/.bench
	@$(BIN)/python -m tests.benchmarks.diagnosis.run --size $(SIZE) --seed $(SEED) --workers $(WORKERS) --budget $(BUDGET) \
		--out build/bench-diagnosis --report docs/benchmarks/diagnosis.md

# Mutants of the models and harmless rebuilds, about 40 minutes; a run that was stopped goes on where it was.
bench-regress: setup
	@$(BIN)/python -m tests.benchmarks.regress.mutants

# Every FMU and system structure of the folders below FMUS (checkouts of public repositories, say) through validation, runs here and by
# FMPy, swap and regression; BUDGET=S begins nothing further after S seconds.
FMUS ?= build/public-fmus
bench-fmus: setup
	@$(BIN)/python -m tests.benchmarks.fmus.run $(FMUS) --workers $(WORKERS) --budget $(if $(filter command line,$(origin BUDGET)),$(BUDGET),inf)

$(VENV)/.bench: $(STAMP) requirements-bench.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-input --require-hashes -r requirements-bench.lock
	@touch $@

lock:
	uv pip compile --universal --generate-hashes --python-version 3.11 --extra dev \
		--no-emit-index-url --no-emit-find-links pyproject.toml -o requirements.lock
	uv pip compile --universal --generate-hashes --python-version 3.11 --extra bench --no-header \
		--no-emit-index-url --no-emit-find-links -c requirements.lock pyproject.toml -o requirements-bench.lock

clean:
	rm -rf $(VENV) build fmus/build
