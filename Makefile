# Two commands on a fresh machine with python3 (3.11 or newer) and make:
#   make run    sets everything up, runs the Fawkes test scenario headless
#   make test   sets everything up, passes the tests
# One distribution in an environment of its own: make test-core, test-studio, test-web, ...
# For development: make lint, types, platforms, unit, docs, package, bench, lock.
# LOCKED=yes installs exactly the packages of requirements/, as continuous integration does.

PYTHON ?= python3
VENV   ?= .venv
# processes that test: more than a small machine has cores, for tests wait much of their time
WORKERS ?= 4
BIN    := $(VENV)/bin
# what is installed: the program for those who run it, or all that developers need
RUN    := $(VENV)/.ready-run
DEV    := $(VENV)/.ready-dev
# the plug-ins: each folder is a distribution
PLUGINS := $(wildcard plugins/*)
RUN_PLUGINS := plugins/cxbridge-fawkes plugins/cxbridge-planning plugins/cxbridge-robot-memory plugins/cxbridge-studio plugins/cxbridge-web
# with the extras that the tests need
DEV_PLUGINS := $(patsubst %/cxbridge-web,%/cxbridge-web[foxglove],$(patsubst %/cxbridge-ros2cx,%/cxbridge-ros2cx[rl],$(PLUGINS)))
CONTAINER_PLUGINS := plugins/cxbridge-fawkes plugins/cxbridge-planning plugins/cxbridge-protobuf plugins/cxbridge-robot-memory plugins/cxbridge-studio plugins/cxbridge-web
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# uv installs in a quarter of pip's time; pip is left for its own settings (an index of a company, say), which uv does not read
install = { test -x $(BIN)/uv && $(BIN)/uv pip install --quiet --python $(BIN)/python $(1); } || $(PIP) $(1)

.PHONY: help setup locked run run-pddl test test-core lint ruff checks prose page-lint editor types platforms win32 darwin proto compiled unit docs package bench lock doctor clean

help:
	@sed -n 's/^#   //p' Makefile

setup: $(DEV)

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "cxbridge needs Python 3.11 or newer, '$(PYTHON)' is older or absent: make PYTHON=python3.12 ..." >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { \
	  echo "python3 cannot make virtual environments here: on Debian and Ubuntu, apt install python3-venv" >&2; exit 1; }

# where there is no uv for this machine, pip does all
$(BIN)/uv: | $(VENV)/bin/python
	-@$(PIP) $(if $(LOCKED),--require-hashes -r requirements/uv.txt,'uv>=0.9,<1')

ifdef LOCKED
$(RUN): pyproject.toml $(PLUGINS:%=%/pyproject.toml) | $(BIN)/uv locked
	@$(call install,--require-hashes -r requirements/run.txt -r requirements/build.txt)
	@$(call install,--no-deps --no-build-isolation -e . $(RUN_PLUGINS:%=-e %))
	@touch $@

$(DEV): pyproject.toml $(PLUGINS:%=%/pyproject.toml) | $(BIN)/uv locked
	@$(call install,--require-hashes -r requirements/dev.txt)
	@$(call install,--no-deps --no-build-isolation -e . $(PLUGINS:%=-e %))
	@touch $@ $(RUN)
else
$(RUN): pyproject.toml $(PLUGINS:%=%/pyproject.toml) | $(BIN)/uv
	@$(call install,-e '.[test]' $(RUN_PLUGINS:%=-e %))
	@touch $@

$(DEV): pyproject.toml $(PLUGINS:%=%/pyproject.toml) | $(BIN)/uv
	@$(call install,-e '.[dev]' $(DEV_PLUGINS:%=-e '%'))
	@touch $@ $(RUN)
endif

locked:
	@test "$$(uname -s)" = Linux || { echo "LOCKED=yes is for Linux: requirements/ names no packages of other systems" >&2; exit 1; }

run: $(RUN)
	$(BIN)/cxbridge run scenarios/test-scenario

run-pddl: $(RUN)
	$(BIN)/cxbridge run scenarios/test-scenario-pddl

# ruff first, which takes a second; all else that is checked is checked while the tests run, and reported after them
test: setup
	@$(MAKE) --no-print-directory ruff
	@report=$$(mktemp); $(MAKE) --no-print-directory --jobs=2 --keep-going checks >$$report 2>&1 & checker=$$!; \
	trap 'rm -f $$report' EXIT; trap 'kill $$checker; exit 130' INT TERM; \
	$(MAKE) --no-print-directory compiled; $(MAKE) --no-print-directory unit; unit=$$?; \
	wait $$checker; checks=$$?; cat $$report; exit $$((unit || checks))

lint: ruff page-lint editor prose

checks: types page-lint editor prose

ruff: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

prose: setup
	$(BIN)/python -m tests.docs.prose

# what is locked need not be asked for again; without a network npm would try for minutes
NPM_CI = npm ci --no-audit --no-fund --silent --prefer-offline --fetch-timeout=30000 \
	--fetch-retries=1 --fetch-retry-mintimeout=2000

# prettier and eslint, where there is npm; they are no part of what a user needs
PAGE_BIN = .ci/page/node_modules/.bin
PAGE = plugins/cxbridge-web/cxbridge_web/static
page-lint:
ifneq ($(shell command -v npm),)
	@test -d .ci/page/node_modules || $(NPM_CI) --prefix .ci/page \
		|| echo "the page is not checked: npm cannot install prettier and eslint"
	@test ! -d $(PAGE_BIN) || { $(PAGE_BIN)/prettier --config .ci/page/prettier.json --log-level warn \
		--check '$(PAGE)/**/*.{js,css,html}' 'editors/vscode/*.js' && $(PAGE_BIN)/eslint --config .ci/page/eslint.config.js $(PAGE)/js; }
endif

# the extension of VS Code: its grammar is tested, and it is packed as out/cxbridge.vsix; where there is npm
EDITOR = editors/vscode
EDITOR_BIN = $(EDITOR)/node_modules/.bin
editor:
ifneq ($(shell command -v npm),)
	@test -d $(EDITOR)/node_modules || $(NPM_CI) --prefix $(EDITOR) --ignore-scripts \
		|| echo "the extension of VS Code is not packed: npm cannot install its packages"
	@test ! -d $(EDITOR_BIN) || { mkdir -p out && npm --prefix $(EDITOR) run --silent grammar \
		&& npm --prefix $(EDITOR) run --silent package >out/vsce.log 2>&1 || { cat out/vsce.log; exit 1; }; }
else
	@echo "the extension of VS Code is not packed: there is no npm"
endif

types: setup
	$(BIN)/mypy

# what Windows and macOS lack
platforms: win32 darwin

win32 darwin: setup
	$(BIN)/mypy --platform $@ --cache-dir .mypy_cache/$@ cxbridge $(wildcard plugins/*/cxbridge_*)

