"""What a driver sees, and that every limiter's name means something to a person."""

import ast
import io
import re
from pathlib import Path

import msgspec
import pytest
from rich.console import Console

from robot.messages import (
    Executed,
    Hold,
    Limited,
    Outcome,
    StationMode,
    StationState,
    StepResult,
    Twist,
    Verdict,
)
from robot.teleop.device import DriverInput
from robot.teleop.driver import DriveView
from robot.teleop.meanings import MEANINGS, meaning
from robot.teleop.readout import ReadOut, kept_share, picture
from tests.support.stations import arm_state, percept

ROOT = Path(__file__).parents[3]
KEYS = (("w/s", "x"), ("space", "stop"))
AHEAD = Twist(linear_m_s=(0.2, 0.0, 0.0))


def view(**changes):
    plain = DriveView(
        state=StationState(mode=StationMode.ENGAGED, source="teleop by keyboard", profile="attended"),
        asked=DriverInput(stamp_ns=0, speed_share=0.5), sent=AHEAD, resting="", gain=1.0, age_s=0.012,
        measured=arm_state((0.0,) * 6, force_n=(3.0, 0.0, 4.0)), refused=None, step_s=0.02, n_steps=7,
        result=StepResult(
            percept=percept({}, tcp_m=(0.4, 0.0, 0.2)), verdicts=(),
            executed=Executed(
                duration_s=0.02, moved_m=(0.001, 0.0, 0.0), target_m=(0.4, 0.0, 0.2), limiters=("guard",)
            ),
        ),
    )  # fmt: skip
    return msgspec.structs.replace(plain, **changes)


def said(shown):
    console = Console(file=io.StringIO(), width=160, force_terminal=False)
    console.print(picture(shown, KEYS))
    return console.file.getvalue()


def test_it_tells_state_speed_force_limits_by_how_much_and_age():
    text = said(view())
    for words in (
        "engaged", "teleop by keyboard, profile attended", "50 mm/s", "5.0 N", "share 50%", "frame base", "12 ms",
        "guard: near the table, slower", "25% of what was asked", "w/s x", "space stop", "moves",
    ):  # fmt: skip
        assert words in text, text


def test_it_tells_why_nothing_moves():
    latched = StationState(mode=StationMode.LATCHED, reason="force: expected at most 250 N, came 300 N")
    assert "latched  force: expected at most 250 N, came 300 N" in said(view(state=latched))
    assert "rests: clutch" in said(view(resting="clutch", sent=Hold()))
    refused = Verdict(stamp_ns=0, sequence=1, outcome=Outcome.REFUSED, reason="force", detail="too much")
    assert "preview: not sent, force: too much" in said(view(refused=refused))


def test_a_limiters_amount_is_told_where_it_is_known():
    executed = msgspec.structs.replace(view().result.executed, limited=(Limited(name="guard", amount=0.125),))
    assert "guard 0.125: near the table" in said(view(result=msgspec.structs.replace(view().result, executed=executed)))


@pytest.mark.parametrize(
    ("moved_m", "share"), [((0.004, 0.0, 0.0), 1.0), ((0.0, 0.004, 0.0), 0.0), ((-0.002, 0, 0), -0.5)]
)
def test_what_is_kept_counts_along_what_was_asked(moved_m, share):
    assert kept_share(AHEAD, moved_m, 0.02) == pytest.approx(share)
    assert kept_share(Hold(), moved_m, 0.02) is None
    assert kept_share(Twist(linear_m_s=(0.0, 0.0, 0.0)), moved_m, 0.02) is None


def test_off_a_terminal_only_changes_of_state_are_said():
    console = Console(file=io.StringIO(), width=100, force_terminal=False)
    with ReadOut(keys=KEYS, console=console, now_ns=lambda: 0) as readout:
        for shown in (view(), view(), view(state=StationState(mode=StationMode.LATCHED, reason="force"))):
            readout(shown)
    assert console.file.getvalue() == "engaged\nlatched: force\n"


NO_LIMITERS = set[str]()
"""Plain words in motion's source that name no limiter."""


def limiter_names():
    """Every plain word in motion's source: names of limiters are its only strings."""
    names = set()
    for path in (*(ROOT / "robot/motion").glob("*.py"), ROOT / "robot/tick_loop.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        public = [n for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "__all__"]
        spared = {id(c) for n in public for c in ast.walk(n)}
        names |= {
            node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in spared
        }
    return {name for name in names if re.fullmatch(r"[a-z]+(_[a-z]+)*", name)} - NO_LIMITERS


def test_every_limiter_of_motion_means_something_to_a_person():
    assert {"workspace", "leash", "contact", "hand", "no_intent", "brake"} <= limiter_names()
    assert limiter_names() <= set(MEANINGS)
    assert meaning("window") == "at the fence of that name in the limits file"


def test_the_page_for_drivers_prints_the_same_meanings():
    text = (ROOT / "docs/teleop.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| `(\w+)` \| (.+) \|$", text, flags=re.MULTILINE))
    assert told == MEANINGS
