"""From text to tokens. Comments, blanks and program labels vanish; a token remembers whether it begins its line."""

import re

import msgspec

from sim_twin.controller.script.errors import ScriptSyntaxError

__all__ = ["KEYWORDS", "Token", "line_at", "tokens_of"]

KEYWORDS = frozenset(
    {"def", "sec", "thread", "end", "if", "elif", "else", "while", "break", "continue", "return", "global", "local"}
    | {"and", "or", "xor", "not", "True", "False", "run", "kill", "join", "enter_critical", "exit_critical", "halt"}
)

# Ordered by how often each occurs. A label, `$ 7 "text"`, is what PolyScope writes between statements.
_PATTERN = re.compile(
    r"""(?P<blank>[ \t\r\f]+|\#[^\n]*|\$[ ]*\d+[ ]*"[^"\n]*"(?:[ ]*,[ ]*"[^"\n]*")?)
    |(?P<name>[A-Za-z_][A-Za-z_0-9]*)
    |(?P<newline>\n)
    |(?P<number>0[xX][0-9a-fA-F]+|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    |(?P<symbol>==|!=|<=|>=|[-+*/%=<>()\[\],:.;])
    |(?P<string>"[^"\n]*"|'[^'\n]*')""",
    re.VERBOSE,
)


class Token(msgspec.Struct, frozen=True, gc=False):
    """A word of the program.

    Attributes:
        kind: name, number, string, end of text, or for keywords and symbols the text itself.
        text: As it stands.
        offset: Where it begins in the program's text.
        line: On which line, counted from one.
        is_first: It is the first on its line.
    """

    kind: str
    text: str
    offset: int
    line: int
    is_first: bool


def line_at(text: str, offset: int) -> str:
    """Return the line of a text that a place is on, without its end."""
    end = text.find("\n", offset)
    return text[text.rfind("\n", 0, offset) + 1 : len(text) if end < 0 else end].rstrip("\r")


def tokens_of(text: str) -> list[Token]:
    """Cut a text into tokens, with one of kind "end of text" at the end.

    Raises:
        ScriptSyntaxError: A character begins no token, or a string is not closed on its line.
    """
    tokens: list[Token] = []
    line, at, is_first = 1, 0, True
    match = _PATTERN.match
    while found := match(text, at):
        kind, word = found.lastgroup or "", found.group()
        if kind == "newline":
            line += 1
            is_first = True
        elif kind != "blank":
            if kind == "symbol" or (kind == "name" and word in KEYWORDS):
                kind = word
            tokens.append(Token(kind, word, at, line, is_first))
            is_first = False
        at = found.end()
    if at != len(text):
        expected = "the closing quote on the same line" if text[at] in "\"'" else "a name, number, string or operator"
        column = at - text.rfind("\n", 0, at)
        raise ScriptSyntaxError(line=line, column=column, text=line_at(text, at), expected=expected, got=repr(text[at]))
    tokens.append(Token("end of text", "", at, line, True))
    return tokens
