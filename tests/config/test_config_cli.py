"""`autotelic config check` and `config show`: what they print and how they exit."""

import pytest
from typer.testing import CliRunner

from config.cli import app
from config.loader import load_resolved, resolve
from config.resolved import dump_resolved
from tests.support.config_files import FOLDERS, shipped_tree, write


@pytest.fixture
def call():
    def run(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])

    return run


def test_check_without_files_checks_everything_shipped(call):
    result = call("check")
    assert result.exit_code == 0
    for name in (
        "arms/ur5e",
        "rigs/twin",
        "scenarios/paper",
        "scenarios/workshop",
        "rules/paper_after",
        "learning/group",
    ):
        assert f"ok: {name}.yaml\n" in result.stdout
    assert result.stderr == ""


@pytest.mark.parametrize(
    ("kind", "name"),
    [("arm", "ur5e"), ("rig", "twin"), ("scenario", "workshop"), ("rules", "workshop_after"), ("learning", "group")],
)
def test_check_tells_a_files_kind_from_its_keys(call, tmp_path, kind, name):
    file = write(tmp_path, "mine.yaml", shipped_tree(FOLDERS[kind], name))
    result = call("check", file)
    assert (result.exit_code, result.stdout) == (0, f"ok: {file} ({kind})\n")


def test_check_knows_a_resolved_config(call, tmp_path):
    file = tmp_path / "config.yaml"
    file.write_text(dump_resolved(resolve()), encoding="utf-8")
    assert call("check", file).stdout == f"ok: {file} (resolved)\n"


def test_check_prints_one_line_for_each_wrong_file_and_exits_2(call, tmp_path):
    good = write(tmp_path, "good.yaml", shipped_tree("rules", "paper_before"))
    wrong = write(tmp_path, "wrong.yaml", shipped_tree("rigs", "twin") | {"tick_s": "soon"})
    empty = tmp_path / "empty.yaml"
    empty.write_text("")
    result = call("check", wrong, good, empty, tmp_path / "none.yaml")
    assert result.exit_code == 2
    assert result.stdout == f"ok: {good} (rules)\n"
    assert result.stderr.splitlines() == [
        f"error: {wrong}: tick_s: expected a number from 0.002 up to 0.05, got 'soon'",
        f"error: {empty}: expected a mapping, got an empty file",
        f"error: {tmp_path / 'none.yaml'}: expected a file that can be read, got no such file or directory",
    ]


def test_check_asks_for_the_kind_where_the_keys_do_not_tell(call, tmp_path):
    file = write(tmp_path, "mine.yaml", {"name": "mine"})
    result = call("check", file)
    assert result.exit_code == 2
    assert "expected keys that tell the kind of file, or --kind" in result.stderr
    assert call("check", "--kind", "learning", file).exit_code == 0
    assert call("check", "--kind", "rules", file).exit_code == 2


def test_check_holds_a_scenario_against_the_rigs_arm(call, tmp_path):
    tree = shipped_tree("scenarios", "paper")
    tree["cylinders"][0]["diameter_m"] = 0.08
    result = call("check", write(tmp_path, "fat.yaml", tree))
    assert result.exit_code == 2
    assert "cylinders[0].diameter_m: expected at most" in result.stderr


def test_show_prints_a_config_that_loads_again(call, tmp_path):
    result = call("show", "--scenario", "workshop", "--preset", "group")
    assert result.exit_code == 0
    file = tmp_path / "config.yaml"
    file.write_text(result.stdout, encoding="utf-8")
    assert load_resolved(file) == resolve(scenario="workshop", learning="group")


def test_show_of_an_unknown_name_exits_2_in_one_line(call):
    result = call("show", "--scenario", "wrkshop")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "did you mean workshop?" in result.stderr


def test_an_unknown_option_exits_2(call):
    assert call("check", "--colour").exit_code == 2
