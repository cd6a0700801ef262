# Every target makes what it needs: a machine with Python 3.11 or newer and pip is enough.

PYTHON ?= python3
RUN := .venv/bin/python
PIP := $(RUN) -m pip --disable-pip-version-check --quiet

.PHONY: demo real test quick test-extras bench bench-series same validate validate-discover validate-mistakes validate-intervals validate-speed-laws \
        validate-population validate-plan lint format schemas docs notebooks dist release-check clean

demo: .venv/installed
	$(RUN) -m fibrefit fit configs/drop_series/study.toml --out results/drop_series --figures png --force

test: .venv/installed-test
	$(RUN) -m pytest -n 2 --dist loadfile --no-loadscope-reorder

# What a change of a package needs, in less than two minutes: make quick PACKAGE="fitting sampling"; without it, what has changed.
quick: .venv/installed-test .venv/installed-lint
	$(RUN) -m tests.quick $(PACKAGE)

# Tests of the extras that the suite does without, slow ones too; here a missing package is a failure.
test-extras: .venv/installed-test .venv/installed-nuts .venv/installed-tdms .venv/installed-mdf .venv/installed-dask
	FIBREFIT_EXTRAS_REQUIRED=1 $(RUN) -m pytest -m extra

bench: .venv/installed-bench
	$(RUN) -m tests.benchmarks
	$(RUN) -m tests.benchmarks.load
	$(RUN) -m pytest -s -o python_files='bench_*.py' tests/benchmarks
	$(MAKE) bench-series

# Thousands of records, beside SciPy, by one process and two; goes on where it was stopped. ARGS="--records 60" for fewer,
# with FOLDER=results/sixty for a series of their own.
FOLDER ?= results/bench_series
bench-series: .venv/installed-bench
	$(RUN) -m tests.validation.validate_batch $(FOLDER) --workers 40 $(ARGS)

# Whether this checkout gives the results of an earlier revision to the last bit: the demo, every config, a batch of forty
# and, with PRACTICE=folder, the search of each series there. ARGS="--only fit" takes fewer; it goes on where it was stopped.
BEFORE ?= HEAD
same: .venv/installed-test
	$(RUN) -m tests.validation.same_results since $(BEFORE) $(if $(PRACTICE),--practice $(PRACTICE)) $(ARGS)

validate: .venv/installed-bench
	$(RUN) -m pytest -s -m 'slow or not slow' tests/validation tests/reliability
	$(RUN) -m pytest -s -m slow --ignore=tests/validation --ignore=tests/reliability --ignore=tests/release

# ARGS="--release LABEL --kind null --rig fibre_mass --cases 20" carries out twenty further cases; a label draws its own.
validate-discover: .venv/installed-bench
	$(RUN) -m tests.validation.validate_discover $(ARGS)

# ARGS="--release LABEL --mistake clock --cases 20" searches twenty further series whose study says something wrong.
validate-mistakes: .venv/installed-bench
	$(RUN) -m tests.validation.validate_mistakes $(ARGS)

# ARGS="--release LABEL --noise slow --scatter 0.005 --series 20" fits twenty further series of each rig.
validate-intervals: .venv/installed-bench
	$(RUN) -m tests.validation.validate_intervals $(ARGS)

# ARGS="--release LABEL --rig fibre_mass --with 3 --without 6" asks nine further series whether a parameter depends on speed.
validate-speed-laws: .venv/installed-bench
	$(RUN) -m tests.validation.validate_speed_laws $(ARGS)

# ARGS="--release LABEL --series 25" pools the records of twenty-five further series.
validate-population: .venv/installed-bench
	$(RUN) -m tests.validation.validate_population $(ARGS)

# ARGS="--release LABEL --trials 20" takes the record that a plan proposes, and a random one, in twenty further series.
validate-plan: .venv/installed-bench
	$(RUN) -m tests.validation.validate_plan $(ARGS)

# DATA=folder holds clones of the public repositories that docs/real_records.md names; none is part of this project.
real: .venv/installed-test
	$(RUN) -m tests.real $(DATA) $(ARGS)

lint: .venv/installed-lint
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy

format: .venv/installed-lint
	$(RUN) -m ruff check --fix .
	$(RUN) -m ruff format .

schemas: .venv/installed
	$(RUN) -m fibrefit.study.schemas

# The site, in docs/_build/html; a warning is an error. Notebooks are shown as `make notebooks` ran them last.
docs: .venv/installed-docs
	$(RUN) -m sphinx -W --keep-going -q -b html docs docs/_build/html

# EMPS=file of the record that 10_a_real_record reads; without it that notebook is left out.
NOTEBOOKS ?= $(filter-out notebooks/10_%,$(wildcard notebooks/*.py)) $(if $(EMPS),notebooks/10_a_real_record.py)
notebooks: .venv/installed-notebooks
	FIBREFIT_EMPS="$(if $(EMPS),$(abspath $(EMPS)))" $(RUN) -m jupytext --to ipynb --execute $(NOTEBOOKS)

# Wheel and sdist, in dist/.
dist: .venv/installed-release
	rm -rf dist
	$(RUN) -m build

# Both are installed into environments of their own, outside the checkout, and used there.
release-check: dist .venv/installed-test
	$(RUN) -m pytest -s -m slow tests/release

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(PIP) install --editable .
	touch $@

# One rule for all extras: the stem names the extra.
.venv/installed-%: .venv/installed
	$(PIP) install --editable '.[$*]'
	touch $@

# The benchmarks are run by pytest and need its extra too.
.venv/installed-bench: .venv/installed-test
	$(PIP) install --editable '.[bench]'
	touch $@

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .hypothesis dist docs/_build docs/generated
