"""What the rig lab says before anything is connected to: not filled in, nothing to see with, nobody there."""

import socket

import pytest
from typer.testing import CliRunner

from robot.cli import app
from tests.support.config_files import shipped_tree, write


@pytest.fixture(autouse=True)
def no_wires(monkeypatch):
    """Whoever opens a socket fails the test."""

    def refuse(*arguments, **settings):
        raise AssertionError("a socket was opened")

    monkeypatch.setattr(socket, "create_connection", refuse)
    monkeypatch.setattr(socket.socket, "connect", refuse)


N_TOLD = 3
"""Lines on what a run with a person at the arm would take."""


def said(*arguments):
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    *told, error = done.stderr.splitlines()
    assert error.startswith("error: "), done.output
    assert len(told) == (N_TOLD if arguments[0] == "learn" else 0), done.output
    if told:
        assert "robot-hours: at most" in told[1]
        assert "resets by a person" in told[2]
    return done.exit_code, error


def filled(tmp_path, **changes):
    tree = shipped_tree("rigs", "lab") | {"address": "192.0.2.20"} | changes
    tree["expected"] = tree["expected"] | {"serial": "20235500001"}
    return write(tmp_path, "my_lab.yaml", tree)


@pytest.mark.parametrize("command", [("learn", "--out", "run"), ("cell", "test")])
def test_a_lab_that_is_not_filled_in_is_one_error_that_says_what_to_do(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    code, text = said(*command, "--rig", "lab")
    assert code == 2
    for words in ("address and expected.serial", "copy the rig's file", "--rig"):
        assert words in text


def test_learning_where_nothing_perceives_ends_before_anything_is_connected_to(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, text = said("learn", "--rig", filled(tmp_path, perception=None), "--out", "run")
    assert code == 2
    assert "perception" in text
    assert "nothing moves" in text


def test_nobody_at_the_terminal_is_an_error_before_the_arm_is_taken(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rig = filled(tmp_path, perception="perception.ground_truth:GroundTruthPerception")
    done = CliRunner().invoke(app, ["learn", "--rig", str(rig), "--out", "run", "--epochs", "2"], input="")
    assert done.exit_code == 1
    assert "robot-hours" in done.stderr
    assert done.stderr.strip().splitlines()[-1].startswith("error: expected a person's key")


def test_a_truth_is_not_taken_for_a_real_tables_perception_nor_its_buttons_pressed_by_machine(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, text = said("cell", "test", "--rig", filled(tmp_path), "--auto")
    assert code == 2
    assert "--auto is for a virtual controller" in text


@pytest.mark.parametrize(
    ("kind", "address", "other"), [("real", "127.0.0.120", "virtual"), ("virtual", "192.0.2.20", "real")]
)
def test_a_cell_is_not_walked_through_where_another_kind_of_arm_must_be(tmp_path, monkeypatch, kind, address, other):
    monkeypatch.chdir(tmp_path)
    expected = shipped_tree("rigs", "lab")["expected"] | {"kind": kind, "serial": "20235500001"}
    tree = shipped_tree("rigs", "lab") | {"address": address, "expected": expected}
    code, text = said("cell", "test", "--rig", write(tmp_path, "my_lab.yaml", tree))
    assert code == 2
    assert f"expected.kind is {kind}, at {address} there can only be a {other} arm" in text
