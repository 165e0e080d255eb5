"""Programs made up at random: whatever they do, they run, end or fail with a line; nothing else ever comes out."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_twin.controller.script import ScriptNameError, Status
from tests.support.scripts import ScriptRun, program

names = st.sampled_from(["a", "b", "c", "p", "n"])
atoms = st.one_of(
    names,
    st.integers(-3, 3).map(str),
    st.sampled_from(["1.5", "True", "False", '"s"', "[1, 2]", "p[1, 2, 3, 4, 5, 6]", "struct(a=1)", "run t()"]),
    st.sampled_from(["f(1)", "f(1, 2)", "g()", "unknown()", 'move("m", 2)', "sin(1)", "length(a)", "h(b=1)"]),
)
expressions = st.recursive(
    atoms,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "%", "==", "<", "and", "or", "xor"]), inner).map(
            " ".join
        ),
        inner.map("({})".format),
        inner.map("not ({})".format),
        inner.map("-{}".format),
        st.lists(inner, max_size=3).map(lambda parts: f"[{', '.join(parts)}]"),
        st.tuples(names, inner).map(lambda pair: f"{pair[0]}[{pair[1]}]"),
        names.map("{}.a".format),
        st.tuples(names, inner).map(lambda pair: f"{pair[0]}.append({pair[1]})"),
    ),
    max_leaves=5,
)
simple = st.one_of(
    st.tuples(names, expressions).map(" = ".join),
    st.tuples(st.sampled_from(["global", "local"]), names, expressions).map(lambda s: f"{s[0]} {s[1]} = {s[2]}"),
    st.tuples(names, expressions, expressions).map(lambda s: f"{s[0]}[{s[1]}] = {s[2]}"),
    st.tuples(names, expressions).map(lambda s: f"{s[0]}.a = {s[1]}"),
    expressions.map("note({})".format),
    st.tuples(st.sampled_from(["kill", "join"]), expressions).map(" ".join),
    st.sampled_from(["sync()", "sleep(0.004)", "enter_critical", "exit_critical", "halt", "f(2)", "run t()"]),
)
blocks = st.recursive(
    st.lists(simple, min_size=1, max_size=4).map("\n".join),
    lambda inner: st.one_of(
        st.tuples(inner, inner).map("\n".join),
        st.tuples(expressions, inner, inner).map(lambda s: f"if {s[0]}:\n{s[1]}\nelse:\n{s[2]}\nend"),
        st.tuples(expressions, inner).map(lambda s: f"while {s[0]}:\n{s[1]}\nend"),
        inner.map("while True:\n{}\nbreak\nend".format),
        st.tuples(names, inner).map(lambda s: f"def g({s[0]}=1):\n{s[1]}\nend"),
    ),
    max_leaves=4,
)


@settings(max_examples=300)
@given(blocks, blocks, blocks)
def test_a_program_runs_ends_or_fails_with_a_line(main, function, thread):
    head = "if False:\nb = 1\nc = 1\np = 1\nn = 1\ndef g():\nend\ndef h(b):\nend\nend\na = [1, [2]]"
    text = program(f"def f(a, b=2):\n{function}\nreturn a\nend\nthread t():\n{thread}\nend\n{head}\n{main}")
    if "unknown" in text:
        with pytest.raises(ScriptNameError) as caught:
            ScriptRun(text)
        assert text.split("\n")[caught.value.line - 1][caught.value.column - 1 :].startswith("unknown")
        return
    run = ScriptRun(text, slice_budget=200).step(6)
    status, error = run.interpreter.status, run.interpreter.error
    assert (error is not None) == (status is Status.FAILED)
    if error is not None:
        assert 2 <= error.line <= text.count("\n")
        assert error.message
    again = ScriptRun(text, slice_budget=200).step(6)
    assert (again.interpreter.status, again.interpreter.error) == (status, error)
    assert [str(note) for note in again.notes] == [str(note) for note in run.notes]
    run.interpreter.stop()
    again.interpreter.stop()
