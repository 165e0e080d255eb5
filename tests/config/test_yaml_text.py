"""The strict part of YAML that config files are written in."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.errors import ConfigError
from config.yaml_text import MAX_DEPTH, dump_yaml, parse_yaml, shown

SCALARS = st.none() | st.booleans() | st.integers(-(10**14), 10**14) | st.floats(allow_nan=False, allow_infinity=False)
TEXTS = st.text(st.characters(codec="utf-8"), max_size=12) | st.sampled_from(
    ["on", "1e3", "1:30", "0x1F", "null", "~", ""]
)
TREES = st.dictionaries(
    TEXTS,
    st.recursive(
        SCALARS | TEXTS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3)
    ),
    max_size=4,
)


@given(TREES)
def test_a_dumped_tree_reads_back_equal_and_of_the_same_types(tree):
    back = parse_yaml(dump_yaml(tree), "file")
    assert back == tree
    assert repr(back) == repr(tree)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("-3", -3),
        ("1e-3", 1e-3),
        (".5", 0.5),
        ("2.", 2.0),
        ("true", True),
        ("~", None),
        ("", None),
        ("yes", "yes"),
        ("on", "on"),
        ("0x10", "0x10"),
        ("1:30", "1:30"),
        ("2026-01-01", "2026-01-01"),
        ("'1'", "1"),
        ('"null"', "null"),
        ("nan", "nan"),
    ],
)
def test_a_scalar_means_what_it_looks_like(text, value):
    tree = parse_yaml(f"key: {text}", "file")
    assert tree == {"key": value}
    assert type(tree["key"]) is type(value)


@pytest.mark.parametrize(
    ("text", "where", "expected", "got"),
    [
        ("", "", "a mapping", "an empty file"),
        ("# only a comment\n", "", "a mapping", "an empty file"),
        ("a: 1\na: 2\n", "", "each key once", "'a' again in line 2"),
        ("a: {b: 1, b: 2}\n", "a", "each key once", "'b' again in line 1"),
        ("1: 2\n", "", "text as key", "1 in line 1"),
        ("[a]: 2\n", "", "text as key", "a list of 1 in line 1"),
        ("a: &x 1\nb: *x\n", "a", "a plain value", "an anchor or alias in line 1"),
        ("a: &x [*x]\n", "a", "a plain value", "an anchor or alias in line 1"),
        ("a: !!python/object:os.system 1\n", "a", "a plain value", "the tag"),
        ("a: !!str 1\n", "a", "a plain value", "the tag"),
        ("a: .nan\n", "a", "a finite number", ".nan"),
        ("a: [0, -.inf]\n", "a[1]", "a finite number", "-.inf"),
        ("a: 1e999\n", "a", "a finite number", "'1e999'"),
        (f"a: 1{'0' * 20}\n", "a", "a number of at most 15 digits", "'100000000000000000000'"),
        ("a: 1\n---\nb: 2\n", "", "one document", "a second one in line 2"),
        ("a: [1, 2\nb: 3\n", "line 2, column 2", "YAML", "expected"),
        ("a: b: c\n", "line 1, column 5", "YAML", "mapping values are not allowed here"),
        ("\tx: 1\n", "line 1, column 1", "YAML", "cannot start any token"),
        ("a: \x00\n", "", "YAML", "special characters are not allowed"),
        ('a: "\\ud800"\n', "a", "text", "half a character"),
        ('a: "\\UFFFFFFFF"\n', "", "YAML", "a character or directive it cannot have"),
    ],
)
def test_text_outside_the_strict_part_is_refused_with_its_place(text, where, expected, got):
    with pytest.raises(ConfigError) as caught:
        parse_yaml(text, "file.yaml")
    assert caught.value.where == where
    assert caught.value.expected == expected
    assert got in caught.value.got
    assert str(caught.value).startswith("file.yaml: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["[" * 100_000, "- " * 20_000 + "a", "a: {" * 50_000], ids=["lists", "dashes", "maps"])
def test_deep_nesting_is_refused_before_it_costs_anything(text):
    with pytest.raises(ConfigError, match=f"expected at most {MAX_DEPTH} levels"):
        parse_yaml(text, "file")


def test_the_deepest_allowed_nesting_is_read():
    depth = MAX_DEPTH - 1
    tree = parse_yaml("[" * depth + "]" * depth, "file")
    for _ in range(depth - 1):
        (tree,) = tree
    assert tree == []


@given(st.text(st.characters(codec="utf-8"), max_size=60))
def test_any_text_gives_a_tree_or_a_config_error(text):
    try:
        told = repr(parse_yaml(text, "file"))
    except ConfigError as error:
        told = str(error)
    assert told.isprintable()


@given(st.text() | st.integers() | st.lists(st.integers()) | st.none())
def test_a_shown_value_is_short_and_printable(value):
    assert len(shown(value)) <= 60
    assert shown(value).isprintable()
