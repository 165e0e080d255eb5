import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.script import Interpreter, Program, ScriptSyntaxError, Status, parse_program
from sim_twin.controller.script.lexer import KEYWORDS, tokens_of
from sim_twin.controller.script.syntax import Assign, Binary, Call, Constant, Evaluate, Logic, Name, Place, PoseLiteral
from tests.support.scripts import program

WORDS = [
    *sorted(KEYWORDS),
    *["a", "b", "p", "f", "struct", "1", "2.5", "0x1F", '"s"', "# c", '$ 1 "x"', "\n", "\n\n", "    "],
    *["(", ")", "[", "]", ",", ":", ";", "=", "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", ".", "p["],
]
TEMPLATES = [
    "def {}():\n {}\nend\n",
    "def f():\n if {}:\n  {}\n end\nend",
    "def f():\n x = [{}, {}]\nend",
    "def f():\n {} = {}\nend",
    "def f({}):\n f({})\nend",
    "{} {}",
]


def parse_or_refuse(text):
    """Parse, and hold the refusal to its word: a place inside the text."""
    try:
        parse_program(text)
    except ScriptSyntaxError as caught:
        error = caught
    else:
        return
    lines = text.split("\n")
    assert 1 <= error.line <= len(lines)
    assert 1 <= error.column <= len(lines[error.line - 1]) + 1
    assert "expected" in str(error)
    assert "got" in str(error)


@given(st.text(max_size=60))
def test_any_text_parses_or_is_refused(text):
    parse_or_refuse(text)


@given(st.lists(st.sampled_from(WORDS), max_size=30))
def test_any_words_of_the_language_parse_or_are_refused(words):
    parse_or_refuse(" ".join(words))


@given(st.sampled_from(TEMPLATES), *[st.lists(st.sampled_from(WORDS), max_size=8)] * 2)
def test_any_words_in_a_program_parse_or_are_refused(template, first, second):
    parse_or_refuse(template.format(" ".join(first), " ".join(second)))


@given(st.data())
def test_a_program_with_a_piece_cut_out_parses_or_is_refused(data):
    text = program(
        "global a = p[1, 2, 3, 4, 5, 6]\nthread t():\n while not a[0] > 2:\n f(a, b=[1])\n end\nend\nh = run t()"
    )
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, len(text)))
    parse_or_refuse(text[:begin] + text[end:])


@pytest.mark.parametrize("n", [10, 39, 41, 100, 5000])
@pytest.mark.parametrize(
    "shape",
    [
        lambda n: "x = " + "(" * n + "1" + ")" * n,
        lambda n: "x = " + "[" * n + "1" + "]" * n,
        lambda n: "x = " + "- " * n + "1",
        lambda n: "x = " + "not " * n + "True",
        lambda n: "x = 1" + " + 1" * n,
        lambda n: "x = " + "(" * min(n, 30) + "1" + " + 1" * n + ")" * min(n, 30),
        lambda n: "x = " + "(" * min(n, 30) + "1" + (" + 1" * 50 + ")") * min(n, 30),
        lambda n: "x = " + "(" * min(n, 30) + "1" + (" + 1" * 50 + " or 1)") * min(n, 30),
        lambda n: "x = True" + " or True and False" * n,
        lambda n: "x = a" + "[0]" * n,
        lambda n: "x = a" + ".b" * n,
        lambda n: "x = " + "f(" * n + ")" * n,
        lambda n: "if True:\n" * n + "end\n" * n,
        lambda n: "while True:\n" * n + "end\n" * n,
        lambda n: "".join(f"def f{i}():\n" for i in range(n)) + "end\n" * n,
        lambda n: "if a:\n" + "elif b:\n" * n + "end",
        lambda n: "x = 1\n" * n,
        lambda n: "x = [" + "1, " * n + "]",
        lambda n: "x = " + "9" * n,
    ],
)
def test_however_deep_or_long_a_program_is_it_is_refused_or_runs(shape, n):
    text = program(shape(n))
    parse_or_refuse(text)
    try:
        parsed = parse_program(text)
    except ScriptSyntaxError:
        return
    interpreter = Interpreter(parsed, {"f": lambda *values: 0}, variables={"a": True, "b": False}, slice_budget=10_000)
    interpreter.step()
    assert interpreter.status is not Status.RUNNING


