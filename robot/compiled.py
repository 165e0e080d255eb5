"""Pure maths that runs every tick, compiled to machine code when its module is imported.

A function of numbers and tuples of them is compiled by its own annotations, before anything moves: no tick waits for a
compiler, and a type that is none of these is an error at import. Machine code is kept beside the module for the next
process, where a folder may be written to. With NUMBA_DISABLE_JIT=1 in the environment everything runs as Python, for
coverage and for mutants.

Inside there is no ValueError: the root of a negative number is not a number there, as in C.
"""

from collections.abc import Callable
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin, get_type_hints

import numba
import numpy as np
from numba import types
from numpy.typing import NDArray

__all__ = ["Bits2", "Bytes2", "Bytes3", "Floats2", "Floats3", "Ints2", "Table", "compiled"]

Table = NDArray[np.float64]
"""Rows of numbers, contiguous: (n, m)."""
Bytes2 = Annotated[NDArray[np.uint8], 2]
"""A mask or one channel, contiguous: (h, w)."""
Bytes3 = Annotated[NDArray[np.uint8], 3]
"""A picture, contiguous: (h, w, 3)."""
Bits2 = Annotated[NDArray[np.uint32], 2]
"""A set of bits a pixel, contiguous: (h, w)."""
Ints2 = Annotated[NDArray[np.int32], 2]
"""A whole number for each pixel, or rows of them, contiguous: (h, w)."""
Floats2 = Annotated[NDArray[np.float32], 2]
"""A picture of numbers that need no more digits, contiguous: (h, w)."""
Floats3 = Annotated[NDArray[np.float64], 3]
"""Numbers of each pixel, contiguous: (h, w, n)."""

Function = TypeVar("Function", bound=Callable[..., object])

_ARRAYS = {
    Bytes2: types.uint8,
    Floats2: types.float32,
    Ints2: types.int32,
    Bytes3: types.uint8,
    Bits2: types.uint32,
    Floats3: types.float64,
}
_SCALARS = {float: types.float64, int: types.int64, bool: types.boolean}


def compiled(function: Function) -> Function:
    """Return a function as machine code.

    Args:
        function: takes and returns floats, integers, truths, tables and tuples of them, all annotated.

    Raises:
        TypeError: an annotation is none of these.
    """
    hints = get_type_hints(function, include_extras=True)
    result = _kind(hints.pop("return"))
    signature = result(*map(_kind, hints.values()))
    try:
        return cast(Function, numba.njit(signature, cache=True)(function))
    except RuntimeError:  # there is no folder that machine code may be kept in
        return cast(Function, numba.njit(signature)(function))


def _kind(hint: Any) -> types.Type:  # noqa: ANN401 - whatever somebody wrote behind a colon
    if hint in _SCALARS:
        return _SCALARS[hint]
    if hint == Table:
        return types.float64[:, ::1]
    if hint in _ARRAYS:
        return types.Array(_ARRAYS[hint], hint.__metadata__[0], "C")
    parts = get_args(hint)
    if get_origin(hint) is tuple and parts and ... not in parts:
        return types.Tuple([_kind(part) for part in parts])
    raise TypeError(f"expected numbers, tables and tuples of them behind colons of a compiled function, came {hint}")
