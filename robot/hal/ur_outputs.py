"""Output terminals of the control box, by number, through the client that writes them and cannot move an arm."""

from rtde_io import RTDEIOInterface

__all__ = ["changed_bits", "put_output"]

N_STANDARD, N_BITS = 8, 16
"""Terminals below the first number are standard ones, the rest up to the second configurable ones."""


def changed_bits(before: int, after: int) -> list[int]:
    """Return the numbers of the terminals that differ."""
    return [i for i in range(N_BITS) if (before ^ after) >> i & 1]


def put_output(outputs: RTDEIOInterface, i: int, *, is_high: bool) -> bool:
    """Switch terminal i, 0 to 15, and return whether the client took it."""
    if i < N_STANDARD:
        return outputs.setStandardDigitalOut(i, is_high)
    return outputs.setConfigurableDigitalOut(i - N_STANDARD, is_high)
