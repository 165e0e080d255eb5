"""Any message of a type, numbers that are not finite among its floats; and whether two of them are the same."""

import math
from enum import Enum
from typing import Any

import msgspec
from hypothesis import strategies as st

__all__ = ["any_of", "is_same"]

INTEGERS = st.integers(-(2**63), 2**63 - 1)
TEXTS = st.one_of(
    st.text(max_size=8), st.sampled_from(["NaN", "Infinity", "-Infinity", "null", "1", "~NaN", "~~", "~-Infinity"])
)


def any_of(kind):
    """Return a strategy of values of a type, as msgspec sees it."""
    return _of(msgspec.inspect.type_info(kind))


def _of(info):
    inspect = msgspec.inspect
    simple = {
        inspect.FloatType: st.floats(),
        inspect.IntType: INTEGERS,
        inspect.StrType: TEXTS,
        inspect.BoolType: st.booleans(),
        inspect.NoneType: st.none(),
        inspect.BytesType: st.binary(max_size=64),
    }
    if type(info) in simple:
        return simple[type(info)]
    if isinstance(info, inspect.EnumType):
        return st.sampled_from(list(info.cls))
    if isinstance(info, inspect.TupleType):
        return st.tuples(*map(_of, info.item_types))
    if isinstance(info, inspect.VarTupleType):
        return st.lists(_of(info.item_type), max_size=3).map(tuple)
    if isinstance(info, inspect.DictType):
        return st.dictionaries(_of(info.key_type), _of(info.value_type), max_size=3)
    if isinstance(info, inspect.UnionType):
        return st.one_of(*map(_of, info.types))
    assert isinstance(info, inspect.StructType), info
    return st.builds(info.cls, **{field.name: _of(field.type) for field in info.fields})


def is_same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, a NaN being equal to a NaN."""
    if type(one) is not type(other):
        return False
    if isinstance(one, float):
        return one == other or (math.isnan(one) and math.isnan(other))
    if isinstance(one, msgspec.Struct):
        return all(is_same(getattr(one, name), getattr(other, name)) for name in one.__struct_fields__)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(is_same(one[key], other[key]) for key in one)
    assert isinstance(one, str | int | bool | bytes | Enum | None), one
    return one == other
