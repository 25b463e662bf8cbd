# make run: the paper's pipeline.  make study: the comparison of its agents.  make lab: the course.  make test: all tests.  Each sets up .venv first.
# ARGS is handed on: make run ARGS="--n 500", make study ARGS=--quick
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
PIP = $(BIN)/python -m pip --disable-pip-version-check

.PHONY: run study test lint bench lab lessons exercises book clean

run: $(VENV)/core-installed
	$(BIN)/stairlab run $(ARGS)

study: $(VENV)/all-installed
	$(BIN)/stairlab study $(ARGS)

test: $(VENV)/all-installed
	$(BIN)/python -m pytest -n auto --dist loadfile $(ARGS)

lint: $(VENV)/all-installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: $(VENV)/all-installed
	$(BIN)/python benchmarks/world.py
	$(BIN)/python benchmarks/clustering.py
	$(BIN)/python benchmarks/method.py
	$(BIN)/python benchmarks/agents.py

lab: $(VENV)/all-installed
	$(BIN)/jupyter lab notebooks/00_welcome.ipynb

# execute the lessons: tests and book use the executed copies again
lessons: $(VENV)/all-installed
	$(BIN)/python notebooks/execute.py

# the course as a web site, in book/_build/html; STAIRLAB_TEACHERS=1 builds the teachers', with the solutions, in book/_build/teachers
SITE = $(if $(STAIRLAB_TEACHERS),teachers,html)
book: $(VENV)/all-installed
	$(BIN)/python -m sphinx -W --keep-going -n -b html -d book/_build/doctrees-$(SITE) book book/_build/$(SITE)

# the students' exercises and the solutions, from notebooks/exercises/source
exercises: $(VENV)/all-installed
	$(BIN)/python notebooks/exercises/generate.py

clean:
	rm -rf $(VENV) out build book/_build book/made

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# the core: no torch, no Jupyter; at the versions of requirements.txt
$(VENV)/core-installed: requirements.txt pyproject.toml | $(BIN)/python
	@echo "Setting up $(VENV) (about a minute, once) ..."
	grep '==' requirements.txt > $(VENV)/constraints.txt
	$(PIP) install --quiet --constraint $(VENV)/constraints.txt --editable .
	touch $@

# everything
$(VENV)/all-installed: requirements.txt pyproject.toml | $(BIN)/python
	@echo "Setting up $(VENV) with everything (a few minutes, once) ..."
	$(PIP) install --quiet --requirement requirements.txt
	touch $(VENV)/core-installed $@
