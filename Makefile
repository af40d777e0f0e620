# Two commands: `make demo` and `make test`. Both set up what they need.
PYTHON ?= python3
UV_VERSION := 0.9.9
VENV := .venv
BIN := $(VENV)/bin

lock:  ## refresh the locked dependencies from pyproject.toml
	uv pip compile -q --universal --python-version 3.11 --generate-hashes pyproject.toml \
	  -o requirements/run.txt --custom-compile-command "make lock"
	uv pip compile -q --universal --python-version 3.11 --generate-hashes pyproject.toml --group dev \
	  -o requirements/dev.txt --custom-compile-command "make lock"
