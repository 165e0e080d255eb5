"""Every call of the genuine control client: each comes back as on a robot, and its program runs on.

What fails is the client's own, as its source has it: after `servoC` its script waits for a word that the client never
says, so that the next call is refused; `directTorque` before 5.26 is a loop that takes no time, which ends the program.
"""

import time

import pytest

from tests.support.genuine_client import HOME, make_station, until
from tests.support.loopback import own_address

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

VERSIONS = ("3.15.8", "5.9.4", "5.11.0", "5.22.0", "5.23.0", "5.26.0")
SIX, DOWN, TCP = [0.0] * 6, [0.0, 0.0, -0.05, 0.0, 0.0, 0.0], [0.0, 0.0, 0.1628, 0.0, 0.0, 0.0]
SERVO, TURN, ALONG_Z = (0.0, 0.0, 0.002, 0.1, 300.0), [0.05, 0.0, 0.0, 0.0, 0.0, 0.0], [0, 0, 1, 0, 0, 0]
SINCE_5_23 = {
    "getCoriolisAndCentrifugalTorques": (), "getJacobian": (), "getJacobianTimeDerivative": (), "getMassMatrix": (),
    "getTargetJointAccelerations": (),
}  # fmt: skip
ELSEWHERE = {
    "directTorque", "disconnect", "initPeriod", "isConnected", "isProgramRunning", "kickWatchdog", "reconnect",
    "reuploadScript", "sendCustomScript", "sendCustomScriptFile", "sendCustomScriptFunction", "servoC",
    "setCustomScriptFile", "setExternalForceTorque", "setWatchdog", "stopScript", "triggerProtectiveStop", "waitPeriod",
}  # fmt: skip
"""What starts or ends the program, asks nothing of the script, or fails by itself: for other tests, or below."""


def steps(q, pose, up):
    """Return calls in their order: a name, arguments, what comes back (None: whatever), and for how long it goes on."""
    path = [[*pose, 0.2, 0.5, 0.0]]
    from rtde_control import Path, PathEntry, RTDEControlInterface

    whole = Path()
    whole.addEntry(PathEntry(PathEntry.MoveJ, PathEntry.PositionJoints, [*q, 0.5, 0.5, 0.0]))
    whole.addEntry(PathEntry(PathEntry.MoveL, PathEntry.PositionTcpPose, path[0]))
    return [
        ("getStepTime", (), None, 0),
        ("getRobotStatus", (), 3, 0),
        ("isSteady", (), True, 0),
        ("moveJ", (q, 1.0, 1.0), True, 0),
        ("moveJ_IK", (pose, 1.0, 1.0), True, 0),
        ("moveL", (pose, 0.2, 0.5), True, 0),
        ("moveL_FK", (q, 0.2, 0.5), True, 0),
        ("moveL", (up, 0.05, 0.5, True), True, 0.2),
        ("getAsyncOperationProgress", (), 0, 0),
        ("getAsyncOperationProgressEx", (), None, 0),
        ("stopL", (2.0,), None, 0),
        ("moveL", (pose, 0.2, 0.5, True), True, 0.05),
        ("stopJ", (2.0,), None, 0),
        ("moveL", (pose, 0.2, 0.5), True, 0),
        ("speedJ", (TURN, 0.5, 0.2), True, 0.3),
        ("speedStop", (), True, 0),
        ("speedL", ([0.0, 0.0, 0.02, 0.0, 0.0, 0.0], 0.25, 0.2), True, 0.3),
        ("speedStop", (), True, 0),
        ("moveJ", (q, 1.0, 1.0), True, 0),
        ("servoJ", (q, *SERVO), True, 0.1),
        ("servoStop", (), True, 0),
        ("servoL", (pose, *SERVO), True, 0.1),
        ("servoStop", (), True, 0),
        ("forceMode", (SIX, ALONG_Z, [0.0, 0.0, -2.0, 0.0, 0.0, 0.0], 2, [0.1] * 6), True, 0.3),
        ("forceModeSetDamping", (0.1,), True, 0),
        ("forceModeSetGainScaling", (1.0,), True, 0),
        ("forceModeStop", (), True, 0),
        ("zeroFtSensor", (), True, 0),
        ("setPayload", (1.0, [0.0, 0.0, 0.05]), True, 0),
        ("setTargetPayload", (1.0, [0.0, 0.0, 0.05], SIX), True, 0),
        ("setTcp", (TCP,), True, 0),
        ("getTCPOffset", (), pytest.approx(TCP), 0),
        ("setGravity", ([0.0, 0.0, 9.82],), True, 0),
        ("getInverseKinematics", (pose, q), pytest.approx(q, abs=1e-4), 0),
        ("getInverseKinematicsHasSolution", (pose, q), True, 0),
        ("getForwardKinematics", (q, TCP), pytest.approx(pose, abs=1e-4), 0),
        ("poseTrans", (pose, SIX), pytest.approx(pose, abs=1e-4), 0),
        ("getActualToolFlangePose", (), None, 0),
        ("getJointTorques", (), None, 0),
        ("getTargetWaypoint", (), None, 0),
        ("getActualJointPositionsHistory", (3,), None, 0),
        ("isPoseWithinSafetyLimits", (pose,), True, 0),
        ("isJointsWithinSafetyLimits", (q,), True, 0),
        ("toolContact", (ALONG_Z,), None, 0),
        ("startContactDetection", (), True, 0),
        ("readContactDetection", (), None, 0),
        ("stopContactDetection", (), None, 0),
        ("freedriveMode", (), True, 0),
        ("getFreedriveStatus", (), None, 0),
        ("endFreedriveMode", (), True, 0),
        ("teachMode", (), True, 0),
        ("endTeachMode", (), True, 0),
        ("jogStart", ([0.0, 0.0, 10.0, 0.0, 0.0, 0.0], RTDEControlInterface.FEATURE_BASE, 0.5), True, 0.3),
        ("jogStop", (), True, 0),
        ("moveUntilContact", (DOWN,), True, 0),
        ("moveL", (pose, 0.2, 0.5), True, 0),
        ("ftRtdeInputEnable", (False,), True, 0),
        ("enableExternalFtSensor", (False,), True, 0),
        ("movePath", (whole,), True, 0),
        ("moveL", (path,), True, 0),
    ]


