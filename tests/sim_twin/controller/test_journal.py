"""What the controller says: bounded in length, in number and in memory."""

import pytest

from sim_twin.controller.journal import N_LINES, N_MESSAGES, N_SHOWN, Journal
from sim_twin.controller.script.builtins import Popup
from sim_twin.controller.states import SafetyMode
from tests.support.virtual_robot import lines, make_robot, run, started

FLOOD = """def f():
 s = "0123456789abcdef"
 i = 0
 while i < 11:
  s = s + s
  i = i + 1
 end
 while True:
  i = 0
  while i < 30:
   {}
   i = i + 1
  end
  sync()
 end
end
"""


@pytest.fixture
def journal():
    return Journal(stamp_us=lambda: 7)


@pytest.mark.parametrize(("n", "n_kept"), [(1, 1), (N_SHOWN, N_SHOWN), (N_SHOWN + 1, N_SHOWN), (60_000, N_SHOWN)])
def test_texts_are_cut_at_what_is_shown(journal, n, n_kept):
    journal.log("x" * n)
    journal.note("x" * n)
    assert [len(text) for _, text in journal.lines] == [n_kept, n_kept]
    assert journal.outbox[0].endswith(b"\0" + b"x" * n_kept)
    journal.show(Popup(text="x" * n, title="t", is_warning=False, is_error=False, is_blocking=False))
    assert journal.popup.text == "x" * n_kept
    assert journal.outbox[1].endswith(b"\1t" + b"x" * n_kept)
    journal.exception(program="p", thread="t", line=1, column=1, message="x" * n)
    journal.key("TITLE", "x" * n)
    assert all(len(message) < n_kept + 50 for message in journal.outbox)


@pytest.mark.parametrize(("n", "n_said"), [(0, 0), (1, 1), (N_MESSAGES, N_MESSAGES), (N_MESSAGES + 1, N_MESSAGES + 1)])
def test_so_many_messages_of_a_slice_are_sent_and_the_rest_counted(journal, n, n_said):
    for _ in range(2):
        for k in range(n):
            journal.log(f"line {k}")
        journal.end_slice()
    assert len(journal.outbox) == len(journal.lines) == 2 * n_said
    assert ("1 messages left out" in [text for _, text in journal.lines]) is (n > N_MESSAGES)


def test_a_flood_drowns_no_stop(journal):
    for _ in range(500):
        journal.log("drip")
    journal.error(153, 1, "stopped")
    journal.safety(SafetyMode.PROTECTIVE_STOP)
    journal.end_slice()
    said = [text for _, text in journal.lines][N_MESSAGES:]
    assert said == [
        "C153A1: stopped",
        "safety mode changed to PROTECTIVE_STOP",
        f"{500 - N_MESSAGES} messages left out",
    ]
    assert len(journal.outbox) == N_MESSAGES + 3


@pytest.mark.parametrize("call", ["textmsg(s, s)", "popup(s, s)"])
def test_a_program_that_never_stops_talking_fills_neither_log_nor_ports(call):
    robot, n_sent = started(FLOOD.format(call)), 0
    for _ in range(100):
        robot.machine.journal.outbox.clear()
        run(robot)
        n_sent = max(n_sent, sum(map(len, robot.machine.journal.outbox)))
    assert n_sent <= 16_384, "what a client that keeps up may lag"
    assert "10 messages left out" in lines(robot)
    run(robot, 100)
    assert sum(map(len, lines(robot))) <= N_LINES * N_SHOWN


def test_the_last_popup_of_a_flood_is_the_one_that_waits():
    robot = make_robot()
    robot.submit_script(
        'def f():\n i = 0\n while i < 30:\n  popup(to_str(i))\n  i = i + 1\n end\n popup("last", blocking=True)\nend\n'
    )
    run(robot, 5)
    assert robot.machine.journal.popup.text == "last"
    assert robot.programs.main is not None
    robot.panel.close_popup()
    run(robot, 5)
    assert robot.programs.main is None
