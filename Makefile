# Every verb makes .venv and installs what it needs by itself; Python 3.11 or newer is all that must be there.

PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check install --quiet --constraint constraints.txt
# Slow proofs run in CI; `make test MARKS=` runs them here.
MARKS  ?= $(if $(CI),,-m "not slow")

.PHONY: help run page test lint types js audit bench soak image clean
.DEFAULT_GOAL := help

help: ## what there is to say
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

run: $(VENV)/serve.stamp ## start the service, stream a sample to it, show the live meter; the page is at its address
	@$(MAKE) --no-print-directory page >/dev/null 2>&1 || echo "the live page could not be built; make page says why"
	@$(BIN)/fervor demo || [ $$? -eq 130 ]  # Ctrl-C is the way to stop it

PAGE := service/fervor/server/page_files/index.html

page: $(PAGE) ## build the live page into the package, with Node 20 or newer, or else PyPI's

$(PAGE): $(shell find page clients/js/src -type f -not -path '*/node_modules/*') | $(BIN)/python
	@PYTHON="$(abspath $(BIN)/python)" page/make

test: $(VENV)/dev.stamp ## run the tests
	@$(BIN)/python -m pytest $(MARKS)

lint: $(VENV)/dev.stamp ## style, format, and the floors of the architecture
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@PYTHONPATH=clients/ros2/fervor_ros $(BIN)/lint-imports  # the ROS package is built by colcon, not installed here

types: $(VENV)/dev.stamp ## mypy --strict on all packages
	@$(BIN)/mypy

JS := clients/js
# Where .ci/install puts a Node if the machine has none.
WITH_NODE := PATH="$(CURDIR)/$(BIN):$$PATH"

js: $(JS)/dist/index.js ## build the JavaScript client (Node 20 or newer)

$(JS)/node_modules/.stamp: $(JS)/package.json $(JS)/package-lock.json
	@cd $(JS) && $(WITH_NODE) npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
	@touch $@

$(JS)/dist/index.js: $(JS)/node_modules/.stamp $(JS)/tsconfig.json $(JS)/tsconfig.build.json $(wildcard $(JS)/src/*.ts)
	@cd $(JS) && $(WITH_NODE) npm run --silent build

# A package that can't be asked about fails an audit by hand; in CI it is listed, for not every network lets one ask.
STRICT ?= $(if $(CI),,--strict)

audit: $(VENV)/audit.stamp ## ask PyPI for known holes in the pinned versions
	@$(BIN)/pip-audit $(STRICT) --requirement constraints.txt --no-deps --disable-pip --vulnerability-service pypi \
	  --progress-spinner off

bench: $(VENV)/dev.stamp ## speed, beside a naive service and a floor in C
	@$(BIN)/python -m bench

SECONDS ?= 600

soak: $(VENV)/dev.stamp ## a service under churn for SECONDS=600: fails if it grows
	@$(BIN)/python -m bench.soak --seconds $(SECONDS)

# Which command line of Docker's to use.
export DOCKER ?= docker

image: ## build the container image; what it weighs, and how soon it serves
	@$(DOCKER) build --tag fervor .
	@$(PYTHON) -m bench.image fervor

clean: ## forget the environment and everything made
	rm -rf $(VENV) .venv-face .venv-ros build dist $(JS)/build $(JS)/dist $(JS)/node_modules page/node_modules $(dir $(PAGE))
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "fervor needs Python 3.11 or newer; none was found (PYTHON=... names one)" >&2; exit 69; }
	@$(PYTHON) -m venv $(VENV) || { echo "$(PYTHON) can't make a virtual environment; on Debian and Ubuntu: apt install python3-venv" >&2; exit 69; }

# An environment of its own: what finds faces wants old versions of what others use.
.venv-face/stamp: examples/face_labels/requirements.txt pyproject.toml | $(BIN)/python
	@echo "installing examples/face_labels into .venv-face ..."
	@$(BIN)/python -m venv .venv-face
	@.venv-face/bin/python -m pip --disable-pip-version-check install --quiet --no-deps \
	  --requirement examples/face_labels/requirements.txt --editable .
	@touch $@

$(VENV)/%.stamp: pyproject.toml constraints.txt | $(BIN)/python
	@echo "installing fervor[$*] into $(VENV) ..."
	@$(PIP) --editable '.[$*]'
	@touch $@
