"""A learner and a virtual controller that show each other certificates: from `keys init` to motion."""

import pytest

from tests.support.small_lab import autotelic, controller_of, make_lab

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.69"
ENDPOINT = f"tls/{HOST}:7447"


def test_a_run_learns_over_a_guarded_bus_and_without_its_certificate_nothing_moves(tmp_path):
    make_lab(tmp_path, HOST, bus=ENDPOINT, keys="./keys")
    for arguments in (("init",), ("issue", "twin", "--host", HOST), ("issue", "viewer")):
        assert autotelic(tmp_path, "keys", *arguments)[0] == 0
    learn = ("learn", "--rig", "rig.yaml", "--scenario", "small.yaml", "--preset", "fast.yaml", "--epochs", "1")
    code, _, said = autotelic(tmp_path, *learn, "--out", "without")
    assert (code, "keys issue ROLE --source learning" in said) == (2, True), said
    assert autotelic(tmp_path, "keys", "issue", "learning")[0] == 0
    with controller_of(tmp_path, HOST, bus=ENDPOINT, keys=str(tmp_path / "keys")) as controller:
        before = controller.fault("truth")["q_rad"]
        code, _, said = autotelic(tmp_path, *learn, "--out", "run", timeout_s=120)
        assert code == 0, said
        after = controller.fault("truth")["q_rad"]
        code, listed, said = autotelic(tmp_path, "bus", "list", "--rig", "rig.yaml")
    assert max(abs(a - b) for a, b in zip(after, before, strict=True)) > 1e-3
    assert (code, "twin/truth" in listed) == (0, True), said
    assert len((tmp_path / "run" / "goals.csv").read_text().splitlines()) == 2
