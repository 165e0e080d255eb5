"""The root command and the bench command."""

import json
from importlib.metadata import EntryPoint, version

import pytest
from typer.testing import CliRunner

import robot.bench
import robot.cli
from config.errors import ConfigError
from robot.bench import BenchReport, BenchResult, bench_report
from robot.cli import app
from robot.errors import RobotConfigError, WireError

HERE = __name__


def fine():
    """Do what was asked."""
    print("done")  # noqa: T201


def config_fault():
    raise ConfigError("file.yaml", "a.b", "this", "that")


def robot_config_fault():
    raise RobotConfigError("no such rig")


def wire_fault():
    raise WireError("no answer")


def bench_good(*, full: bool) -> BenchReport:
    rows = [BenchResult(name="speed", value=12.5 if full else 3.0, unit="1/s", goal=">= 2", ok=True)]
    return bench_report("good", rows, seconds=0.25)


def bench_bad(*, full: bool) -> BenchReport:
    rows = [
        BenchResult(name="speed", value=1.0, unit="1/s"),
        BenchResult(name="slip", value=5.0, unit="mm", goal="<= 1", ok=False),
    ]
    return bench_report("bad", rows, seconds=0.25)


def bench_of_run(*, full: bool, run=None) -> BenchReport:
    return bench_report("of_run", [BenchResult(name=str(run), value=1.0, unit="")], seconds=0.1)


COMMANDS = {
    "bench": "robot.bench:bench",
    "fine": f"{HERE}:fine",
    "config_fault": f"{HERE}:config_fault",
    "robot_config_fault": f"{HERE}:robot_config_fault",
    "wire_fault": f"{HERE}:wire_fault",
    "absent": "no_such_package.cli:app",
}


def bench_of_any_length(*, full: bool, seconds=None) -> BenchReport:
    return bench_report("of_any_length", [BenchResult(name="length", value=seconds or 9.0, unit="s")], seconds=0.1)


BENCHES = {
    "good": f"{HERE}:bench_good", "bad": f"{HERE}:bench_bad", "of_run": f"{HERE}:bench_of_run",
    "of_any_length": f"{HERE}:bench_of_any_length",
}  # fmt: skip


@pytest.fixture
def call(monkeypatch):
    """Run the root command over sub-commands and benches of this file."""
    registered = {robot.cli.COMMAND_GROUP: COMMANDS, robot.bench.BENCH_GROUP: BENCHES}

    def points(*, group):
        return [EntryPoint(name=name, value=value, group=group) for name, value in registered[group].items()]

    monkeypatch.setattr(robot.cli, "entry_points", points)
    monkeypatch.setattr(robot.bench, "entry_points", points)
    return lambda *arguments: CliRunner().invoke(app, list(arguments))


def test_a_sub_command_runs(call):
    result = call("fine")
    assert (result.exit_code, result.stdout) == (0, "done\n")


def test_help_lists_every_sub_command_even_one_that_cannot_be_loaded(call):
    result = call("--help")
    assert result.exit_code == 0
    for name in COMMANDS:
        assert name in result.stdout
    assert "Do what was asked." in result.stdout


def test_the_version_is_the_installed_packages(call):
    result = call("--version")
    assert (result.exit_code, result.stdout) == (0, f"autotelic {version('autotelic')}\n")


@pytest.mark.parametrize(
    ("command", "exit_code", "message"),
    [
        ("config_fault", 2, "error: file.yaml: a.b: expected this, got that\n"),
        ("robot_config_fault", 2, "error: no such rig\n"),
        ("wire_fault", 1, "error: no answer\n"),
    ],
)
def test_an_error_raised_on_purpose_is_one_line_and_an_exit_code(call, command, exit_code, message):
    result = call(command)
    assert (result.exit_code, result.stderr) == (exit_code, message)


def test_a_sub_command_whose_module_is_missing_says_so_and_leaves_the_others_alone(call):
    result = call("absent", "--with", "some", "arguments")
    assert result.exit_code == 1
    assert "absent cannot be loaded: No module named 'no_such_package'" in result.stderr
    assert call("fine").exit_code == 0


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["none"],
        ["--none"],
        ["bench"],
        ["bench", "none"],
        ["bench", "good", "runs/1"],
        ["bench", "good", "--seconds", "3"],
    ],
)
def test_bad_usage_exits_2(call, arguments):
    assert call(*arguments).exit_code == 2


def test_a_bench_prints_one_json_object_of_the_agreed_shape(call):
    result = call("bench", "good", "--json", "--full")
    assert result.exit_code == 0
    report = json.loads(result.stdout)
    assert list(report) == ["bench", "results", "machine", "versions", "seconds"]
    assert report["bench"] == "good"
    assert report["results"] == [{"name": "speed", "value": 12.5, "unit": "1/s", "goal": ">= 2", "ok": True}]
    assert report["machine"]["cores"] >= 1
    assert report["versions"]["mujoco"] == "4.0.0"
    assert report["seconds"] == 0.25


def test_a_bench_without_json_is_a_table(call):
    result = call("bench", "good")
    assert result.exit_code == 0
    for word in ("speed", "1/s", ">= 2", "yes", "bench good"):
        assert word in result.stdout


def test_a_row_that_misses_its_goal_exits_1_and_is_marked(call):
    result = call("bench", "bad")
    assert result.exit_code == 1
    assert "NO" in result.stdout
    assert call("bench", "bad", "--json").exit_code == 1


def test_a_bench_that_reads_a_run_is_handed_it(call):
    result = call("bench", "of_run", "runs/7", "--json")
    assert json.loads(result.stdout)["results"][0]["name"] == "runs/7"


def test_a_bench_that_takes_any_length_is_told_it(call):
    for arguments, length in ((["--seconds", "3"], 3.0), ([], 9.0)):
        result = call("bench", "of_any_length", "--json", *arguments)
        assert json.loads(result.stdout)["results"][0]["value"] == length


def test_the_benches_can_be_listed(call):
    assert call("bench", "list").stdout.split() == sorted(BENCHES)
