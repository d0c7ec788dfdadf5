# make install   everything into .venv
# make demo      install, then a robot learns to crawl and a page shows it
# make test      an environment of its own (.venv-test), then lint, layers, types, pages and tests
# make test-core the tests that a change to a law, an element, a reduction or a step needs
# make site      the documentation as pages, in docs/_site
# make docs      its pictures again (those of pages need a Chromium), and then the pages
#
# PYTHON=/path/to/python3.11 (or later) chooses the interpreter.

PYTHON ?= $(firstword $(foreach name,python3 python3.13 python3.12 python3.11,$(shell \
	$(name) -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& command -v $(name))))
EXTRAS := meshing,hardware
# Of tests/robot what scales a part; the rest of it is about designs.
CORE := $(addprefix tests/,geometry fem physics reduction simulation) $(wildcard tests/robot/*_part.py)
ENGINE := pyproject.toml CMakeLists.txt $(wildcard engine/*)

# Our own threads share the cores with BLAS: two BLAS threads stall tens of milliseconds at random.
export OPENBLAS_NUM_THREADS := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# What one process compiles of a Python file, the next one reads.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: install demo test test-core lint types site docs clean

install: .venv/.installed

demo: .venv/.installed
	.venv/bin/pneumorph demo

# Each worker has a processor of its own: more threads of linear algebra only wait for each other (the
# core tests take twice as long).
PYTEST := OPENBLAS_NUM_THREADS=1 .venv-test/bin/pytest
# A file stays with one worker, which makes its fixtures once; tests/conftest.py orders the files.
SHARED := --numprocesses auto --dist loadfile --no-loadscope-reorder
# To look for them in all files takes longer than they do.
ALONE = $(shell grep --recursive --files-with-matches --include='test_*.py' 'mark\.alone' tests)

test: .venv-test/.installed
	$(MAKE) --jobs=2 --output-sync lint site types
	$(PYTEST) -m alone $(ALONE)
	$(PYTEST) -m "not alone" $(SHARED)

test-core: .venv-test/.installed
	$(PYTEST) $(SHARED) $(CORE) --ignore tests/simulation/test_shared_simulator.py

lint: .venv-test/.installed
	.venv-test/bin/ruff check .
	.venv-test/bin/ruff format --check .
	.venv-test/bin/lint-imports --no-cache --no-logo

types: .venv-test/.installed
	.venv-test/bin/mypy

site: .venv-test/.installed
	rm -rf docs/_site docs/api
	.venv-test/bin/python -m sphinx --jobs auto --builder html --fail-on-warning --keep-going --quiet docs docs/_site

docs: .venv-test/.installed
	.venv-test/bin/pneumorph demo --out runs/images
	.venv-test/bin/python docs/make_images.py runs/images
	$(MAKE) site

clean:
	rm -rf .venv .venv-test .cache

.venv/.installed: WITH := $(EXTRAS)
.venv-test/.installed: WITH := $(EXTRAS),ray,wandb,development,docs

# What pyproject.toml requires to build the package, and to run it with some extras.
TO_BUILD = import tomllib; \
	print(*tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"])
TO_RUN = import tomllib; package = tomllib.load(open("pyproject.toml", "rb"))["project"]; \
	extras = package["optional-dependencies"]; \
	print(*package["dependencies"], *(each for name in "$(WITH)".split(",") for each in extras[name]))

# Runs again only where the package's requirements or the engine changed: Python sources are edited
# in place (an editable install). What builds the engine stays in the environment: pip's own way, a
# new folder of build tools each time, compiles all of it each time. A wheel is made first, so that
# the engine compiles while packages come, and Python files of packages when they are first used.
.venv/.installed .venv-test/.installed: $(ENGINE)
	@test -n "$(PYTHON)" || { echo "pneumorph needs Python 3.11 or later with its venv module \
	(on Debian: apt install python3-venv); set PYTHON=/path/to/python3.11" >&2; exit 1; }
	@command -v c++ >/dev/null || { echo "pneumorph compiles its engine and needs a C++17 compiler \
	(on Debian: apt install g++)" >&2; exit 1; }
	@echo "installing into $(@D) (two to five minutes the first time)"
	"$(PYTHON)" -m venv $(@D)
	$(@D)/bin/python -m pip install --quiet cmake ninja $$($(@D)/bin/python -c '$(TO_BUILD)')
	rm -rf $(@D)/wheel
	@$(@D)/bin/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir $(@D)/wheel . & \
	compiling=$$!; \
	$(@D)/bin/python -m pip install --quiet --no-compile $$($(@D)/bin/python -c '$(TO_RUN)') || \
	{ kill $$compiling; exit 1; }; \
	wait $$compiling
	$(@D)/bin/python -m pip install --quiet --no-build-isolation --editable ".[$(WITH)]"
	@touch $@