def runtime(station):
    return station.truth()["runtime"]


@pytest.fixture(scope="module", params=VERSIONS)
def station(request):
    with make_station(own_address(), request.param) as opened:
        opened.version = tuple(map(int, request.param.split(".")))
        yield opened


def test_every_call_comes_back_as_on_a_robot_and_the_program_runs_on(station):
    from rtde_control import RTDEControlInterface

    station.go(HOME)
    q, pose = station.q.tolist(), station.pose.tolist()
    up = [*pose[:2], pose[2] + 0.05, *pose[3:]]
    done = set()
    known = dict(SINCE_5_23) if station.version >= (5, 23) else {}
    for name, arguments, expected, lasts_s in [*steps(q, pose, up), *((n, a, None, 0) for n, a in known.items())]:
        came = getattr(station.control, name)(*arguments)
        time.sleep(lasts_s)
        done.add(name)
        assert expected is None or came == expected, (name, came)
        assert runtime(station) == "PLAYING", (name, station.process.fault("log", last=4)["lines"])
    callable_names = {n for n in dir(RTDEControlInterface) if n[0].islower()}
    assert callable_names - set(SINCE_5_23) - ELSEWHERE == done - set(SINCE_5_23)


def test_after_a_servoc_the_clients_next_call_waits_and_is_refused(station):
    station.recover()
    assert station.control.servoC(station.pose.tolist(), 0.2, 0.2, 0.0)
    time.sleep(0.2)  # or the client does not know yet that its script is not ready
    begun_s = time.monotonic()
    assert not station.control.servoStop()
    assert 3.0 < time.monotonic() - begun_s < 6.0
    assert station.control.reuploadScript()
    assert until(station.control.isProgramRunning)


def test_the_clients_torques_end_its_program_before_5_26_where_its_loop_takes_no_time(station):
    station.recover()
    assert station.control.directTorque(SIX)
    time.sleep(0.2)
    is_honest = station.version >= (5, 26)
    assert runtime(station) == ("PLAYING" if is_honest else "STOPPED")
    if not is_honest:
        assert "used too much time" in "".join(station.process.fault("log", last=4)["lines"])
