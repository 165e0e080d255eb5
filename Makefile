# make run | test | check | faults | bench | mutation | coverage | clean
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
RUN := runs/main
BENCHES := twin grasp learning servo
SAFETY_TESTS := $(addprefix tests/robot/test_,$(addsuffix .py,arming arming_button arming_words at_once blocks challenge checks \
  checks_profile clearance collision_model course cross_check gate gate_order gate_pushed lease lease_words lids limits_words obstacles \
  plain profile_words refusals states stop_check stop_memory stop_way stopping tenure))

FAULTS := runs/faults.jsonl

.PHONY: run setup check test contract test-slow faults bench mutation coverage clean

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

# What keeps to a wall's clock runs alone; the rest shares the processors. By `python -m`, for every process that a test
# spawns would run the script `pytest` again, and import it.
test: check
	$(BIN)/python -m pytest -m "not slow and not realtime" --numprocesses auto --dist loadfile --no-loadscope-reorder
	$(BIN)/python -m pytest -m "not slow and realtime"

# What the contract asks of a plant on a wire besides: each of these takes two seconds to arm again.
contract: setup
	$(BIN)/python -m pytest -m slow tests/contract

test-slow: setup
	$(BIN)/python -m pytest -m slow

# Each process of a rig killed, frozen and started again, and the link between two machines cut, late, lossy and doubling:
# half an hour, then one table. What failed is told by pytest and missing there.
faults: setup
	mkdir -p $(dir $(FAULTS)) && rm -f $(FAULTS)
	AUTOTELIC_FAULT_TABLE=$(abspath $(FAULTS)) MUJOCO_GL=$${MUJOCO_GL:-egl} $(BIN)/python -m pytest -m slow \
	  tests/robot/up/test_faults_of_processes.py tests/robot/up/test_faults_of_the_link.py; code=$$?; \
	  $(BIN)/python -m tests.support.fault_table $(FAULTS); exit $$code

bench: setup
	@failed=0; for name in $(BENCHES); do $(BIN)/autotelic bench $$name || failed=1; done; exit $$failed

# Mutants of robot/safety/ against the tests of that room (docs/mutation.md); what survives is listed at the end.
mutation: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[mutation]'
	NUMBA_DISABLE_JIT=1 $(BIN)/mutmut run --max-children 1
	$(BIN)/mutmut results

coverage: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[mutation]'
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run --branch --source=robot/safety -m pytest -q $(SAFETY_TESTS)
	$(BIN)/coverage report --show-missing --fail-under=100

clean:
	rm -rf build dist *.egg-info .pytest_cache .ruff_cache .hypothesis .import_linter_cache mutants .coverage
	find config learning perception robot sim_twin tests -name __pycache__ -prune -exec rm -rf {} +
