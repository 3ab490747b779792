"""Which processes and tokens are shown, in which order."""

from __future__ import annotations

import pytest

from actors.transport.keyed.protocol import Outlet
from actors.transport.zenoh.presence import Presence, Process, scope_of, session_of

A = Process("dom", "a1", 41, "lab")
B = Process("dom", "b2", 42, "lab")
OF_A = "@ros2_lv/7/a1/0/0/NN/%/%/talker"
MORE_OF_A = "@ros2_lv/7/a1/0/1/MP/%/%/talker"
OF_B = "@ros2_lv/7/b2/0/0/NN/%/%/listener"


class Log:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.lost: list[str] = []

    def appeared(self, token: str) -> None:
        self.lines.append(f"+ {token}")

    def vanished(self, token: str) -> None:
        self.lines.append(f"- {token}")

    def wanted(self, outlet: Outlet) -> None:
        raise AssertionError("presence knows no outlets")

    def link(self, session: str, up: bool) -> None:
        self.lines.append(f"{session} {'up' if up else 'down'}")

    def found(self, session: str) -> None:
        self.lines.append(f"{session} found")

    def take(self) -> list[str]:
        lines, self.lines = self.lines, []
        return lines


@pytest.fixture
def log() -> Log:
    return Log()


@pytest.fixture
def presence(log: Log) -> Presence:
    return Presence(log, log.found, log.lost.append)


def test_a_link_is_shown_before_the_first_token_of_its_process(presence: Presence, log: Log) -> None:
    presence.appear(OF_A)
    presence.arrive(A)
    presence.appear(MORE_OF_A)
    presence.appear(MORE_OF_A)

    assert log.take() == ["a1 found", "a1 up", f"+ {OF_A}", f"+ {MORE_OF_A}"]
    assert presence.shown == {"a1": A}
    assert presence.tokens("a1") == (OF_A, MORE_OF_A)
    assert presence.tokens("b2") == ()


def test_a_process_that_is_there_twice_is_one(presence: Presence, log: Log) -> None:
    presence.arrive(A)
    presence.arrive(A)
    presence.vanish(A.token)
    presence.settle()

    assert log.take() == ["a1 found", "a1 up", "a1 down"]
    assert presence.shown == {}


def test_a_process_that_ends_is_told_first_whatever_of_it_vanishes_first(presence: Presence, log: Log) -> None:
    for token in (OF_A, MORE_OF_A):
        presence.appear(token)
    presence.arrive(A)
    presence.appear("@ros2_lv/7/nobody")
    log.take()

    for token in ("@ros2_lv/7/nobody", MORE_OF_A, A.token, OF_A):
        presence.vanish(token)
    assert log.take() == []
    presence.settle()

    assert log.take() == ["a1 down", f"- {OF_A}", f"- {MORE_OF_A}", "- @ros2_lv/7/nobody"]
    assert presence.shown == {}


def test_a_process_of_ros_2_is_lost_with_its_last_token(presence: Presence, log: Log) -> None:
    presence.appear(OF_A)
    presence.appear(MORE_OF_A)
    log.take()

    presence.vanish(OF_A)
    presence.settle()
    assert log.take() == [f"- {OF_A}"]
    presence.vanish(MORE_OF_A)
    presence.settle()
    assert log.take() == ["a1 down", f"- {MORE_OF_A}"]


def test_a_process_of_ours_may_withdraw_all_its_tokens(presence: Presence, log: Log) -> None:
    presence.arrive(A)
    presence.appear(OF_A)
    log.take()

    presence.vanish(OF_A)
    presence.settle()

    assert log.take() == [f"- {OF_A}"]
    assert presence.shown == {"a1": A}


def test_what_vanishes_before_something_appears_is_told_before(presence: Presence, log: Log) -> None:
    presence.arrive(A)
    presence.appear(OF_A)
    log.take()

    presence.vanish(OF_A)
    presence.appear(OF_A)
    presence.vanish(A.token)
    presence.vanish(OF_A)
    presence.arrive(A)
    presence.settle()

    assert log.take() == [f"- {OF_A}", f"+ {OF_A}", "a1 down", f"- {OF_A}", "a1 found", "a1 up"]


def test_what_was_never_there_does_not_vanish(presence: Presence, log: Log) -> None:
    presence.appear(OF_B)
    log.take()

    for token in (OF_A, A.token, MORE_OF_A.replace("a1", "b2"), "@ros2_lv/7/nobody"):
        presence.vanish(token)
    presence.settle()

    assert log.take() == []
    assert presence.shown == {"b2": None}