# the manual as pages in out/site, with the Python API; a link that leads nowhere is an error
docs: setup
	NO_MKDOCS_2_WARNING=1 timeout 120 $(BIN)/mkdocs build --quiet --strict

# wheel and sdist of each distribution, in dist/
package: setup
	$(BIN)/python -m hatchling build
	for each in $(PLUGINS); do (cd $$each && $(abspath $(BIN))/python -m hatchling build -d $(CURDIR)/dist) || exit 1; done

# the envelope of the ZeroMQ protocol, compiled
WIRE := cxbridge/blackboard/zmq/wire
proto: setup
	$(BIN)/python -m grpc_tools.protoc -I$(WIRE) --descriptor_set_out=$(WIRE)/envelope.binpb envelope.proto

# tests in a new checkout are compiled once here, else by each worker; a mistake in them is reported by `unit`
compiled: setup
	@test -d tests/__pycache__ || $(BIN)/python -m pytest --collect-only -qq >/dev/null 2>&1 || true

unit: setup
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

# the wheel of one distribution, what it declares, and its tests: test-core, or the name of a plug-in
test-core: setup
	$(BIN)/python -m tests.alone cxbridge -n $(WORKERS)

test-%: setup
	$(BIN)/python -m tests.alone cxbridge-$* -n $(WORKERS)

bench: setup
	$(BIN)/python -m benchmarks

# requirements/: the newest versions that pyproject.toml allows, with hashes. See docs/evidence/dependencies.md.
UV ?= uv
LOCK := $(UV) pip compile --quiet --upgrade --universal --generate-hashes --python-version 3.11 --no-annotate --no-header \
	--no-emit-index-url --no-emit-find-links

# the distributions of this repository are installed from it: requirements/ has only what they need
OURS := $(PLUGINS:plugins/%=--no-emit-package %) --no-emit-package cxbridge
lock:
	printf -- '-e .[dev]\n$(DEV_PLUGINS:%=-e %\n)' | $(LOCK) $(OURS) - -o requirements/dev.txt
	printf -- '-e .[test]\n$(RUN_PLUGINS:%=-e %\n)' | $(LOCK) $(OURS) - -o requirements/run.txt
	printf -- '-e .[packed]\n$(CONTAINER_PLUGINS:%=-e %\n)' | $(LOCK) $(OURS) - -o requirements/container.txt
	printf 'hatchling>=1.25,<2\neditables>=0.5,<1\n' | $(LOCK) - -o requirements/build.txt
	printf 'uv>=0.9,<1\n' | $(LOCK) - -o requirements/uv.txt

doctor: $(RUN)
	$(BIN)/cxbridge doctor

clean:
	rm -rf $(VENV) out .mypy_cache .ruff_cache .pytest_cache .hypothesis
