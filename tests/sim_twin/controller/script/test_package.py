import pytest

from sim_twin.controller import pose, script
from sim_twin.controller.script import (
    arithmetic,
    builtins,
    code,
    context,
    errors,
    lexer,
    parser,
    scopes,
    syntax,
    threads,
    values,
)


@pytest.mark.parametrize(
    "module",
    [arithmetic, builtins, code, context, errors, lexer, parser, pose, scopes, script, syntax, threads, values],
)
def test_every_name_in_all_exists(module):
    for name in module.__all__:
        assert hasattr(module, name)
