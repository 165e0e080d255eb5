"""Endpoints: what is one, and which are this machine's alone."""

import pytest

from robot.bus.endpoint import Endpoint, read_endpoint, safe_endpoint
from robot.bus.errors import BusConfigError


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("tcp/127.0.0.1:1", {"host": "127.0.0.1", "port": 1}),
        ("tcp/127.255.0.9:65535", {"host": "127.255.0.9", "port": 65535}),
        ("tcp/localhost:7447", {"host": "localhost", "port": 7447}),
        ("tcp/[::1]:7447", {"host": "::1", "port": 7447}),
        ("unixsock-stream//run/bus.sock", {"path": "/run/bus.sock"}),
    ],
)
def test_loopback_is_taken_apart(text, parts):
    assert safe_endpoint(text, has_keys=False) == Endpoint(text=text, **parts)


@pytest.mark.parametrize(
    "text",
    ["tcp/192.168.1.20:7447", "tcp/0.0.0.0:7447", "tcp/[::]:7447", "tcp/[fe80::1]:7447", "tcp/128.0.0.1:7447",
     "tcp/126.255.255.255:7447", "tcp/cell.example:7447", "tcp/localhost.example:7447"],
)  # fmt: skip
def test_off_loopback_is_refused_in_one_line_that_says_why(text):
    assert read_endpoint(text).text == text
    with pytest.raises(BusConfigError, match=r"on loopback.*certificates") as refusal:
        safe_endpoint(text, has_keys=False)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "text",
    ["", "7447", "127.0.0.1:7447", "tcp/127.0.0.1", "tcp/127.0.0.1:0", "tcp/127.0.0.1:65536", "udp/127.0.0.1:7447",
     "tcp/127.0.0.1:7447?x=1", "tcp/127.0.0.1:7447#iface=eth0", "tcp/::1:7447",
     "unixsock-stream/run", "tcp/ 127.0.0.1:1", "tcp/127.0.0.1:1\n"],
)  # fmt: skip
def test_what_is_no_endpoint_is_refused(text):
    with pytest.raises(BusConfigError, match="expected an endpoint such as"):
        safe_endpoint(text, has_keys=False)


@pytest.mark.parametrize("text", ["tls/127.0.0.1:7447", "tls/192.168.1.5:7447", "tls/cell.example:7447"])
def test_with_certificates_others_may_reach_it_and_without_them_nobody_listens(text):
    endpoint = safe_endpoint(text, has_keys=True)
    assert (endpoint.is_tls, endpoint.port) == (True, 7447)
    with pytest.raises(BusConfigError, match="expected certificates"):
        safe_endpoint(text, has_keys=False)


@pytest.mark.parametrize("text", ["tcp/127.0.0.1:7447", "unixsock-stream//run/bus.sock", "tcp/192.168.1.5:7447"])
def test_certificates_that_would_not_be_asked_for_are_refused(text):
    with pytest.raises(BusConfigError, match="asks for the rig's certificates"):
        safe_endpoint(text, has_keys=True)
