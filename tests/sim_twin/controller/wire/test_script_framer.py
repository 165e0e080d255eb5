"""Uploads cut into programs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.wire.script_framer import N_PROGRAM_CHARS, N_PROGRAM_LINES, ScriptFramer

PROGRAM = "def rtde_control():\n  # a comment\n  if True:\n    sync()\n  end\n\n  endless = 1\nend\n"
SECONDARY = "sec lamp():\n\tset_digital_out(0, True)\nend\n"


@pytest.mark.parametrize(
    "text", [PROGRAM, SECONDARY, "movej([0,0,0,0,0,0])\n", "def f(a, b=1): # why\n sync()\nend # f\n"]
)
def test_one_program(text):
    framer = ScriptFramer()
    assert framer.feed(text.encode()) == [text]
    assert not framer.is_inside


def test_several_programs_one_after_another():
    line = "set_digital_out(1, False)\n"
    assert ScriptFramer().feed((PROGRAM + "\n# between\n" + line + SECONDARY).encode()) == [PROGRAM, line, SECONDARY]


def test_byte_by_byte():
    framer = ScriptFramer()
    stream = (PROGRAM + SECONDARY).encode()
    assert [text for byte in stream for text in framer.feed(bytes([byte]))] == [PROGRAM, SECONDARY]


def test_an_indented_end_does_not_end_and_a_longer_word_neither():
    framer = ScriptFramer()
    assert framer.feed(b"def f():\n end\n\tend\nending = 1\nend_ = 2\n") == []
    assert framer.is_inside
    assert framer.feed(b"end\n") == ["def f():\n end\n\tend\nending = 1\nend_ = 2\nend\n"]


def test_lines_of_windows_are_lines():
    assert ScriptFramer().feed(PROGRAM.replace("\n", "\r\n").encode()) == [PROGRAM]


def test_a_body_in_column_1_is_kept_whole():
    text = "def f():\n# HEADER_BEGIN\nglobal a = 1\n$ 5 weird\nend\n"
    assert ScriptFramer().feed(text.encode()) == [text]


def test_words_that_only_begin_like_a_program_are_lines():
    assert ScriptFramer().feed(b"define()\nsecret = 1\n def f():\n") == ["define()\n", "secret = 1\n", " def f():\n"]


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n", "   \n\t\n", "  # indented\n"])
def test_nothing_is_no_program(text):
    assert ScriptFramer().feed(text.encode()) == []


def test_a_line_without_end_is_given_up():
    framer = ScriptFramer()
    for _ in range(20):
        assert framer.feed(b"x" * 8192) == []
    assert framer.is_overlong
    assert framer.feed(b"\nsync()\n") == []


def test_a_program_without_end_is_given_up():
    framer = ScriptFramer()
    framer.feed(b"def f():\n")
    for _ in range(1000):
        framer.feed(b" sync() # and on and on\n" * 200)
    assert framer.is_overlong


@pytest.mark.parametrize("opening", ["def f():\n", "def f(" + "a" * 60_000 + "):\n"])
def test_a_program_may_have_so_many_characters_newlines_included_and_no_more(opening):
    line = b"#" + b"x" * 98 + b"\n"
    n, rest = divmod(N_PROGRAM_CHARS - len(opening) - len("end\n"), len(line))
    for more, is_too_long in ((0, False), (1, True)):
        framer = ScriptFramer()
        last = b" " * (rest - 1 + more) + b"\n" if rest or more else b""
        found = framer.feed(opening.encode()) + framer.feed(line * n) + framer.feed(last + b"end\n")
        assert framer.is_overlong is is_too_long
        assert [len(text) for text in found] == ([] if is_too_long else [N_PROGRAM_CHARS])


def test_blank_lines_fill_no_memory():
    for more, is_too_long in ((0, False), (1, True)):
        framer = ScriptFramer()
        found = framer.feed(b"def f():\n" + b"\n" * (N_PROGRAM_LINES - 2 + more) + b"end\n")
        assert (framer.is_overlong, len(found)) == (is_too_long, 1 - more)
    framer = ScriptFramer()
    framer.feed(b"def f():\n")
    for _ in range(1000):
        framer.feed(b"\n" * 4096)
    assert framer.is_overlong
    assert not framer.is_inside, "what was read is dropped"


def test_a_program_s_length_counts_for_itself_alone():
    framer = ScriptFramer()
    text = "def f():\n" + " sync() # a long line, so that the lines are few" * 1000 + "\nend\n"
    assert framer.feed((text * 40).encode()) == [text] * 40
    assert not framer.is_overlong


@given(st.lists(st.sampled_from([PROGRAM, SECONDARY, "sync()\n", "textmsg(1)\n"]), max_size=6), st.data())
def test_where_the_stream_is_cut_makes_no_difference(programs, cuts):
    stream = "".join(programs).encode()
    framer, found, at = ScriptFramer(), [], 0
    while at < len(stream):
        n = cuts.draw(st.integers(1, 60))
        found += framer.feed(stream[at : at + n])
        at += n
    assert found == programs


@given(st.lists(st.binary(max_size=60), max_size=20))
def test_anything_is_framed_without_an_error(chunks):
    framer = ScriptFramer()
    for chunk in chunks:
        for text in framer.feed(chunk):
            assert text.endswith("\n")
