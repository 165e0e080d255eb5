"""Critical sections: each schedule is worked out by hand, (slice, what was noted in it)."""

from tests.support.scripts import schedule


def test_a_critical_section_holds_the_others_off_over_slices():
    body = """
    thread t():
        enter_critical
        note("in")
        sync()
        sync()
        note("out")
        exit_critical
        sync()
        note("t")
    end
    run t()
    sync()
    note("m1")
    sync()
    note("m2")
    """
    # The main thread is held off in slices 2 and 3, and has its turn in 3 after the section opened.
    assert schedule(body) == [(1, "in"), (3, "out"), (3, "m1"), (4, "m2")]


def test_a_section_entered_again_and_again_lets_the_held_off_pass_between():
    body = """
    thread greedy():
        while True:
            enter_critical
            note("g")
            sync()
            exit_critical
        end
    end
    run greedy()
    sync()
    note("m1")
    sync()
    note("m2")
    """
    assert schedule(body) == [(1, "g"), (2, "m1"), (2, "g"), (3, "m2")]


def test_whoever_stands_first_in_line_does_not_starve_the_later_by_its_sections():
    body = """
    thread later():
        while True:
            enter_critical
            note("later")
            sync()
            exit_critical
        end
    end
    run later()
    i = 0
    while i < 3:
        enter_critical
        note("main")
        sync()
        exit_critical
        i = i + 1
    end
    """
    # Slice 2: main opens, wants in again and gives way; slice 3: the other opens, gives way and main has the section.
    assert schedule(body) == [(1, "main"), (2, "later"), (3, "main"), (4, "later"), (5, "main")]


def test_sections_nest():
    body = """
    thread t():
        enter_critical
        enter_critical
        sync()
        exit_critical
        note("still in")
        sync()
        exit_critical
        note("out")
    end
    run t()
    sync()
    note("m")
    """
    assert schedule(body) == [(2, "still in"), (3, "out"), (3, "m")]


def test_a_thread_that_ends_in_its_section_opens_it():
    body = """
    thread ends():
        enter_critical
        sync()
    end
    run ends()
    sync()
    note("after its end")
    global h = 0
    thread kills_itself():
        enter_critical
        sync()
        kill h
    end
    h = run kills_itself()
    sync()
    note("after the kill")
    """
    assert schedule(body) == [(2, "after its end"), (3, "after the kill")]


def test_exit_without_enter_is_let_pass():
    assert schedule("exit_critical\nnote(1)") == [(1, 1)]


def test_two_sections_never_overlap():
    section = """
    thread {0}():
        i = 0
        while i < 3:
            enter_critical
            note("{0} in")
            sync()
            note("{0} out")
            exit_critical
            i = i + 1
        end
    end
    """
    body = f"{section.format('a')}{section.format('b')}\nh = run a()\nk = run b()\njoin h\njoin k\nnote(0)"
    notes = [note for _, note in schedule(body)]
    assert len(notes) == 13
    for i in range(0, 12, 2):
        assert notes[i + 1] == notes[i].replace("in", "out")


def test_nobody_starves_while_two_threads_share_a_section():
    section = "while True:\n enter_critical\n note({})\n sync()\n exit_critical\n end"
    threads = [f"thread t{n}():\n {section.format(n)}\n end\n run t{n}()\n" for n in (1, 2)]
    body = f"{''.join(threads)}sleep(0.04)"
    notes = [note for _, note in schedule(body)]
    assert abs(notes.count(1) - notes.count(2)) <= 1


def test_who_was_held_off_comes_before_who_only_now_wants_to_enter():
    body = """
    thread a():
        enter_critical
        sync()
        exit_critical
        sync()
    end
    thread b():
        enter_critical
        note("b")
        exit_critical
    end
    run a()
    run b()
    sync()
    enter_critical
    note("main")
    exit_critical
    sync()
    """
    # In slice 2 main is held off until a opens the section; b comes to it next but lets main go first.
    assert schedule(body) == [(2, "main"), (2, "b")]


def test_a_join_inside_a_critical_section_lets_the_joined_thread_end():
    notes = schedule(
        """
        global go = True
        thread t():
            while go:
                enter_critical
                sync()
                exit_critical
            end
            note("ended")
        end
        handle = run t()
        sync()
        enter_critical
        go = False
        join handle
        note("joined")
        sync()
        exit_critical
        """
    )
    assert [what for _, what in notes] == ["ended", "joined"]


def test_a_holder_that_waited_goes_on_once_the_other_has_left_and_none_overlap():
    waits = """
    thread {0}():
        enter_critical
        join run short()
        note("{0} in")
        sync()
        note("{0} out")
        exit_critical
        while True:
            note("{0}")
            sync()
        end
    end
    run {0}()
    """
    body = f"thread short():\n sleep(0.02)\n end\n{waits.format('a')}{waits.format('b')}\nsleep(0.1)\nnote(0)"
    notes = [note for _, note in schedule(body, n_max=100)]
    assert notes[:2] == ["a in", "a out"]
    assert notes.index("b out") == notes.index("b in") + 1
    assert min(notes.count("a"), notes.count("b")) > 20
    assert notes[-1] == 0


def test_who_enters_while_the_holder_waits_holds_it_off_until_it_leaves():
    body = """
    thread short():
        sync()
    end
    thread a():
        enter_critical
        join run short()
        note("a")
        exit_critical
    end
    thread b():
        enter_critical
        note("b in")
        sleep(0.01)
        note("b out")
        exit_critical
    end
    run a()
    sync()
    run b()
    sync()
    note("main")
    sync()
    """
    # b entered while a waited; a's thread ends in slice 2, but a and main wait for b.
    assert schedule(body) == [(2, "b in"), (7, "b out"), (7, "main"), (7, "a")]
