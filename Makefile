# make run | test | check | bench | clean
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
RUN := runs/main
BENCHES := twin grasp learning servo

.PHONY: run setup check test test-slow bench clean

run: setup
	$(BIN)/autotelic learn --scenario paper --rig twin --preset default --seed 0 --out $(RUN) --resume

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,lab]'
	touch $@

check: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/lint-imports

# What keeps to a wall's clock runs alone; the rest shares the processors.
test: check
	$(BIN)/pytest -m "not slow and not realtime" --numprocesses auto --dist loadfile
	$(BIN)/pytest -m "not slow and realtime"

test-slow: setup
	$(BIN)/pytest -m slow

bench: setup
	@failed=0; for name in $(BENCHES); do $(BIN)/autotelic bench $$name || failed=1; done; exit $$failed

clean:
	rm -rf build dist *.egg-info .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find config learning perception robot sim_twin tests -name __pycache__ -prune -exec rm -rf {} +
