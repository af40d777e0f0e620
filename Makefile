# Two commands set up all they need: `make demo` and `make test`.
# Needed on the machine: git, make and Python 3.11 or newer.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
UV := $(BIN)/uv
UV_VERSION := 0.13.8
DEMO_OUT ?= out/demo
SAMPLE := sample_data/field_1.tif --lat 35.075373 --lon 33.531142

# One thread per process: the work is split by process, and figures stay comparable.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
# A command that compiles its source each time takes a fifth longer.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo test check pytest format lock bench docs notebooks pictures plugin clean

help:  ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*##/\t/' | expand -t 12

demo: $(VENV)/run.stamp  ## run the main job on the sample field
	$(BIN)/geofield run $(SAMPLE) --spacing 4 --out $(DEMO_OUT) --overwrite
	@echo "Map picture: $(CURDIR)/$(DEMO_OUT)/map.png"

test: $(VENV)/dev.stamp  ## everything that must hold: lint, types, layers, tests
	@$(MAKE) --no-print-directory -j 2 check pytest

check: $(VENV)/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

pytest: $(VENV)/dev.stamp
	$(BIN)/python -m pytest -n 2 --dist loadgroup --durations 15

format: $(VENV)/dev.stamp  ## format the code and mend what ruff can mend
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: $(VENV)/dev.stamp  ## build the documentation into site/, warnings as errors
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

notebooks: $(VENV)/dev.stamp  ## run the notebooks again and keep their outputs
	$(BIN)/python docs/scripts/run_notebooks.py

pictures: $(VENV)/dev.stamp  ## draw the documentation's pictures again
	$(BIN)/python docs/scripts/make_pictures.py

bench: $(VENV)/dev.stamp  ## run all benchmarks beside their peers; writes benchmarks/results
	$(BIN)/python benchmarks/all.py

lock:  ## refresh the locked dependencies from pyproject.toml (needs uv)
	uv pip compile -q --universal --python-version 3.11 --generate-hashes pyproject.toml \
	  -o requirements/run.txt --custom-compile-command "make lock"
	uv pip compile -q --universal --python-version 3.11 --generate-hashes pyproject.toml \
	  --group dev -o requirements/dev.txt --custom-compile-command "make lock"
	uv pip compile -q --universal --python-version 3.11 --generate-hashes pyproject.toml \
	  --resolution lowest-direct --extra plot -o requirements/oldest.txt --custom-compile-command "make lock"

plugin: $(VENV)/dev.stamp  ## build the QGIS plugin's zip and the engine's wheel into dist/
	$(BIN)/python plugin/describe.py
	$(BIN)/python plugin/translate.py de
	$(BIN)/python plugin/package.py dist

clean:  ## remove the environment and everything made
	rm -rf $(VENV) out site build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis

$(UV):
	@echo "Making $(CURDIR)/$(VENV) with $(PYTHON) ..."
	@$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --disable-pip-version-check uv==$(UV_VERSION)

$(VENV)/run.stamp: requirements/run.txt pyproject.toml | $(UV)
	@echo "Installing what geofield needs: about 300 MB are fetched, once ..."
	$(UV) pip install --compile-bytecode --python $(BIN)/python --require-hashes -r requirements/run.txt
	$(UV) pip install -q --python $(BIN)/python --no-deps -e .
	@touch $@

$(VENV)/dev.stamp: requirements/dev.txt pyproject.toml | $(UV)
	$(UV) pip install -q --compile-bytecode --python $(BIN)/python --require-hashes -r requirements/dev.txt
	$(UV) pip install -q --python $(BIN)/python --no-deps -e .
	@touch $@ $(VENV)/run.stamp
