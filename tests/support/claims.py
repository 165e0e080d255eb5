"""Reads a page of claims: which tests it names, and which of those are not there or do not run."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

__all__ = ["faults_of"]

TICKED = re.compile(r"`([^`]+)`")
NAMED = re.compile(r"(?P<file>(?:[\w./-]*/)?test_\w+\.py)?(?:::(?P<test>\w+))?")
HEAD = "claim"
"""A table whose first column is called so holds one claim a row."""
SEPARATOR = re.compile(r"\|[-:| ]+\|")


def faults_of(page: str, root: Path) -> list[str]:
    """Return what is wrong with the claims of a page, in words; nothing where every one names a living test.

    Args:
        page: its text.
        root: the folder that holds `tests`.
    """
    return [*_names_that_lead_nowhere(page, root), *_rows_without_a_test(page, root)]


def _names_that_lead_nowhere(page: str, root: Path) -> Iterator[str]:
    for block in _blocks(page):
        file: Path | None = None
        for ticked in TICKED.findall(block):
            named = NAMED.fullmatch(ticked)
            if named is None or not ticked:
                continue
            if named["file"]:
                found = _files(named["file"], root)
                if len(found) != 1:
                    yield f"{ticked}: expected exactly one such file, there are {len(found)}"
                    file = None
                    continue
                (file,) = found
            if named["test"]:
                yield from _test_faults(ticked, file, named["test"])


def _blocks(page: str) -> Iterator[str]:
    """A row of a table, an item of a list or a paragraph: in it `::name` is of the file that was named last."""
    block: list[str] = []
    for line in page.splitlines():
        if block and (not line.strip() or line.startswith(("|", "* ", "- ", "#")) or re.match(r"\d+\. ", line)):
            yield " ".join(block)
            block = []
        block.append(line)
    yield " ".join(block)


def _files(name: str, root: Path) -> list[Path]:
    if "/" in name:
        return [path for path in [root / name] if path.is_file()]
    return sorted((root / "tests").rglob(name))


def _test_faults(ticked: str, file: Path | None, test: str) -> Iterator[str]:
    if file is None:
        yield f"{ticked}: expected a file named before it"
        return
    tree = ast.parse(file.read_text(encoding="utf-8"))
    made = [n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == test]
    if not made or not test.startswith("test_"):
        yield f"{ticked}: expected a test function of that name in {file.name}"
    elif _is_skipped(made[0].decorator_list) or _is_skipped(_file_marks(tree)):
        yield f"{ticked}: it is skipped whatever happens"


def _file_marks(tree: ast.Module) -> list[ast.expr]:
    marks: list[ast.expr] = []
    for node in tree.body:
        if isinstance(node, ast.Assign) and [ast.unparse(t) for t in node.targets] == ["pytestmark"]:
            marks += node.value.elts if isinstance(node.value, ast.List | ast.Tuple) else [node.value]
    return marks


def _is_skipped(marks: list[ast.expr]) -> bool:
    """Whether a mark skips without a condition, or expects a failure without one."""
    for mark in marks:
        called = mark.func if isinstance(mark, ast.Call) else mark
        name = ast.unparse(called)
        if name == "pytest.mark.skip":
            return True
        if name == "pytest.mark.xfail" and not (isinstance(mark, ast.Call) and mark.args):
            return True
        if name == "pytest.mark.skipif" and isinstance(mark, ast.Call) and mark.args:
            condition = mark.args[0]
            if isinstance(condition, ast.Constant) and condition.value and not isinstance(condition.value, str):
                return True
    return False


def _rows_without_a_test(page: str, root: Path) -> Iterator[str]:
    for row in _claims(page):
        if not any(_shows(row, root)):
            yield f"{row[0]}: expected a claim to name a file with tests, or one of them"


def _claims(page: str) -> Iterator[list[str]]:
    is_claims = False
    for line in page.splitlines():
        if not line.startswith("|"):
            is_claims = False
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[0] == HEAD:
            is_claims = True
        elif is_claims and not SEPARATOR.fullmatch(line):
            yield cells


def _shows(row: list[str], root: Path) -> Iterator[bool]:
    """Whether each name in a row after its first cell is that of a test function, or of a file that holds one."""
    for ticked in TICKED.findall(" ".join(row[1:])):
        named = NAMED.fullmatch(ticked)
        if named is not None and named["test"]:
            yield True
        elif named is not None and named["file"]:
            for file in _files(named["file"], root):
                tree = ast.parse(file.read_text(encoding="utf-8"))
                yield any(isinstance(n, ast.FunctionDef) and n.name.startswith("test_") for n in tree.body)
