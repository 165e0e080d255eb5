"""General purpose registers: what RTDE clients and programs leave for one another. They outlive programs."""

from collections.abc import Callable

__all__ = ["N_BITS", "N_NUMBERS", "RegisterBank", "Registers"]

N_BITS, N_NUMBERS = 128, 48
_WORD_BITS = 32
_INT32 = 1 << 32


class RegisterBank:
    """One direction's registers.

    Attributes:
        bits: 128 flags.
        ints: 48 signed 32-bit integers.
        doubles: 48 numbers.
    """

    def __init__(self) -> None:
        self.bits = [False] * N_BITS
        self.ints = [0] * N_NUMBERS
        self.doubles = [0.0] * N_NUMBERS

    def set_int(self, i: int, value: int) -> None:
        """Store an integer as 32 bits with a sign."""
        self.ints[_place(i, N_NUMBERS)] = (value + _INT32 // 2) % _INT32 - _INT32 // 2

    def set_double(self, i: int, value: float) -> None:
        """Store a number."""
        self.doubles[_place(i, N_NUMBERS)] = float(value)

    def set_bit(self, i: int, value: bool) -> None:
        """Store a flag."""
        self.bits[_place(i, N_BITS)] = bool(value)

    def int_at(self, i: int) -> int:
        """Return an integer."""
        return self.ints[_place(i, N_NUMBERS)]

    def double_at(self, i: int) -> float:
        """Return a number."""
        return self.doubles[_place(i, N_NUMBERS)]

    def bit_at(self, i: int) -> bool:
        """Return a flag."""
        return self.bits[_place(i, N_BITS)]

    def word(self, first: int) -> int:
        """Return 32 flags as bits, the first the lowest."""
        return sum(1 << i for i, bit in enumerate(self.bits[first : first + _WORD_BITS]) if bit)

    def set_word(self, first: int, word: int) -> None:
        """Store 32 flags."""
        self.bits[first : first + _WORD_BITS] = [bool(word >> i & 1) for i in range(_WORD_BITS)]


class Registers:
    """Both directions, and RTDE's names for them.

    Attributes:
        inputs: Clients write, programs read.
        outputs: Programs write, clients read.
    """

    def __init__(self) -> None:
        self.inputs = RegisterBank()
        self.outputs = RegisterBank()
        self._writers = _writers(self.inputs)

    def writer(self, name: str) -> Callable | None:
        """Return what stores under RTDE's name; None where there is no such register."""
        return self._writers.get(name)

    def getters(self) -> dict[str, Callable[[], bool | int | float]]:
        """Return what reads each register, by RTDE's names."""
        found: dict[str, Callable[[], bool | int | float]] = {}
        for word, bank in (("input", self.inputs), ("output", self.outputs)):
            for i in range(N_NUMBERS):
                found[f"{word}_int_register_{i}"] = _reader(bank.ints, i)
                found[f"{word}_double_register_{i}"] = _reader(bank.doubles, i)
            for i in range(64, N_BITS):
                found[f"{word}_bit_register_{i}"] = _reader(bank.bits, i)
            for first in (0, 32):
                found[f"{word}_bit_registers{first}_to_{first + 31}"] = _word_reader(bank, first)
        return found


def _place(i: int, n: int) -> int:
    if not 0 <= i < n:
        raise ValueError(f"expected a register from 0 to {n - 1}, got {i}")
    return i


def _writers(bank: RegisterBank) -> dict[str, Callable]:
    found: dict[str, Callable] = {}
    for i in range(N_NUMBERS):
        found[f"input_int_register_{i}"] = _setter(bank.set_int, i)
        found[f"input_double_register_{i}"] = _double_setter(bank.doubles, i)
    for i in range(64, N_BITS):
        found[f"input_bit_register_{i}"] = _setter(bank.set_bit, i)
    for first in (0, 32):
        found[f"input_bit_registers{first}_to_{first + 31}"] = _setter(bank.set_word, first)
    return found


def _setter(store: Callable, i: int) -> Callable:
    return lambda value: store(i, value)


def _double_setter(values: list[float], i: int) -> Callable:
    """Of the eleven that come with every servoj: without a look at the number, which is in range."""

    def store(value: float) -> None:
        values[i] = float(value)

    return store


def _reader(values: list, i: int) -> Callable:
    return lambda: values[i]


def _word_reader(bank: RegisterBank, first: int) -> Callable[[], int]:
    return lambda: bank.word(first)
