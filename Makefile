# make run: a colony of robot processes lives here. make test: every check. Both set everything up by themselves.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?=
MINUTES ?=

.DEFAULT_GOAL := help
.PHONY: help run dashboard test coverage bench clean

help:
	@echo "make run           an arena and four robots, each its own process, until Ctrl-C (MINUTES=2: for so long)"
	@echo "make dashboard     the colony that runs, in a browser: beside make run, before it or after"
	@echo "make test          formatting, types, layers, all tests, coverage"
	@echo "make bench         figures: how fast it is"
	@echo "make clean         remove the virtual environment and caches"

run: $(VENV)/run.stamp
	@$(BIN)/crcolony launch -n 4 --generations 0 $(if $(OUT),--out $(OUT)) $(if $(MINUTES),--minutes $(MINUTES))

dashboard: $(VENV)/viz.stamp
	@$(BIN)/crcolony dashboard --web $(if $(OUT),--out $(OUT)) $(if $(MINUTES),--minutes $(MINUTES))

test: $(VENV)/dev.stamp
	@$(BIN)/ruff format --check --quiet . && $(BIN)/ruff check --quiet . && echo "ruff: clean"
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/python -m pytest -q -n 2 --dist loadfile --ignore=tests/system
	@echo "colonies of real processes, in namespaces where this machine allows it; beside them branch coverage of learning,"
	@echo "evolution and robot, whose compiled functions then run as plain Python:"
	@$(MAKE) --no-print-directory coverage >$(VENV)/coverage.log 2>&1 & measured=$$!; \
		$(BIN)/python -m pytest -q tests/system; passed=$$?; \
		wait $$measured || passed=1; cat $(VENV)/coverage.log; exit $$passed

coverage: $(VENV)/dev.stamp
	@NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest -q -r fE --ignore=tests/learning/test_mountain_car.py \
		--ignore=tests/robot/test_ready_made.py \
		tests/learning tests/evolution tests/robot
	@$(BIN)/coverage report

bench: $(VENV)/dev.stamp
	@for bench in tests/benchmarks/bench_*.py; do \
		$(BIN)/python -m tests.benchmarks.$$(basename $$bench .py) || exit 1; done

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache *.egg-info

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "crcolony needs Python 3.11 or newer; set PYTHON=/path/to/python3.11" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || $(MAKE) --no-print-directory install-venv
	@echo "making a virtual environment in $(VENV)"
	@$(PYTHON) -m venv $(VENV)

.PHONY: install-venv
install-venv:
	@if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
		apt-get update -q && apt-get install -y -q python3-venv; \
	else echo "Python's venv module is missing; on Debian: sudo apt-get install python3-venv" >&2; exit 1; fi

$(VENV)/run.stamp: pyproject.toml requirements.lock | $(VENV)/bin/python
	@echo "installing crcolony (see requirements.lock)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[experiments]'
	@touch $@

$(VENV)/viz.stamp: pyproject.toml requirements.lock | $(VENV)/bin/python
	@echo "installing crcolony and its dashboard (see requirements.lock)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[experiments,viz]'
	@touch $@ $(VENV)/run.stamp

$(VENV)/dev.stamp: pyproject.toml requirements.lock | $(VENV)/bin/python
	@echo "installing crcolony and its checks (see requirements.lock)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[dev]'
	@touch $@ $(VENV)/run.stamp $(VENV)/viz.stamp
