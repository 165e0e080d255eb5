"""Inputs and outputs: digital bits, analogue channels, the tool's, the speed slider. State only; the slice wires them.

Bits are numbered as RTDE numbers them: standard 0 to 7, configurable 8 to 15, tool 16 and 17.
"""

from collections.abc import Callable

from sim_twin.controller.wire import Value

__all__ = ["BOX_BITS", "N_DIGITAL", "InputsOutputs"]

N_DIGITAL = 18
BOX_BITS = 0xFFFF
"""The control box's, as the twin's table is wired."""
_TOOL_FIRST, _CONFIGURABLE_FIRST = 16, 8
_GROUPS = {
    "standard": ("standard_digital_output_mask", "standard_digital_output"),
    "configurable": ("configurable_digital_output_mask", "configurable_digital_output"),
    "tool": ("tool_digital_output_mask", "tool_digital_output"),
    "analog": (
        "standard_analog_output_mask",
        "standard_analog_output_type",
        "standard_analog_output_0",
        "standard_analog_output_1",
    ),
    "slider": ("speed_slider_mask", "speed_slider_fraction"),
}
_GROUP_BY_NAME = {name: group for group, names in _GROUPS.items() for name in names}
_FIRST_BIT = {"standard": 0, "configurable": _CONFIGURABLE_FIRST, "tool": _TOOL_FIRST}


class InputsOutputs:
    """The box's and the tool's terminals.

    Attributes:
        digital_in: Input bits, of the slice before.
        digital_out: Output bits.
        analog_in_v: Voltages at the box's two analogue inputs, of the slice before.
        analog_in_domain: 0 for current, 1 for voltage, of each; voltage, as installations have it from the start.
        analog_out: Two outputs of the box, as shares of their range.
        analog_out_domain: As of inputs; current from the start.
        tool_analog_in: Two inputs of the tool.
        tool_voltage_v: 0, 12 or 24.
        flags: The program's 32 flags (set_flag).
        set_slider: Moves the speed slider.
    """

    def __init__(self, *, set_slider: Callable[[float], None]) -> None:
        self.digital_in = self.digital_out = 0
        self.analog_in_v, self.analog_out = [0.0, 0.0], [0.0, 0.0]
        self.analog_in_domain, self.analog_out_domain = [1, 1], [0, 0]
        self.tool_analog_in = [0.0, 0.0]
        self.tool_voltage_v = 0
        self.flags = [False] * 32
        self.set_slider = set_slider
        self._written: dict[str, float] = dict.fromkeys(_GROUP_BY_NAME, 0)
        self._fresh: dict[str, set[str]] = {group: set() for group in _GROUPS}

    def write(self, name: str, value: Value) -> bool:
        """Take what a client writes under RTDE's name, and tell whether there is such an output.

        A mask and its values come one by one: a name that comes a second time begins the next package.
        """
        group = _GROUP_BY_NAME.get(name)
        if group is None:
            return False
        if name in self._fresh[group]:
            self._apply(group)
        self._written[name] = float(value) if isinstance(value, int | float) else 0.0
        self._fresh[group].add(name)
        return True

    def apply(self) -> None:
        """Bring about what was written since the last slice."""
        for group, fresh in self._fresh.items():
            if fresh:
                self._apply(group)

    def analog_input(self, i: int) -> float:
        """Return what an input reads, in V or A by its domain: nothing wired here drives a current."""
        return self.analog_in_v[i] if self.analog_in_domain[i] else 0.0

    def analog_output(self, i: int) -> float:
        """Return what an output gives, in V (0 to 10) or A (0.004 to 0.02) by its domain."""
        share = self.analog_out[i]
        return share * 10.0 if self.analog_out_domain[i] else 0.004 + 0.016 * share

    def set_digital_out(self, bit: int, is_on: bool) -> None:
        """Switch one output."""
        if not 0 <= bit < N_DIGITAL:
            raise ValueError(f"expected an output from 0 to {N_DIGITAL - 1}, got {bit}")
        self.digital_out = self.digital_out & ~(1 << bit) | int(is_on) << bit

    def _apply(self, group: str) -> None:
        self._fresh[group].clear()
        numbers = [self._written[name] for name in _GROUPS[group]]
        if group in _FIRST_BIT:
            first = _FIRST_BIT[group]
            mask = int(numbers[0]) << first & ((1 << N_DIGITAL) - 1)
            self.digital_out = self.digital_out & ~mask | int(numbers[1]) << first & mask
        elif group == "analog":
            self._apply_analog(*numbers)
        elif int(numbers[0]) & 1 and 0.0 <= numbers[1] <= 1.0:
            self.set_slider(numbers[1])

    def _apply_analog(self, mask: float, domain: float, *shares: float) -> None:
        for i, share in enumerate(shares):
            if int(mask) >> i & 1:
                self.analog_out_domain[i] = int(domain) >> i & 1
                self.analog_out[i] = min(max(share, 0.0), 1.0)
