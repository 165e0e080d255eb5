from robot.clock import LockStepClock


def test_waiting_advances_the_world_once_and_time_by_one_period():
    calls = []
    clock = LockStepClock(tick_s=0.01, advance=lambda: calls.append(clock.now_ns()))
    assert clock.now_ns() == 0
    assert [clock.wait_tick() for _ in range(3)] == [0, 0, 0]
    assert clock.now_ns() == 30_000_000
    assert calls == [0, 10_000_000, 20_000_000]


def test_asking_the_time_passes_none():
    clock = LockStepClock(tick_s=0.002, advance=lambda: None)
    assert {clock.now_ns() for _ in range(5)} == {0}
