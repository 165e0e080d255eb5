"""Digital and analogue inputs and outputs, of the box and of the tool."""

from collections.abc import Callable, Sequence

from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import flag, integer, number

__all__ = ["terminal_builtins"]

# The deprecated names without a kind know the tool's terminals as 8 and 9 (e-Series script directory).
_KINDS = {
    "standard_": range(8),
    "configurable_": range(8, 16),
    "tool_": range(16, 18),
    "": (*range(8), *range(16, 18)),
}
_FIRST_OF_TOOL = 2


def terminal_builtins(machine: Machine) -> Builtins:
    """Return the setters and getters of terminals."""
    found: dict[str, Callable[..., Value]] = {}
    for kind, bits in _KINDS.items():
        found[f"set_{kind}digital_out"] = _switch(machine, bits)
        found[f"get_{kind}digital_out"] = _reader(lambda: machine.io.digital_out, bits)
        found[f"get_{kind}digital_in"] = _reader(lambda: machine.io.digital_in, bits)
    return {**found, **_analogue_inputs(machine), **_analogue_outputs(machine), **_flags(machine)}


def _switch(machine: Machine, bits: Sequence[int]) -> Callable[..., Value]:
    def switch(n: Value, b: Value) -> Value:
        machine.io.set_digital_out(bits[_below(n, len(bits))], flag(b))

    return switch


def _reader(terminals: Callable[[], int], bits: Sequence[int]) -> Callable[..., Value]:
    def read(n: Value) -> Value:
        return bool(terminals() >> bits[_below(n, len(bits))] & 1)

    return read


def _analogue_inputs(machine: Machine) -> Builtins:
    io = machine.io

    def get_standard_analog_in(n: Value) -> Value:
        return io.analog_input(_below(n, 2))

    def get_tool_analog_in(n: Value) -> Value:
        return io.tool_analog_in[_below(n, 2)]

    def get_analog_in(n: Value) -> Value:
        i = _below(n, 4)
        return io.analog_input(i) if i < _FIRST_OF_TOOL else io.tool_analog_in[i - _FIRST_OF_TOOL]

    def set_standard_analog_input_domain(port: Value, domain: Value) -> Value:
        io.analog_in_domain[_below(port, 2)] = _below(domain, 2)

    def set_analog_inputrange(port: Value, range: Value) -> Value:
        _below(port, 4)
        _below(range, 5)

    return {
        "get_analog_in": get_analog_in,
        "get_standard_analog_in": get_standard_analog_in,
        "get_tool_analog_in": get_tool_analog_in,
        "set_analog_inputrange": set_analog_inputrange,
        "set_standard_analog_input_domain": set_standard_analog_input_domain,
    }


def _analogue_outputs(machine: Machine) -> Builtins:
    io = machine.io

    def set_standard_analog_out(n: Value, f: Value) -> Value:
        share = number(f)
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"expected a share from 0 to 1, got {share:g}")
        io.analog_out[_below(n, 2)] = share

    def set_analog_outputdomain(port: Value, domain: Value) -> Value:
        io.analog_out_domain[_below(port, 2)] = _below(domain, 2)

    def get_standard_analog_out(n: Value) -> Value:
        return io.analog_output(_below(n, 2))

    def set_tool_voltage(voltage: Value) -> Value:
        volts = integer(voltage)
        if volts not in (0, 12, 24):
            raise ValueError(f"expected 0, 12 or 24 V, got {volts}")
        io.tool_voltage_v = volts

    return {
        "get_analog_out": get_standard_analog_out,
        "get_standard_analog_out": get_standard_analog_out,
        "set_analog_out": set_standard_analog_out,
        "set_analog_outputdomain": set_analog_outputdomain,
        "set_standard_analog_out": set_standard_analog_out,
        "set_tool_voltage": set_tool_voltage,
    }


def _flags(machine: Machine) -> Builtins:
    flags = machine.io.flags

    def set_flag(n: Value, b: Value) -> Value:
        flags[_below(n, len(flags))] = flag(b)

    def get_flag(n: Value) -> Value:
        return flags[_below(n, len(flags))]

    return {"get_flag": get_flag, "set_flag": set_flag}


def _below(value: Value, n: int) -> int:
    i = integer(value)
    if not 0 <= i < n:
        raise ValueError(f"expected a number from 0 to {n - 1}, got {i}")
    return i
