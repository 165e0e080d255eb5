"""One robot behind all ports, on free port numbers."""

import pytest

from sim_twin.controller.wire import Wires
from tests.support.wire_doubles import E_SERIES, HOST, Client, Robot


class Bench:
    """The servers, the robot behind them, and clients on demand."""

    def __init__(self, version):
        self.robot = Robot(version)
        self.heard = []
        self.wires = Wires(
            outputs=self.robot.outputs,
            inputs=self.robot,
            dashboard=self.robot,
            states=self.robot,
            scripts=self.robot,
            gripper=self.robot,
            version=version,
            stamp_us=lambda: 42,
            hear=self.heard.append,
        )
        self.wires.open(HOST, is_free=True)
        self.clients = []

    def port(self, number):
        return self.wires.port_by_number[number]

    def client(self, number, **options):
        client = Client(self.port(number).number, self.wires.poll, **options)
        self.clients.append(client)
        return client

    def rtde(self, protocol=2):
        client = self.client(30004)
        assert client.rtde("V", protocol.to_bytes(2, "big")) == b"\x01"
        return client

    def dashboard(self):
        client = self.client(29999)
        assert client.line() == "Connected: Universal Robots Dashboard Server"
        return client

    def close(self):
        for client in self.clients:
            client.socket.close()
        self.wires.close()


@pytest.fixture
def make_bench():
    benches = []

    def make(version=E_SERIES):
        benches.append(Bench(version))
        return benches[-1]

    yield make
    for bench in benches:
        bench.close()


@pytest.fixture
def bench(make_bench):
    return make_bench()
