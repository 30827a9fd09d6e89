# make run: a colony evolves and then lives as processes. make test: every check. Both set everything up by themselves.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock
OUT ?=
MINUTES ?=
DURATIONS := --durations=15 --durations-min=1
# Real processes, firmware and clocks on a machine that others use too: what fails is run again, and both are reported.
REAL := --reruns 1 -r aR
SYNC := $(if $(filter output-sync,$(.FEATURES)),--output-sync)

.DEFAULT_GOAL := help
.PHONY: help run dashboard demo-lan test units colonies robots checks compiled coverage bench clean

help:
	@echo "make run           20 s of evolution, then its robots live, each its own process, until Ctrl-C (MINUTES=2, OUT=DIR)"
	@echo "make dashboard     the running colony in a browser: beside make run, started before or after it"
	@echo "make demo-lan      four machines on this one (root, Linux): set up over ssh from an inventory, cut off, upgraded, removed"
	@echo "make test          every check and test that this machine can run"
	@echo "make units         of these: what needs no colony of processes; make colonies and make robots: what does, and emulators"
	@echo "make checks        formatting, types and imports between rooms alone"
	@echo "make coverage      branch coverage of learning, evolution and robot alone"
	@echo "make bench         benchmarks"
	@echo "make clean         remove the virtual environment and caches"

run: $(VENV)/run.stamp
	@$(BIN)/crcolony demo $(if $(OUT),--out "$(OUT)") $(if $(MINUTES),--minutes $(MINUTES))

dashboard: $(VENV)/viz.stamp
	@$(BIN)/crcolony dashboard --web $(if $(OUT),--out $(OUT)) $(if $(MINUTES),--minutes $(MINUTES))

# The show is a test: namespaces with roots, systemd and sshd of their own, which are all gone at its end.
demo-lan: $(VENV)/dev.stamp
	@$(BIN)/python -m pytest -q -s --no-header tests/system/test_lan_deployment.py

# What uses one core runs beside another, the longest first. Colonies and robots keep time: nothing computes beside them.
test: $(VENV)/dev.stamp
	@$(MAKE) --no-print-directory -j2 $(SYNC) compiled coverage checks
	@$(MAKE) --no-print-directory units
	@$(MAKE) --no-print-directory robots
	@$(MAKE) --no-print-directory colonies
	@echo "colonies that keep time, or whose processes are killed at random:"
	@$(BIN)/python -m pytest -q -m alone $(REAL) $(DURATIONS) tests/system

units: $(VENV)/dev.stamp
	@$(BIN)/python -m pytest -q -n 3 --dist loadfile $(REAL) $(DURATIONS) --ignore=tests/system --ignore=tests/robot_firmware_bridge

colonies: $(VENV)/dev.stamp
	@echo "colonies of real processes, in network namespaces where this machine allows them:"
	@$(BIN)/python -m pytest -q -n 3 --dist loadfile --no-loadscope-reorder -m "not alone" $(REAL) $(DURATIONS) tests/system

robots: $(VENV)/dev.stamp
	@echo "robots: their firmware on emulated controllers, and simulators of their makers:"
	@$(BIN)/python -m pytest -q -n 4 --dist loadfile $(REAL) $(DURATIONS) tests/robot_firmware_bridge

checks: $(VENV)/dev.stamp
	@$(BIN)/ruff format --check --quiet . && $(BIN)/ruff check --quiet . && echo "ruff: clean"
	@$(BIN)/mypy
	@$(BIN)/lint-imports

# The colony is compiled before the tests that need it: each of their processes would do it for itself.
compiled: $(VENV)/dev.stamp
	@scratch=$$(mktemp -d) && $(BIN)/crcolony evolve --generations 1 --no-plots --out $$scratch/run && rm -r $$scratch

# Compiled functions run as plain Python here: machine code cannot be measured.
coverage: $(VENV)/dev.stamp
	@NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest -q -r fE --ignore=tests/crcolony/learning/test_mountain_car.py \
		--ignore=tests/crcolony/robot/test_aot_step.py \
		tests/crcolony/learning tests/crcolony/evolution tests/crcolony/robot
	@$(BIN)/coverage report

bench: $(VENV)/dev.stamp
	@for bench in tests/benchmarks/bench_*.py; do \
		$(BIN)/python -m tests.benchmarks.$$(basename $$bench .py) || exit 1; done

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .coverage build dist

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
	@echo "installing crcolony and its dashboard (see requirements.lock), which takes about a minute"
	@$(PIP) -e '.[bridge,experiments,viz]' && touch $(VENV)/viz.stamp || \
		{ echo "the dashboard cannot be installed here: installing crcolony without it"; $(PIP) -e '.[bridge,experiments]'; }
	@touch $@

$(VENV)/viz.stamp: pyproject.toml requirements.lock | $(VENV)/bin/python
	@echo "installing crcolony and its dashboard (see requirements.lock)"
	@$(PIP) -e '.[bridge,experiments,viz]'
	@touch $@ $(VENV)/run.stamp

$(VENV)/dev.stamp: pyproject.toml requirements.lock | $(VENV)/bin/python
	@echo "installing crcolony and its checks (see requirements.lock)"
	@$(PIP) -e '.[dev]'
	@touch $@ $(VENV)/run.stamp $(VENV)/viz.stamp
