"""Every claim in SAFETY.md names a living test; and what looks for that is itself shown pages that are wrong."""

from pathlib import Path

import pytest

from tests.support.claims import faults_of

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "SAFETY.md").read_text(encoding="utf-8")
TESTS = """
import pytest

def test_it_stops():
    assert True

@pytest.mark.skip(reason="later")
def test_put_off():
    assert True

@pytest.mark.skip
def test_put_off_bare():
    assert True

@pytest.mark.skipif(True, reason="always")
def test_never_run():
    assert True

@pytest.mark.xfail(reason="broken")
def test_known_to_fail():
    assert True

@pytest.mark.skipif("no_gl()", reason="no GL here")
@pytest.mark.parametrize("x", [1])
def test_where_it_can(x):
    assert True

def helper():
    pass
"""
HEAD = "| claim | shown by | left |\n|---|---|---|\n"


@pytest.fixture
def root(tmp_path):
    folder = tmp_path / "tests" / "robot"
    folder.mkdir(parents=True)
    (folder / "test_stop.py").write_text(TESTS, encoding="utf-8")
    (folder / "test_empty.py").write_text("X = 1\n", encoding="utf-8")
    (folder / "test_put_off.py").write_text(
        "import pytest\npytestmark = [pytest.mark.slow, pytest.mark.skip]\ndef test_a(): ...\n", encoding="utf-8"
    )
    for place in ("one", "two"):
        (tmp_path / "tests" / place).mkdir()
        (tmp_path / "tests" / place / "test_twice.py").write_text("def test_a(): ...\n", encoding="utf-8")
    return tmp_path


def test_every_claim_of_the_page_names_a_living_test():
    assert faults_of(PAGE, ROOT) == []


def test_the_page_has_claims_and_every_hazard_has_some():
    claims = [line for line in PAGE.splitlines() if line.startswith("| ") and "`test" in line]
    assert len(claims) > 50
    hazards = PAGE.split("\n### ")[1:]
    assert len(hazards) >= 12
    assert all("| claim |" in hazard for hazard in hazards)


@pytest.mark.parametrize(
    "page",
    [
        HEAD + "| It stops. | `tests/robot/test_stop.py::test_it_stops` | nothing |",
        HEAD + "| It stops. | `tests/robot/test_stop.py` | nothing |",
        HEAD + "| It stops. | `test_stop.py`, `::test_it_stops` | nothing |",
        HEAD + "| It stops where it can. | `test_stop.py::test_where_it_can` | nothing |",
        "* It stops\n  (`test_stop.py` and `::test_it_stops`), see `robot/gate.py`.",
        "| in | arm |\n|---|---|\n| disarmed | armed |",
    ],
)
def test_a_page_that_names_living_tests_has_no_fault(root, page):
    assert faults_of(page, root) == []


@pytest.mark.parametrize(
    ("page", "fault"),
    [
        ("It stops (`tests/robot/test_gone.py`).", "exactly one such file, there are 0"),
        ("It stops (`test_gone.py`).", "exactly one such file, there are 0"),
        ("It stops (`test_twice.py`).", "exactly one such file, there are 2"),
        ("It stops (`tests/robot/test_stop.py::test_it_flies`).", "expected a test function of that name"),
        ("It stops (`test_stop.py`, `::test_it_flies`).", "expected a test function of that name"),
        ("It stops (`test_stop.py::helper`).", "expected a test function of that name"),
        ("It stops (`::test_it_stops`).", "expected a file named before it"),
        ("It stops (`test_stop.py`).\n\nAnd (`::test_it_stops`).", "expected a file named before it"),
        ("It stops (`test_stop.py::test_put_off`).", "skipped whatever happens"),
        ("It stops (`test_stop.py::test_put_off_bare`).", "skipped whatever happens"),
        ("It stops (`test_stop.py::test_never_run`).", "skipped whatever happens"),
        ("It stops (`test_stop.py::test_known_to_fail`).", "skipped whatever happens"),
        ("It stops (`test_put_off.py::test_a`).", "skipped whatever happens"),
        (HEAD + "| It stops. | we are sure | nothing |", "It stops.: expected a claim to name"),
        (HEAD + "| It stops. | `robot/gate.py` | nothing |", "It stops.: expected a claim to name"),
        (HEAD + "| It stops. | `test_empty.py` | nothing |", "It stops.: expected a claim to name"),
        (HEAD + "| `test_stop.py` stops. | we are sure | nothing |", "expected a claim to name"),
    ],
)
def test_a_page_that_is_wrong_is_told_so(root, page, fault):
    (told,) = faults_of(page, root)
    assert fault in told


def test_one_wrong_row_among_right_ones_is_found(root):
    right = "| It stops. | `test_stop.py::test_it_stops` | nothing |\n"
    (told,) = faults_of(HEAD + right + "| It flies. | nobody looked | all |\n" + right, root)
    assert told.startswith("It flies.")