def test_a_silent_process_is_lost_until_it_is_heard(presence: Presence, log: Log) -> None:
    presence.arrive(A)
    presence.appear(OF_A)
    log.take()

    presence.silence("a1")
    presence.silence("a1")
    assert log.take() == ["a1 down", f"- {OF_A}"]
    assert presence.shown == {}
    presence.appear(MORE_OF_A)
    presence.vanish(OF_A)
    presence.settle()
    assert log.take() == []
    presence.heard("a1")
    presence.heard("a1")

    assert log.take() == ["a1 found", "a1 up", f"+ {MORE_OF_A}"]


def test_a_silent_process_that_ends_is_not_told_again(presence: Presence, log: Log) -> None:
    presence.arrive(A)
    presence.silence("a1")
    log.take()

    presence.vanish(A.token)
    presence.settle()
    presence.heard("a1")
    presence.silence("a1")
    assert log.take() == []

    presence.arrive(A)
    assert log.take() == ["a1 found", "a1 up"]


@pytest.mark.parametrize("forged", ["@robactor/dom/a1/1/nobody", "@robactor/other/a1/41/lab"])
@pytest.mark.parametrize("ours", [True, False], ids=["of this library", "of ROS 2"])
def test_a_foreign_token_that_is_withdrawn_loses_no_process(
    presence: Presence, log: Log, forged: str, ours: bool
) -> None:
    if ours:
        presence.arrive(A)
    presence.appear(OF_A)
    log.take()
    other = Process.parse(forged)
    assert other is not None

    presence.arrive(other)
    presence.vanish(forged)
    presence.settle()

    assert log.take() == []
    assert presence.shown == {"a1": A if ours else None}
    presence.vanish(OF_A)
    presence.vanish(A.token)
    presence.settle()
    assert log.take() == ["a1 down", f"- {OF_A}"]


def test_only_processes_of_this_library_are_expected_to_be_heard(presence: Presence) -> None:
    ours = f"b0bac708{1:024x}"
    presence.appear(OF_A)
    presence.appear(OF_A.replace("/a1/", f"/{ours}/"))
    presence.arrive(A)  # which says that it is the process of a session of ROS 2
    presence.heard("a1")
    presence.heard("unknown")
    assert presence.beating == [ours]
    presence.silence(ours)
    assert presence.beating == []


def test_so_many_tokens_are_shown_and_no_more_and_room_is_given_back(
    presence: Presence, log: Log, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.zenoh.presence.MOST_TOKENS", 3)
    monkeypatch.setattr("actors.transport.zenoh.presence.MOST_ALTOGETHER", 5)
    of = {name: [f"@ros2_lv/7/{name}/0/{n}/NN/%/%/x" for n in range(4)] for name in ("a1", "b2")}
    presence.arrive(A)
    for token in (*of["a1"], *of["b2"]):
        presence.appear(token)
    assert (presence.tokens("a1"), presence.tokens("b2")) == (tuple(of["a1"][:3]), (of["b2"][0],))

    presence.appear("@ros2_lv/7/c3/0/0/NN/%/%/x")
    presence.arrive(Process("dom", "c3", 43, "lab"))
    assert (set(presence.shown), [line for line in log.take() if "c3" in line]) == ({"a1", "b2"}, [])

    presence.vanish(of["a1"][0])
    presence.vanish(of["a1"][3])
    presence.appear(of["b2"][1])
    presence.appear(of["b2"][2])
    assert (presence.tokens("a1"), presence.tokens("b2")) == (tuple(of["a1"][1:3]), tuple(of["b2"][:2]))
    for token in (A.token, *of["a1"], *of["b2"]):
        presence.vanish(token)
    presence.settle()
    assert presence.shown == {}
    for token in of["b2"]:
        presence.appear(token)
    assert presence.tokens("b2") == tuple(of["b2"][:3])


def test_a_process_says_where_it_runs() -> None:
    one = Process("dom", "a1", 4711, "lab 3/äst")

    assert one.token == "@robactor/dom/a1/4711/lab_3__st"
    assert Process.parse(one.token) == Process("dom", "a1", 4711, "lab_3__st")
    assert Process("dom", "a1", 1, "").token == "@robactor/dom/a1/1/_"


@pytest.mark.parametrize(
    "token", [OF_A, "@robactor/dom/a1/1", "@robactor/dom/0a1/1/h", "@robactor/dom/a1/x/h", "@other/dom/a1/1/h"]
)
def test_other_tokens_are_of_no_process(token: str) -> None:
    assert Process.parse(token) is None


def test_who_watches_the_same_tokens_has_the_same_scope() -> None:
    assert scope_of("@ros2_lv/7/**") == "_ros2_lv_7"
    assert scope_of("**") == "_"


def test_a_token_of_ros_2_names_its_session() -> None:
    assert session_of(OF_A) == "a1"
    assert session_of("@ros2_lv/7/a1") == ""
    assert session_of("@ros2_lv/7/one/two") == ""