@pytest.mark.parametrize(
    ("text", "line", "column", "expected", "got"),
    [
        ("def p():\n x = \nend", 3, 1, "a value", "'end'"),
        ("def p():\n x = 1", 2, 7, "'end'", "end of text"),
        ("def p()\n x = 1\nend", 2, 2, "':'", "'x'"),
        ("def p():\n f(1\n x = 2\nend", 3, 2, "','", "'x'"),
        ("def p():\n x = 1 y = 2\nend", 2, 8, "the end of the line", "'y'"),
        ("def p():\n x\nend", 3, 1, "'=' or a call's '('", "'end'"),
        ("def p():\n f() = 1\nend", 2, 6, "a variable, an element or a member", "something else"),
        ("def p():\n break\nend", 2, 2, "a loop around 'break'", "none"),
        ("return 1", 1, 1, "a function around 'return'", "none"),
        ("def p():\n if True:\n  def f():\n   continue\n  end\n end\nend", 4, 4, "a loop", "none"),
        ("def p():\n x = p[1, 2, 3]\nend", 3, 1, "six numbers", "3"),
        ("def p():\n x = a[]\nend", 3, 1, "one or two indexes", "0"),
        ('def p():\n x = "open\nend', 2, 6, "the closing quote", "'\"'"),
        ("def p():\n x = 3 ? 4\nend", 2, 8, "a name, number, string or operator", "'?'"),
        ("def p():\n f(a=1, 2)\nend", 2, 9, "a keyword argument", "'2'"),
        ("def p():\n f(a=1, a=2)\nend", 2, 9, "different names", "'a'"),
        ("def p(a):\n x = 1\nend", 3, 4, "a program without parameters", "1 of them"),
        ("def p():\n def f(a=1, b):\n end\nend", 2, 14, "'=' and a default", "')'"),
        ("def p():\n def f(a, a):\n end\nend", 2, 12, "different names", "twice"),
        ("def p():\n thread t(a):\n end\nend", 3, 2, "a thread without parameters", "1 of them"),
        ("def p():\n sec q():\n end\nend", 2, 2, "'def' or 'thread'", "'sec'"),
        ("def p():\nend\nf()", 3, 1, "the end of the text", "'f'"),
        ("def p():\n global 3 = 4\nend", 2, 9, "a variable's name", "'3'"),
        ("def p():\n x = run\nend", 3, 1, "a thread's name", "'end'"),
        ("def p():\n else:\n end\nend", 2, 2, "'end'", "'else'"),
        ("end", 1, 1, "the end of the text", "'end'"),
    ],
)
def test_a_refusal_says_where_what_was_expected_and_what_came(text, line, column, expected, got):
    with pytest.raises(ScriptSyntaxError) as caught:
        parse_program(text)
    assert (caught.value.line, caught.value.column) == (line, column)
    assert expected in str(caught.value).partition("expected ")[2].rpartition(", got ")[0]
    assert got in str(caught.value).rpartition(", got ")[2]


@pytest.mark.parametrize(("head", "name", "is_secondary"), [("def one", "one", False), ("sec two", "two", True)])
def test_a_program_knows_its_name_and_kind(head, name, is_secondary):
    parsed = parse_program(f"{head}():\n f()\nend\n")
    assert (parsed.name, parsed.is_secondary, len(parsed.body)) == (name, is_secondary, 1)


def test_an_empty_text_is_an_empty_program():
    assert parse_program("") == parse_program("# nothing\n\n") == Program("", False, ())


def test_the_tree_of_a_few_statements_by_hand():
    parsed = parse_program("x = 1 + y * 2\nf(a, b=p[1, 2, 3, 4, 5, 6])\nz = a or b or c and d")
    product = Binary("*", Name("y", 1, 9), Constant(2))
    six = PoseLiteral(tuple(Constant(i) for i in range(1, 7)))
    both = Logic("and", (Name("c", 3, 15), Name("d", 3, 21)))
    chain = Logic("or", (Name("a", 3, 5), Name("b", 3, 10), both))
    assert parsed.body == (
        Assign(Place(1, 1), "", Name("x", 1, 1), Binary("+", Constant(1), product)),
        Evaluate(Place(2, 1), Call("f", (Name("a", 2, 3),), (("b", six),), 2, 1)),
        Assign(Place(3, 1), "", Name("z", 3, 1), chain),
    )


def test_layout_does_not_change_the_tree_but_for_its_lines():
    def shape(text):
        return [(token.kind, token.text) for token in tokens_of(text)]

    assert shape("x=1+y") == shape("  x   = # one\n\n 1\t+ y # two\r\n")


def test_return_takes_a_value_from_its_own_line_only():
    with pytest.raises(ScriptSyntaxError):
        parse_program("def p():\n return\n 1\nend")
    assert len(parse_program("def p():\n def f():\n  return\n  x = 1\n end\nend").body[0].body) == 2
