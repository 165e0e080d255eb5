"""The script that the genuine client uploads, caught at run time: its names and registers are its own affair."""

import re

import numpy as np
import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.script.lexer import tokens_of
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address
from tests.support.virtual_robot import RegisterClient, make_robot

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

HOME = np.array([2.8186, -1.7634, 2.014, -1.8213, -1.5708, -1.8938])
MOVEJ, MOVEL, SPEEDJ, SPEED_STOP, STOP_SCRIPT = 1, 3, 9, 15, 255


@pytest.fixture(scope="module")
def uploaded():
    from rtde_control import RTDEControlInterface

    with ControllerProcess(Setup(host=own_address())) as process:
        client = RTDEControlInterface(process.host)
        text = process.fault("program")["text"]
        client.disconnect()
    return text


def renamed(text, known):
    """Give every name that the script makes itself another one; `p` is left, for it also begins a pose."""
    tokens = [t for t in tokens_of(text) if t.kind != "end of text"]
    own, depth = set(), 0
    for before, token, after in zip([None, *tokens], tokens, [*tokens[1:], None], strict=False):
        depth += (token.text == "(") - (token.text == ")")
        is_defined = before is not None and before.kind in ("def", "thread")
        is_assigned = depth == 0 and after is not None and after.text == "="
        if token.kind == "name" and (is_defined or is_assigned):
            own.add(token.text)
    own -= known | {"p"}
    pieces, at = [], 0
    depth = 0
    for token, after in zip(tokens, [*tokens[1:], None], strict=False):
        depth += (token.text == "(") - (token.text == ")")
        is_keyword = depth > 0 and after is not None and after.text == "="
        if token.kind == "name" and token.text in own and not is_keyword:
            pieces += [text[at : token.offset], f"zz_{token.text[::-1]}_q"]
            at = token.offset + len(token.text)
    return "".join([*pieces, text[at:]]), own


def shifted(text, to):
    """Move the script's registers: the client puts their first number at the begin of two lines."""
    moved, n = re.subn(r"(?m)^0(\s+global)", rf"{to}\1", text)
    assert n == 2
    return moved


def permuted(text, seed):
    """Shuffle the script's functions and threads before what else is in it; an inner one stays in its own."""
    first, *lines = text.split("\n")
    blocks, others, depth = [], [], 0
    for line in lines:
        code = line.split("#")[0].strip()
        if depth == 0 and re.match(r"(def|thread)\b", code):
            blocks.append([line])
            depth = 1
        elif depth > 0:
            blocks[-1].append(line)
            depth += bool(re.match(r"(def|thread|while|if)\b", code)) - bool(re.match(r"end\b", code))
        else:
            others.append(line)
    assert depth == 0
    order = np.random.default_rng(seed).permutation(len(blocks))
    assert (order != np.arange(len(blocks))).any()
    shuffled = [line for i in order for line in blocks[i]]
    return "\n".join([first, *shuffled, *others]), len(blocks)


def traced(text, first):
    client = RegisterClient(make_robot(), first)
    client.start(text)
    client.command(MOVEJ, [*(HOME + 0.05), 1.0, 3.0], [0])
    pose = [*client.robot.machine.drive.measured.tcp_pose]
    client.command(MOVEL, [*pose[:2], pose[2] + 0.03, *pose[3:], 0.2, 0.8], [0])
    client.say(SPEEDJ, [0.3, 0, 0, 0, 0, 0, 1.5, 0.0])
    client.step(200)
    client.say(0)
    client.step(3)
    client.command(SPEED_STOP, [2.0])
    client.say(STOP_SCRIPT)
    client.step(50)
    client.robot.close()
    return client


@pytest.fixture(scope="module")
def plain(uploaded):
    return traced(uploaded, 0)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_order_of_functions_does_not_matter(uploaded, plain, seed):
    other, n_functions = permuted(uploaded, seed)
    assert n_functions > 20
    assert sorted(other.split("\n")) == sorted(uploaded.split("\n"))
    assert (plain.joints() == traced(other, 0).joints()).all()


def test_names_order_and_registers_do_not_matter(uploaded, plain):
    known = set(program_builtins(make_robot().machine, Sockets(slice_s=0.002)))
    other, own = renamed(permuted(uploaded, 2)[0], known)
    assert len(own) > 80
    changed = traced(shifted(other, 24), 24)
    assert len(plain.trace) > 500
    assert (plain.joints() == changed.joints()).all()
    assert changed.robot.machine.registers.outputs.ints[0] == 0, "the lower registers are not touched"
    assert np.abs(np.ptp(plain.joints(), axis=0)).max() > 0.1
