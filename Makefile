# `make demo` computes the Berlin example, `make world` the maps of the world, `make test` checks everything. All do their
# set-up themselves.
# Windows keeps the programs of an environment in another folder.
BIN = .venv/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
.DEFAULT_GOAL := help
.PHONY: help demo world check test test-all oldest docs extension package stubs versions clean

help:
	@echo "make demo       Berlin, 166 buildings: set up, trace, full load hours, report -> results/berlin/"
	@echo "make world      three districts traced for every sun, and their full load hours all over the world -> results/world/"
	@echo "make check      style, fast tests and a few cases of each law, with one Python: 1.5 minutes"
	@echo "make test       set up and run the tests, with each Python and Blender at hand: 12 minutes"
	@echo "make test-all   the same, and all that is thorough: before a release"
	@echo "make oldest     the quick tests with the oldest versions that pyproject.toml allows: 2 minutes"
	@echo "make docs       the manual as pages with search -> build/docs/"
	@echo "make extension  the extensions for Blender, one zip per platform -> dist/"
	@echo "make package    the Python package, as wheel and source archive, checked -> dist/"
	@echo "make stubs      renew __init__.pyi, what editors know of the Python functions"
	@echo "make versions   renew tools/versions.txt, the versions the set-up installs"
	@echo "make clean      remove the environments and everything built (not results/)"

# One line where there is no Python at all, as in a bare Debian, which has no sudo either.
NEEDS_PYTHON = command -v python3 > /dev/null || { as="su -c"; if [ "$$(id -u)" = 0 ]; then as="sh -c"; \
 elif command -v sudo > /dev/null; then as="sudo sh -c"; fi; echo "[set-up] missing Python, which sets up everything else;\
 type: $$as 'apt-get update && apt-get install -y python3 python3-venv' && make demo"; exit 1; }

demo:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	$(BIN)/citypv simulate examples/berlin/berlin_3910_5817.gml --weather examples/berlin/era5_berlin_2017.nc \
	  --blend --preview --overwrite --out results/berlin
	$(BIN)/citypv plot results/berlin

# Environments of the paper's Fig. 4: A mixed, B dense, C high-rise. Groups are means over hundreds of walls, so that few
# rays do; what is traced already is kept.
TRACE = $(BIN)/citypv simulate --suns sky-grid:673 --samples 64 --shadow-samples 4 --overwrite
PLACES = results/environments
DISTRICTS = A_berlin=$(PLACES)/berlin B_the_hague=$(PLACES)/the_hague C_manhattan=$(PLACES)/manhattan unshaded

world:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	@[ -f $(PLACES)/berlin/transfer.nc ] || $(TRACE) --out $(PLACES)/berlin examples/berlin/berlin_3910_5817.gml
	@[ -f $(PLACES)/the_hague/transfer.nc ] || \
	  $(TRACE) --out $(PLACES)/the_hague examples/world/denhaag_01_lod2_v1.gml.gz
	@[ -f $(PLACES)/manhattan/transfer.nc ] || $(TRACE) --out $(PLACES)/manhattan --latitude 40.757 --longitude -73.97 \
	  tests/data/obj/nyc_midtown_citicorp_1km.obj.gz
	$(BIN)/citypv world $(DISTRICTS) --surfaces 800 --overwrite --out results/world
	$(BIN)/citypv world $(DISTRICTS) --surfaces 800 --longitudes 10 10 --step 1 --off-land climate --overwrite \
	  --out results/world_10E

STYLE = echo "[test] style: ruff"; $(BIN)/ruff check . || failed=1; $(BIN)/ruff format --check . || failed=1
# Compiled tests are kept: else each process compiles all of them again, for 15 s.
check test test-all oldest: export PYTHONDONTWRITEBYTECODE =
# Threads of linear algebra that wait for each other take seconds of two workers.
check test test-all oldest: export OPENBLAS_NUM_THREADS = 1
# Each worker takes neighbouring tests, which share what they trace, and helps the other at the end.
PYTEST = -m pytest --numprocesses 2 --dist worksteal
FAST = "(law or not slow) and not thorough and not window"

check:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	@failed=0; $(STYLE); \
	CITYPV_QUICK=1 $(BIN)/python $(PYTEST) --quiet --durations 10 -m $(FAST) || failed=1; exit $$failed

# While the first Python runs, the other one is set up, and a Blender for the window is found or built; it comes last and
# alone, for how fast it answers is tested, too. An interrupt, status 2, ends all.
test test-all:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	@mkdir -p build; rm -f build/window; failed=0; $(STYLE); \
	{ python3 tools/set_up.py all && $(BIN)/python tools/blender_window.py find > build/window; } > build/set_up 2>&1 & others=$$!; \
	trap "kill $$others 2> /dev/null; exit 2" INT TERM; \
	if [ $@ = test-all ]; then export CITYPV_THOROUGH=1; few=; else few=" and not thorough"; fi; \
	run() { echo "[test] $$("$$1" -VV)"; "$$@" || { [ $$? != 2 ] || exit 2; failed=1; }; }; \
	run $(BIN)/python $(PYTEST) --durations 25 -m "not window$$few"; \
	wait $$others || failed=1; cat build/set_up; \
	for other in .venv-3.13 .venv-3.11; do \
	  [ ! -x $$other/$(notdir $(BIN))/python ] || [ $$other -ef .venv ] || \
	    run $$other/$(notdir $(BIN))/python $(PYTEST) --durations 9 -m "every_python and not window$$few"; \
	done; \
	export CITYPV_BLENDER="$$(cat build/window)"; \
	run $(BIN)/python -m pytest --durations 9 -m "window$$few" tests/blender/test_window.py; exit $$failed

# The floors of pyproject.toml are what the tests pass with; Blender has versions of its own.
oldest:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	$(BIN)/python -m pip install --quiet uv
	[ -x .venv-oldest/$(notdir $(BIN))/python ] || $(BIN)/uv venv --quiet --python 3.11 .venv-oldest
	$(BIN)/uv pip install --quiet --python .venv-oldest/$(notdir $(BIN))/python --resolution lowest-direct --editable '.[test,cluster]'
	.venv-oldest/$(notdir $(BIN))/python $(PYTEST) --quiet -m "not slow and not thorough and not window" \
	  tests/core tests/hard tests/test_rooms.py

# The pages quote the tables of measurements, so that these stand beside them.
docs:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	@rm -rf build/pages build/docs && mkdir -p build && cp -r docs build/pages && cp -r benchmarks/results build/pages/results
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going build/pages build/docs

# WHOLE=1 leaves the wheels as they were published; ADDRESS is the website that the manifest names.
extension: docs
	$(BIN)/python tools/build_extension.py --manual build/docs $(if $(WHOLE),--whole-wheels) \
	  $(if $(ADDRESS),--website $(ADDRESS))

# Links of the README lead nowhere on a package index, unless ADDRESS says where the files can be read.
package:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	$(BIN)/python -m pip install --quiet build twine
	$(BIN)/python tools/build_package.py $(if $(ADDRESS),--address $(ADDRESS))
	$(BIN)/python -m twine check --strict dist/citypv-*.whl dist/citypv-*.tar.gz

stubs:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	$(BIN)/python tools/make_stubs.py

versions:
	@$(NEEDS_PYTHON)
	@python3 tools/set_up.py one
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip compile pyproject.toml --extra blender --extra cluster --extra docs --extra test --universal --python-version 3.11 --upgrade \
	  --no-annotate --custom-compile-command "make versions" --quiet --output-file tools/versions.txt

clean:
	rm -rf .venv .venv-* build dist wheels *.egg-info
