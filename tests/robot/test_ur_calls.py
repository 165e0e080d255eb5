"""What the client library throws is told with who did not answer, where, and what to try."""

import pytest

from robot.errors import WireError
from robot.hal.ur_calls import TRY_ELSE, named


@pytest.mark.parametrize(
    ("said", "hint"),
    [
        ("ur_rtde: Failed to start control script, before timeout of 5 seconds", "is it in remote control"),
        ("resolve: Host not found (authoritative) [asio.netdb:1]", "numbers always are"),
        ("connect: Connection refused [system:111]", "Services"),
        ("Operation canceled", TRY_ELSE),
        ("", TRY_ELSE),
    ],
)
def test_every_error_of_the_client_says_who_where_what_and_what_to_try(said, hint):
    with pytest.raises(WireError) as error, named("RTDE control", "10.0.0.7"):
        raise RuntimeError(said)
    assert str(error.value).startswith(f"RTDE control: expected an answer at 10.0.0.7, got: {said}")
    assert hint in str(error.value)


def test_what_is_no_error_of_the_clients_passes_through():
    with pytest.raises(ValueError, match="mine"), named("RTDE", "10.0.0.7"):
        raise ValueError("mine")
