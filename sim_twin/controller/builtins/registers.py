"""General purpose registers and the watchdogs on them."""

from sim_twin.controller.machine import Machine
from sim_twin.controller.registers import RegisterBank
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import flag, integer, number, text
from sim_twin.controller.watchdogs import WatchdogAction
from sim_twin.controller.wire import input_fields

__all__ = ["register_builtins"]


def register_builtins(machine: Machine) -> Builtins:
    """Return reads of both directions, writes of the outputs, and rtde_set_watchdog."""
    registers = machine.registers
    known = input_fields(machine.version)

    def rtde_set_watchdog(variable_name: Value, min_frequency: Value, action: Value = "pause") -> Value:
        name = text(variable_name)
        if name not in known:
            raise ValueError(f"expected the name of an RTDE input, got '{name}'")
        machine.watchdogs.set(name, number(min_frequency), _action_of(text(action)))

    return {
        **_reads("input", registers.inputs),
        **_reads("output", registers.outputs),
        **_writes(registers.outputs),
        "rtde_set_watchdog": rtde_set_watchdog,
    }


def _action_of(word: str) -> WatchdogAction:
    actions = {action.value: action for action in WatchdogAction}
    if word.lower() not in actions:
        raise ValueError(f"expected one of the actions {', '.join(actions)}, got '{word}'")
    return actions[word.lower()]


def _reads(direction: str, bank: RegisterBank) -> Builtins:
    def read_integer(address: Value) -> Value:
        return bank.int_at(integer(address))

    def read_float(address: Value) -> Value:
        return bank.double_at(integer(address))

    def read_boolean(address: Value) -> Value:
        return bank.bit_at(integer(address))

    return {
        f"read_{direction}_boolean_register": read_boolean,
        f"read_{direction}_float_register": read_float,
        f"read_{direction}_integer_register": read_integer,
    }


def _writes(bank: RegisterBank) -> Builtins:
    def write_integer(address: Value, value: Value) -> Value:
        bank.set_int(integer(address), integer(value))

    def write_float(address: Value, value: Value) -> Value:
        bank.set_double(integer(address), number(value))

    def write_boolean(address: Value, value: Value) -> Value:
        bank.set_bit(integer(address), flag(value))

    return {
        "write_output_boolean_register": write_boolean,
        "write_output_float_register": write_float,
        "write_output_integer_register": write_integer,
    }
