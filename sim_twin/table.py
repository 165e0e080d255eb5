"""The table's driven and sensed parts: button switches, box sensors, lid drives and locks."""

import mujoco
import numpy as np

from config.scenario import Box, Button, Scenario
from robot.compiled import Table
from sim_twin.names import on_table
from sim_twin.plant_reading import table_inputs
from sim_twin.scene import leaf_names

__all__ = ["TableDrive"]

CLOSES_AT, OPENS_AT = 0.6, 0.4  # shares of a button's travel
SHUT_RAD = 0.01
IS_CLOSED = 4
"""Column of a switch's state."""


class _Lid:
    """Two leaves that move at a set speed towards open or shut, and lock when shut and not asked open."""

    def __init__(self, model: mujoco.MjModel, box: Box, tick_s: float) -> None:
        assert box.lid is not None
        names = leaf_names(box)
        self.angle_addresses = [int(model.joint(n).qposadr[0]) for n in names]
        self._controls = [model.actuator(n).id for n in names]
        self._locks = [model.equality(f"{n}/lock").id for n in names]
        self._bit = 1 << box.lid.output
        self._open_rad = box.lid.open_angle_rad
        self._step_rad = box.lid.speed_rad_s * tick_s
        self._asked_rad = 0.0
        self._was_open = False
        self._is_settled = False

    def put(self, data: mujoco.MjData, digital_out: int) -> None:
        """Place the leaves where the output says (a reset)."""
        self._was_open = bool(digital_out & self._bit)
        self._asked_rad = self._open_rad if self._was_open else 0.0
        self._is_settled = False
        for address in self.angle_addresses:
            data.qpos[address] = self._asked_rad
        self._apply(data, is_open=self._was_open)

    def drive(self, data: mujoco.MjData, digital_out: int) -> None:
        """Move the set-point by one tick and lock or free the leaves."""
        is_open = bool(digital_out & self._bit)
        if is_open == self._was_open and self._is_settled:
            return
        self._was_open = is_open
        goal = self._open_rad if is_open else 0.0
        step = min(max(goal - self._asked_rad, -self._step_rad), self._step_rad)
        self._asked_rad += step
        self._apply(data, is_open=is_open)
        self._is_settled = self._asked_rad == goal and (is_open or all(data.eq_active[lock] for lock in self._locks))

    def _apply(self, data: mujoco.MjData, *, is_open: bool) -> None:
        for control, lock, address in zip(self._controls, self._locks, self.angle_addresses, strict=True):
            data.ctrl[control] = self._asked_rad
            data.eq_active[lock] = not is_open and data.qpos[address] < SHUT_RAD


def _switch_row(model: mujoco.MjModel, button: Button) -> tuple[float, ...]:
    """Return what plant_reading.table_inputs asks of a button, with hysteresis on its travel."""
    address = int(model.joint(on_table(button.name, "travel")).qposadr[0])
    return address, CLOSES_AT * button.travel_m, OPENS_AT * button.travel_m, 1 << button.input, 0.0


def _presence_row(model: mujoco.MjModel, box: Box) -> tuple[float, ...]:
    """Return the same of a sensor in a box's floor that sees a cylinder standing or lying over it."""
    assert box.presence_input is not None
    body = model.body(on_table(box.name)).id
    return body, box.inner_m[0] / 2, box.inner_m[1] / 2, box.height_m, 1 << box.presence_input


class TableDrive:
    """All of a scenario's wiring to the physics: inputs out of it, outputs into it."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, scenario: Scenario, *, tick_s: float) -> None:
        self._qpos, self._places = data.qpos.reshape(1, -1), data.xpos
        self._switches = _table([_switch_row(model, b) for b in scenario.buttons], 5)
        self._travel = {
            b.input: (int(row[0]), b.travel_m) for b, row in zip(scenario.buttons, self._switches, strict=True)
        }
        self._lids = [_Lid(model, b, tick_s) for b in scenario.boxes if b.lid is not None]
        sensing = [b for b in scenario.boxes if b.presence_input is not None]
        self._presences = _table([_presence_row(model, b) for b in sensing], 5)
        self._cylinders = _table([(model.body(on_table(c.name)).id,) for c in scenario.cylinders], 1)

    def put(self, data: mujoco.MjData, digital_out: int) -> None:
        """Place lids where the outputs say and forget the switches (a reset)."""
        self._switches[:, IS_CLOSED] = 0.0
        for lid in self._lids:
            lid.put(data, digital_out)

    def drive(self, data: mujoco.MjData, digital_out: int) -> None:
        """Advance the lid drives by one tick."""
        for lid in self._lids:
            lid.drive(data, digital_out)

    def read_inputs(self) -> int:
        """Return the digital inputs as bits."""
        return table_inputs(self._qpos, self._places, self._switches, self._presences, self._cylinders)

    def travel(self, input_number: int) -> float:
        """Return how far a button is pressed, as a share of its travel.

        Raises:
            KeyError: no button has this input.
        """
        address, span_m = self._travel[input_number]
        return min(max(self._qpos[0, address].item() / span_m, 0.0), 1.0)


def _table(rows: list[tuple[float, ...]], width: int) -> Table:
    return np.array(rows, dtype=np.float64).reshape(-1, width)
