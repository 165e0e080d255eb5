"""The table while somebody drives, in a process of its own: a window where there is a screen, a web page where not."""

import os
import signal
import sys
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from time import sleep
from typing import Any

import msgspec

from config.resolved import Resolved
from robot.errors import WireError
from robot.messages import ArmState, Percept
from sim_twin.posing import N_ARM, N_THING, posed_numbers

__all__ = ["TwinView", "serve_view"]

START_S, CLOSE_S = 30.0, 3.0
FRAME_S = 1 / 30
LOOPBACK = "127.0.0.1"
PORT = 8080
N_PORTS = 20


class TwinView:
    """Implements robot.teleop.view.View. What is shown crosses as shared numbers: showing costs a driver no waiting.

    Args:
        resolved: the arm and the table that are driven.
    """

    def __init__(self, resolved: Resolved) -> None:
        scenario = resolved.scenario
        n_things = len(scenario.buttons) + len(scenario.boxes) + len(scenario.cylinders)
        self._resolved_json = msgspec.json.encode(resolved)
        self._context = get_context("spawn")
        self._n_numbers = N_ARM + N_THING * n_things
        self._numbers = self._context.RawArray("d", self._n_numbers + 1)
        self._process: BaseProcess | None = None

    def open(self) -> str:
        """Begin to show, and return where it can be seen.

        Raises:
            WireError: it cannot be shown here, and why.
        """
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=serve_view, args=(theirs, self._resolved_json, self._numbers), daemon=True, name="view"
        )
        process.start()
        theirs.close()
        self._process, self._pipe = process, ours
        try:
            where = ours.recv() if ours.poll(START_S) else ""
        except EOFError:
            where = ""
        if not where:
            self.close()
            raise WireError("live view: expected a window or a web page, its process ended or said nothing")
        return where

    def show(self, measured: ArmState, percept: Percept) -> None:
        """Show this from now on."""
        numbers = posed_numbers(measured, percept)
        self._numbers[: len(numbers)] = numbers  # without a percept of the table the arm alone is shown
        self._numbers[self._n_numbers] += 1.0

    def close(self) -> None:
        """End it. Idempotent, never raises."""
        process, self._process = self._process, None
        if process is not None:
            self._pipe.close()
            process.join(CLOSE_S)
            if process.is_alive():
                process.kill()
                process.join(CLOSE_S)


def serve_view(pipe: Connection, resolved_json: bytes, numbers: Sequence[float]) -> None:
    """Show what the shared numbers say until the pipe is closed at its other end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the driver's to decide on
    _divert_output()
    from sim_twin.plant import TwinWorld

    resolved = msgspec.json.decode(resolved_json, type=Resolved)
    from config.loader import load_rig

    world = TwinWorld(resolved.arm, resolved.scenario, load_rig("twin"))
    show = _show_in_window if _has_screen() else _show_on_page
    show(world, pipe, numbers)


def _has_screen() -> bool:
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _divert_output() -> None:
    """Send what viewers print nowhere: the terminal is the driver's."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)


def _show_in_window(world: Any, pipe: Connection, numbers: Sequence[float]) -> None:  # noqa: ANN401
    import mujoco.viewer

    with mujoco.viewer.launch_passive(world.model, world.data, show_left_ui=False, show_right_ui=False) as viewer:
        pipe.send("its window")
        while viewer.is_running() and not _is_over(pipe):
            with viewer.lock():
                _pose(world, numbers)
            viewer.sync()
            sleep(FRAME_S)


def _show_on_page(world: Any, pipe: Connection, numbers: Sequence[float]) -> None:  # noqa: ANN401
    """Serve MuJoCo Studio's page, on loopback only: it knows no passwords (over SSH: ssh -L 8080:localhost:8080)."""
    from mujoco.studio import app, launch_web, viewer_protocol
    from mujoco.studio.web import web_server

    bound: list[Any] = []

    def on_loopback(host: str, port: int = 0) -> Any:  # noqa: ANN401, ARG001
        bound.append(_bind(port))
        return bound[0]

    web_server.bind_public_socket = on_loopback  # it would listen to the whole network
    config = viewer_protocol.ViewerConfig(title="autotelic", gfx="web")
    with launch_web.launch(config, plugins=[app.App()]) as handle:
        handle.set_model(world.model, data=world.data)
        for _ in range(round(START_S / FRAME_S)):
            if bound and _is_answered(bound[0].getsockname()):
                break
            sleep(FRAME_S)
        else:
            return  # a process that ends without a word is told of as such
        pipe.send(f"http://{LOOPBACK}:{bound[0].getsockname()[1]}/")
        while handle.is_running() and not _is_over(pipe):
            if _pose(world, numbers):
                handle.set_model(world.model, data=world.data)
            handle.sync(world.model, world.data)
            sleep(FRAME_S)


def _bind(port: int) -> Any:  # noqa: ANN401
    """Return a socket bound to the first free port of loopback from one up."""
    import socket

    error: OSError | None = None
    for number in (port,) if port else range(PORT, PORT + N_PORTS):
        bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            bound.bind((LOOPBACK, number))
        except OSError as taken:
            bound.close()
            error = taken
        else:
            return bound
    raise RuntimeError(f"expected a free port from {PORT} on, {error}")


def _is_answered(address: tuple[str, int]) -> bool:
    """Return whether somebody listens there: a page is bound to its port some time before it is served."""
    import socket

    try:
        socket.create_connection(address, timeout=FRAME_S).close()
    except OSError:
        return False
    return True


def _pose(world: Any, numbers: Sequence[float]) -> bool:  # noqa: ANN401
    """Pose the world by the newest numbers. Returns whether a viewer must be told of the model anew."""
    from sim_twin.posing import world_of_numbers
    from sim_twin.render import light_lamps

    now = list(numbers)
    if not now[-1]:
        return False  # nothing was measured yet
    outputs = world.digital_out
    is_moved = world_of_numbers(world, now[:-1])
    light_lamps(world)
    return is_moved or outputs != world.digital_out


def _is_over(pipe: Connection) -> bool:
    try:
        return pipe.poll(0.0) and pipe.recv() is None
    except (EOFError, OSError):
        return True
