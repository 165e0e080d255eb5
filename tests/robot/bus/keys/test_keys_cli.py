"""`autotelic keys` from an empty folder to a list."""

import json

import pytest
from typer.testing import CliRunner

from robot.cli import app


@pytest.fixture
def keys(tmp_path):
    def call(*arguments):
        return CliRunner().invoke(app, ["keys", *arguments, "--keys", str(tmp_path / "keys")])

    return call


def test_from_init_over_issue_and_revoke_to_list(keys, tmp_path):
    assert keys("init").exit_code == 0
    issued = keys("issue", "twin", "--host", "127.0.0.1", "--host", "cell.example")
    assert issued.exit_code == 0
    assert str(tmp_path / "keys" / "twin") in issued.stdout
    assert keys("issue", "teleop", "--source", "pad", "--days", "7").exit_code == 0
    entries = json.loads(keys("list", "--json").stdout)["entries"]
    assert [(e["role"], e["source"], e["hosts"]) for e in entries] == [
        ("twin", "twin", ["127.0.0.1", "cell.example"]), ("teleop", "pad", []),
    ]  # fmt: skip
    assert keys("revoke", entries[1]["name"]).exit_code == 0
    assert json.loads(keys("list", "--json").stdout)["entries"][1]["revoked"] is not None
    table = keys("list").stdout
    assert "valid" in table
    assert "revoked" in table


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("list",), "keys init"),
        (("issue", "teleop"), "keys init"),
        (("issue", "boss"), "boss"),
        (("revoke", "teleop.teleop.1"), "keys init"),
    ],
)
def test_what_cannot_be_done_is_one_error_and_exit_code_2(keys, arguments, told):
    result = keys(*arguments)
    assert (result.exit_code, told in result.stderr) == (2, True)
