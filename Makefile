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

.PHONY: demo setup test check bench lock clean

demo: setup
	@echo "An arm with a hidden effect: which one is it?"
	@$(BIN)/misfit discover arm tests/cases/arm/case_009 --out $(DEMO)/arm --html $(DEMO)/arm.html
	@echo "A real rat muscle, against its published Hill parameters:"
	@$(BIN)/misfit discover rat-muscle tests/cases/rat_muscle --out $(DEMO)/rat-muscle --html $(DEMO)/rat-muscle.html
	@echo "Reports: $(DEMO)/arm.html and $(DEMO)/rat-muscle.html"

setup: $(STAMP)

$(STAMP): requirements.lock pyproject.toml .ci/setup
	@PYTHON="$(PYTHON)" sh .ci/setup $(VENV)

test: setup
	@$(BIN)/python -m pytest -n 2 tests

check: setup
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/python -m pytest --doctest-modules fmus orchestrator hil
	@$(BIN)/python -m pytest tests/test_documentation.py

bench: setup
	@$(BIN)/python tests/benchmarks/run.py

lock:
	uv pip compile --universal --generate-hashes --python-version 3.11 --extra dev \
		--no-emit-index-url --no-emit-find-links pyproject.toml -o requirements.lock

clean:
	rm -rf $(VENV) build fmus/build
