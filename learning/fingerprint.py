"""A fingerprint of everything learnt: two learners have the same one when they are the same, bit for bit. Pure."""

import hashlib
import struct
from typing import Any

import numpy as np

__all__ = ["fingerprint"]


def fingerprint(state: dict[str, Any]) -> str:
    """Return a digest of a state tree as a checkpoint keeps it: of every key, number and array, types among them."""
    digest = hashlib.sha256()
    _add(digest, state)
    return digest.hexdigest()


def _add(digest: "hashlib._Hash", value: object) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"a{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif isinstance(value, dict):
        digest.update(f"d{len(value)}".encode())
        for key, item in value.items():
            digest.update(f"k{len(key)}{key}".encode())
            _add(digest, item)
    elif isinstance(value, list):
        digest.update(f"l{len(value)}".encode())
        for item in value:
            _add(digest, item)
    elif isinstance(value, float):
        digest.update(b"f" + struct.pack("<d", value))
    else:
        raw = f"{type(value).__name__}{value}".encode()
        digest.update(f"p{len(raw)}".encode() + raw)
