"""The thread that makes programs of texts."""

from threading import Event

from sim_twin.controller.compiling import N_CHARS_WAITING, N_WAITING, Mistake, Start, ThreadCompiler


def test_long_programs_that_wait_are_bounded_by_their_characters():
    gate = Event()
    compiler = ThreadCompiler(lambda sockets: gate.wait() and {})
    text = "def f():\n#" + "x" * 250_000 + "\nend\n"
    n = N_CHARS_WAITING // len(text)
    for _ in range(n + 3):
        compiler.submit(text, Start())
    turned_away = [compiler.take()[0].message for _ in range(3)]
    assert all(f"{N_CHARS_WAITING} characters" in message for message in turned_away)
    assert compiler.take() is None
    assert not compiler.is_idle
    gate.set()
    compiler.close()
    assert [compiler.take()[0].name for _ in range(n)] == ["f"] * n
    assert compiler.is_idle


def test_a_flood_of_programs_is_turned_away_and_the_rest_compiled_in_order():
    gate = Event()

    def wait_for_the_gate(sockets):
        gate.wait()
        return {}

    compiler = ThreadCompiler(wait_for_the_gate)
    for k in range(N_WAITING + 20):
        compiler.submit(f"def p{k}():\n  x = 1\nend\n", Start())
    turned_away = []
    while (done := compiler.take()) is not None:
        turned_away.append(done[0])
    assert 19 <= len(turned_away) <= 20  # the first may be with the compiler already
    assert all(isinstance(done, Mistake) and "wait" in done.message for done in turned_away)
    gate.set()
    compiler.close()
    names = [compiler.take()[0].name for _ in range(N_WAITING)]
    assert names == [f"p{k}" for k in range(N_WAITING)]
