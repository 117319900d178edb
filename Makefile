# The front door of kreisel. Tools come from .ci/need, what `make test` does is in .ci/test.
.PHONY: help build page report wheel test fuzz view docs clean installed
# Builds do not depend on who calls, on what else is installed, or on the compilers that Python was built with.
unexport MAKEFLAGS
export CC CXX
export CMAKE_GENERATOR := Unix Makefiles
export CMAKE_BUILD_PARALLEL_LEVEL := $(shell nproc)
# What several builds share is compiled once, where ccache is there.
ifneq ($(shell command -v ccache),)
export CMAKE_C_COMPILER_LAUNCHER := ccache
export CMAKE_CXX_COMPILER_LAUNCHER := ccache
export CCACHE_BASEDIR := $(CURDIR)
export CCACHE_NOHASHDIR := 1
endif

help:   ## this list
	@awk -F ':[^#]*## ' '/^[a-z]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' Makefile

build:  ## the library, the Python package and all that report and tests need, in .venv
	@.ci/need build
	@$(MAKE) --no-print-directory --jobs=2 installed

page:           ## the page alone, which `pip install .` then takes along; needs npm
	@command -v npm >/dev/null || { echo "the page needs npm, as of Debian's package npm or nodejs.org" >&2; exit 1; }
	@test -x build/page/bin/python || python3 -m venv build/page
	@build/page/bin/python -m pip install -q --disable-pip-version-check \
		$$(sed -n 's/^\(ziglang==[^ ;]*\).*/\1/p' .ci/locked.txt)
	@build/page/bin/python python/viewer/build.py build/viewer python/kreisel/viewer.html
	@echo "ready: python/kreisel/viewer.html"

report: build   ## accuracy, speed and stability of every method, in report/
	@.venv/bin/kreisel report
	@.venv/bin/kreisel report --thesis

wheel: build    ## the wheel as users get it, without GSL, tried in an empty environment
	@.ci/wheel

test: build     ## the tests in C, again under sanitizers, and in Python
	@.ci/test

fuzz:           ## random calls of the C library for HOURS (1) from SEED, under sanitizers
	@.ci/fuzz $(or $(HOURS),1) $(SEED)

view: build     ## the top in a browser
	@.venv/bin/kreisel view

docs:           ## the site, in build/docs/index.html: every example runs for it
	@.ci/need docs
	@$(MAKE) --no-print-directory build
	@.ci/docs

clean:  ## removes all that was made here
	rm -rf build .venv report dist docs/gallery .pytest_cache python/kreisel/viewer.html
	find csrc python tests validation docs -name __pycache__ -prune -exec rm -rf {} +

# The Python package stands in .venv by reference: an edit in python/ is there at once, one in csrc/ by `make build`.
gsl := $(shell pkg-config --exists gsl 2>/dev/null && echo ON || echo OFF)
core := $(shell find CMakeLists.txt csrc -type f)
sources := $(core) $(shell find python -type f ! -path '*/__pycache__/*' ! -path 'python/viewer/*' ! -name viewer.html)
page := $(if $(shell command -v npm),python/kreisel/viewer.html)
installed: $(page) .venv/kreisel-gsl-$(gsl)
	@echo "ready: .venv/bin/kreisel, .venv/bin/python"

.venv/kreisel-gsl-$(gsl): .venv/requirements.txt $(sources)
	@echo "building kreisel in .venv, GSL $(gsl)"
	@rm -f .venv/kreisel-gsl-*
	@.venv/bin/python -m pip install -q --no-deps --no-build-isolation -e . \
		--config-settings build-dir=build/venv --config-settings cmake.define.KREISEL_GSL=$(gsl)
	@touch $@

python/kreisel/viewer.html: .venv/requirements.txt $(core) $(wildcard python/viewer/* python/viewer/.npmrc)
	@echo "building the page"
	@.venv/bin/python python/viewer/build.py build/viewer $@

.venv/requirements.txt: pyproject.toml .ci/requirements .ci/locked.txt
	@echo "getting what report and tests need into .venv; the first time takes minutes"
	@.venv/bin/python -m pip --version >/dev/null 2>&1 || { rm -rf build/venv && python3 -m venv --clear .venv; }
	@.venv/bin/python .ci/requirements >$@.new
	@.venv/bin/python -m pip install -q --no-compile --disable-pip-version-check -r $@.new
	@mv $@.new $@
