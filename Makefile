# demo, test, test-fast, check, format, docs.  The first one used on a fresh machine makes .venv; stamps keep it to once.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
EXAMPLE ?= examples/beginner
OUT ?= results/beginner

.PHONY: demo test test-fast check format docs clean

demo: $(VENV)/.installed
	$(BIN)/sssi run $(EXAMPLE) --out $(OUT)
	@echo "Open $(OUT)/report.html in a browser."

# One thread for each worker, since the tests use every core already; a worker without tests left takes over others'.
# Processes that tests start read modules as compiled once, even where the environment has Python write none.
ONE_THREAD := PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1
PYTEST := $(ONE_THREAD) $(BIN)/python -m pytest -n auto --dist worksteal

test: $(VENV)/.installed-dev
	$(PYTEST)

# Without the tests that compute for seconds: for the time between two edits.
test-fast: $(VENV)/.installed-dev
	$(PYTEST) -m "not slow and not long"

# Without the links to the model folders mypy would check half of the files, and pass.
check: $(VENV)/.installed-dev
	@for name in bodies contact fitting validation; do test -d sssi_exudyn/$$name || \
	  { echo "sssi_exudyn/$$name: the symbolic link to $$name/ is missing; git config core.symlinks true && git checkout -- sssi_exudyn" >&2; exit 1; }; done
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy benchmarks
	$(BIN)/mypy --config-file tests/signatures.ini --cache-dir .mypy_cache/tests tests
	$(BIN)/lint-imports
	$(BIN)/pylint --disable=all --enable=duplicate-code sssi_exudyn
	$(BIN)/python docs/prose.py

format: $(VENV)/.installed-dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The site, in site/; pictures and notebooks are computed again, which takes some four minutes.  Every warning is an error: a link
# that leads nowhere, a name without a docstring.
docs: $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "Open site/index.html in a browser; with search: python3 -m http.server --directory site, then localhost:8000."

clean:
	rm -rf $(VENV) site docs/generated build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache

# setuptools warns of folders named like the packages of an editable install, which are those packages
QUIETLY := PYTHONWARNINGS=ignore

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed; say which: make PYTHON=/path/to/python3.11 $(MAKECMDGOALS)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(QUIETLY) $(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(VENV)/.installed
	$(QUIETLY) $(BIN)/python -m pip install --quiet --editable '.[dev]'
	@touch $@

$(VENV)/.installed-docs: pyproject.toml | $(VENV)/.installed
	$(QUIETLY) $(BIN)/python -m pip install --quiet --editable '.[docs]'
	@touch $@
