# One command a purpose; CI runs the same ones. `make` alone lists them.
#
#   make serve ARGS="--nodes 10-19"            hosts a bus behind $(PTY)
#   make serve CONFIG=examples/workshop.toml   hosts what a configuration says
#   make test ARGS="tests/wire -k crc"         runs the tests
#   make test ARGS=--pdb JOBS=0                runs them in one process, for a debugger
#
# The virtual environment is made on the first use and brought up to date when pyproject.toml
# changes. PYTHON=/path/to/python3 names another interpreter.

SHELL := /bin/sh
VENV := .venv
BIN := $(VENV)/bin
PYTHON ?=
PTY ?= /tmp/sacbus
CONFIG ?=
ARGS ?=
JOBS ?= auto
# --use-pep517: crcmod is an sdist, and an old pip without wheel builds it in a way it warns about.
INSTALL := $(BIN)/python -m pip install -qq --disable-pip-version-check --use-pep517

.DEFAULT_GOAL := help
.PHONY: help serve test coverage check format bench fuzz clean

help:
	@echo "make serve     host a bus behind $(PTY), or those of CONFIG= (ARGS= adds options)"
	@echo "make test      run the tests (ARGS= goes to pytest)"
	@echo "make check     format, lint, types, import arrows, spelling, the examples in the docs"
	@echo "make coverage  run the tests and show which branches they miss"
	@echo "make format    let ruff write what check would ask for"
	@echo "make bench     run the benchmarks"
	@echo "make fuzz      ten million random lines through both ports of nodes (ARGS=\"--seed 5\")"
	@echo "make clean     remove what the above have made"

# exec: the shell steps aside, so that signals and the exit status are sacbus's own. But for
# Ctrl-C, the usual end: with sacbus's own 130 make would call that an error.
serve: $(VENV)/run
	@exec $(BIN)/python -c 'from sacbus.__main__ import main; main(interrupted=0)' \
	  serve $(if $(CONFIG),'$(CONFIG)',$(if $(PTY),--pty '$(PTY)')) $(ARGS)

# Many tests wait for a process of their own, and leave a core idle meanwhile: as many at a time as
# there are cores.
test: $(VENV)/dev
	@$(BIN)/python -m pytest --numprocesses $(JOBS) --maxprocesses 8 --dist worksteal $(ARGS)

coverage: $(VENV)/dev
	@$(BIN)/python -m pytest --cov --cov-report= $(ARGS)
	@$(BIN)/coverage report
	@$(BIN)/coverage report --include='sacbus/wire/*,sacbus/motion/*' --fail-under=100

check: $(VENV)/dev
	@$(BIN)/ruff format --check --quiet .
	@$(BIN)/ruff check --quiet .
	@$(BIN)/mypy sacbus nodes tests benchmarks examples
	@$(BIN)/lint-imports --no-logo
	@$(BIN)/codespell
	@$(BIN)/python -m doctest README.md docs/*.md

format: $(VENV)/dev
	@$(BIN)/ruff format --quiet .
	@$(BIN)/ruff check --quiet --fix .

bench: $(VENV)/dev
	@exec $(BIN)/python -m benchmarks $(ARGS)

# exec: Ctrl-C and the exit status are its own.
fuzz: $(VENV)/dev
	@exec $(BIN)/python -m tests.fuzz $(ARGS)

clean:
	@rm -rf $(VENV) build dist htmlcov .coverage .coverage.* .hypothesis .import_linter_cache \
	  .mypy_cache .pytest_cache .ruff_cache
	@find sacbus nodes tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

# Stamps, not targets of their own: what is installed depends on pyproject.toml alone.
$(VENV)/run: $(BIN)/python pyproject.toml
	@$(INSTALL) --editable .
	@touch $@

$(VENV)/dev: $(BIN)/python pyproject.toml
	@$(INSTALL) --editable '.[dev]'
	@touch $@ $(VENV)/run

# Each candidate is run, not only looked up: a version manager's shim may stand on PATH and fail.
# Order-only work inside: the interpreter's own date says nothing about the environment's.
$(BIN)/python:
	@old=; bare=; \
	for python in $(if $(PYTHON),'$(PYTHON)',python3.13 python3.12 python3.11 python3); do \
	  "$$python" -c '' 2>/dev/null || continue; \
	  "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { old=$$python; continue; }; \
	  "$$python" -c 'import ensurepip, venv' 2>/dev/null || { bare=$$python; continue; }; \
	  echo "Setting up $(VENV) with $$python (once) ..." >&2; \
	  exec "$$python" -m venv --clear $(VENV); \
	done; \
	if [ -n "$$bare" ]; then \
	  echo "error: $$bare cannot make a virtual environment, it has no ensurepip," \
	    "install it (Debian: apt install python3-venv)" >&2; \
	elif [ -n "$$old" ]; then \
	  echo "error: $$old is older than Python 3.11, on PATH," \
	    "install Python 3.11 or newer, or name one: make PYTHON=/path/to/python3" >&2; \
	else \
	  echo "error: no Python found, $(if $(PYTHON),at $(PYTHON),on PATH)," \
	    "install Python 3.11 or newer, or name one: make PYTHON=/path/to/python3" >&2; \
	fi; \
	exit 1
