# Build, test and document kreisel. .ci/need installs the tools; .ci/test runs the tests.
.PHONY: help build viewer report wheel amalgamation test fuzz view docs pictures clean installed
# Make builds independent of the caller's make flags, of Ninja, and of the compilers that Python was built with.
unexport MAKEFLAGS
export CC CXX
# Let Python keep the compiled modules. pip does not compile them, and the tests start hundreds of Python processes.
unexport PYTHONDONTWRITEBYTECODE
export CMAKE_GENERATOR := Unix Makefiles
export CMAKE_BUILD_PARALLEL_LEVEL := $(shell nproc)
# Use ccache if it is installed, so that builds in several folders share their object files.
ifneq ($(shell command -v ccache),)
export CMAKE_C_COMPILER_LAUNCHER := ccache
export CMAKE_CXX_COMPILER_LAUNCHER := ccache
export CCACHE_BASEDIR := $(CURDIR)
export CCACHE_NOHASHDIR := 1
endif

help:   ## print this list
	@awk -F ':[^#]*## ' '/^[a-z]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' Makefile

build:  ## build the library and the Python package, with the dependencies of report and tests, in .venv
	@.ci/need build
	@$(MAKE) --no-print-directory --jobs=2 installed

viewer:         ## build the interactive viewer alone, for `pip install .`; needs npm
	@command -v npm >/dev/null || { echo "the viewer needs npm: install Debian's package npm, or see nodejs.org" >&2; exit 1; }
	@test -x build/viewer-venv/bin/python || python3 -m venv build/viewer-venv
	@build/viewer-venv/bin/python -m pip install -q --disable-pip-version-check \
		$$(sed -n 's/^\(ziglang==[^ ;]*\).*/\1/p' .ci/locked.txt)
	@build/viewer-venv/bin/python python/viewer/build.py build/viewer python/kreisel/viewer.html
	@echo "ready: python/kreisel/viewer.html"

report: build   ## measure accuracy, speed and stability of every method; write report/
	@.venv/bin/kreisel report
	@.venv/bin/kreisel report --thesis

wheel: build    ## build the wheel without GSL, and test it in an empty environment
	@.ci/wheel

amalgamation:   ## write the C library as one file, in build/amalgamation; needs Python only
	@python3 cmake/amalgamate.py

test: build     ## run the tests: in C, in C under sanitizers, and in Python; or only TESTS=c or python
	@.ci/test $(TESTS)

fuzz:           ## make random calls of the C library under sanitizers, for HOURS (1) from SEED (1)
	@.ci/fuzz $(or $(HOURS),1) $(SEED)

view: build     ## open a top in the interactive viewer
	@.venv/bin/kreisel view

docs:           ## run all examples and build the site, in build/docs/index.html
	@.ci/need docs
	@$(MAKE) --no-print-directory build
	@.ci/docs

pictures: build ## take the pictures of README.md again: of the viewer, and of report/ if it exists; needs Chromium
	@.venv/bin/python -m validation.report.pictures

clean:  ## remove all build products
	rm -rf build .venv report dist docs/gallery .pytest_cache python/kreisel/viewer.html
	find cmake csrc python tests validation docs -name __pycache__ -prune -exec rm -rf {} +

# The Python package is an editable install: edits in python/ take effect at once, edits in csrc/ after `make build`.
gsl := $(shell pkg-config --exists gsl 2>/dev/null && echo ON || echo OFF)
core := $(shell find CMakeLists.txt csrc -type f)
sources := $(core) $(shell find python -type f ! -path '*/__pycache__/*' ! -path 'python/viewer/*' ! -name viewer.html)
viewer_html := $(if $(shell command -v npm),python/kreisel/viewer.html)
installed: $(viewer_html) .venv/kreisel-gsl-$(gsl)
	@echo "ready: .venv/bin/kreisel, .venv/bin/python"

.venv/kreisel-gsl-$(gsl): .venv/requirements.txt $(sources)
	@echo "building kreisel in .venv, GSL $(gsl)"
	@rm -f .venv/kreisel-gsl-*
	@.venv/bin/python -m pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e . \
		--config-settings build-dir=build/venv --config-settings cmake.define.KREISEL_GSL=$(gsl)
	@touch $@

python/kreisel/viewer.html: .venv/requirements.txt $(core) $(wildcard python/viewer/* python/viewer/.npmrc)
	@echo "building the viewer"
	@.venv/bin/python python/viewer/build.py build/viewer $@

.venv/requirements.txt: .ci/locked.txt
	@echo "installing the dependencies of report and tests into .venv; the first time takes minutes"
	@.venv/bin/python -m pip --version >/dev/null 2>&1 || { rm -rf build/venv && python3 -m venv --clear .venv; }
	@sed -n '/^uv==/,/[^\\]$$/p' $< >.venv/uv.txt
	@set -- -m pip install -q --no-compile --disable-pip-version-check -r; .venv/bin/python "$$@" .venv/uv.txt && \
		.venv/bin/uv pip install -q --system-certs --python .venv/bin/python --require-hashes -r $< 2>/dev/null || \
		.venv/bin/python "$$@" $<
	@cp .ci/locked.txt $@
