"""Logging levels and the filters of a log call, as a user meets them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.logs.levels import CallSites, Level, LevelTree


class StoppedClock:
    """Shows the time it is told."""

    def __init__(self, seconds: float = 0.0) -> None:
        self.seconds = seconds

    def now_ns(self) -> int:
        return round(self.seconds * 1e9)


def heard(options: dict[str, object], seconds: list[float]) -> list[bool]:
    sites, clock = CallSites(), StoppedClock()
    answers: list[bool] = []
    for clock.seconds in seconds:
        answers.append(sites.allow("here", "robot", Level.INFO, options, clock))
    return answers


def test_a_logger_inherits_from_its_nearest_ancestor() -> None:
    tree = LevelTree()
    tree.set("robot", Level.WARN)
    tree.set("robot.arm", Level.DEBUG)

    assert tree.effective("robot.arm.joint") is Level.DEBUG
    assert tree.effective("robot.leg") is Level.WARN
    assert tree.effective("robots") is Level.INFO
    assert tree.enabled("robot.arm", Level.DEBUG)
    assert not tree.enabled("robot.leg", Level.INFO)


def test_unset_gives_a_logger_back_to_its_ancestor() -> None:
    tree = LevelTree()
    tree.set("robot", Level.ERROR)
    tree.set("robot.arm", Level.DEBUG)
    assert tree.effective("robot.arm") is Level.DEBUG

    tree.set("robot.arm", Level.UNSET)

    assert tree.get("robot.arm") is Level.UNSET
    assert tree.effective("robot.arm") is Level.ERROR


def test_the_empty_name_is_the_default() -> None:
    tree = LevelTree()
    tree.set("", Level.FATAL)
    assert tree.effective("anything") is tree.get("") is Level.FATAL

    tree.set("", Level.UNSET)
    assert tree.effective("anything") is Level.INFO


@pytest.mark.parametrize("number", [-1, 21, 60])
def test_only_the_six_levels_are_accepted(number: int) -> None:
    with pytest.raises(ValueError, match=f"{number} is not a log level"):
        LevelTree().set("robot", number)


def test_a_level_is_read_in_any_case_and_only_whole() -> None:
    assert Level.parse("Warn") is Level.WARN
    with pytest.raises(ValueError, match="use one of UNSET, DEBUG, INFO, WARN, ERROR, FATAL"):
        Level.parse("WARNING")


def test_the_repr_shows_the_levels_that_are_set() -> None:
    tree = LevelTree()
    tree.set("robot", Level.DEBUG)

    assert repr(tree) == "LevelTree(default=INFO, robot=DEBUG)"


def test_once_means_once() -> None:
    assert heard({"once": True}, [0, 1, 2]) == [True, False, False]


def test_skip_first_leaves_out_the_first() -> None:
    assert heard({"skip_first": True}, [0, 1, 2]) == [False, True, True]


def test_a_throttled_call_is_heard_at_once_and_again_when_the_time_is_up() -> None:
    assert heard({"throttle_duration_sec": 1.0}, [0.0, 0.4, 0.999999999, 1.0, 1.5]) == [True, False, False, True, False]


def test_skip_first_and_once_hear_exactly_the_second() -> None:
    assert heard({"skip_first": True, "once": True}, [0, 1, 2, 3]) == [False, True, False, False]


def test_false_and_zero_mean_the_same_as_nothing() -> None:
    assert heard({"once": False, "skip_first": False, "throttle_duration_sec": 0}, [0, 0]) == [True, True]


def test_a_throttle_may_follow_another_clock() -> None:
    sites, system, simulated = CallSites(), StoppedClock(), StoppedClock()
    options = {"throttle_duration_sec": 1.0, "throttle_time_source_type": simulated}
    answers: list[bool] = []
    for simulated.seconds in (0.0, 0.5, 1.0):
        answers.append(sites.allow("here", "robot", Level.INFO, options, system))

    assert answers == [True, False, True]


def test_two_places_do_not_share_their_state() -> None:
    sites, clock = CallSites(), StoppedClock()

    assert sites.allow("here", "robot", Level.INFO, {"once": True}, clock)
    assert sites.allow("there", "robot", Level.INFO, {"once": True}, clock)
    assert not sites.allow("here", "robot", Level.INFO, {"once": True}, clock)


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"twice": True}, "unknown log option twice; there are once, skip_first"),
        ({"throttle_time_source_type": StoppedClock()}, "needs throttle_duration_sec"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, object], why: str) -> None:
    with pytest.raises(TypeError, match=why):
        heard(options, [0])


def test_a_negative_throttle_is_refused() -> None:
    with pytest.raises(ValueError, match="must be positive"):
        heard({"throttle_duration_sec": -1.0}, [0])


@pytest.mark.parametrize(
    ("logger", "level", "options", "why"),
    [
        ("arm", Level.INFO, {"once": True}, "its logger from 'robot' to 'arm'"),
        ("robot", Level.WARN, {"once": True}, "its level"),
        ("robot", Level.INFO, {"skip_first": True}, "its once from True to False, skip_first"),
    ],
)
def test_a_filtered_call_must_stay_the_same(logger: str, level: Level, options: dict[str, object], why: str) -> None:
    sites, clock = CallSites(), StoppedClock()
    sites.allow("here", "robot", Level.INFO, {"once": True}, clock)

    with pytest.raises(ValueError, match=why):
        sites.allow("here", logger, level, options, clock)


paths = st.lists(st.sampled_from(["a", "b", ""]), min_size=1, max_size=4).map(".".join)


@given(st.lists(st.tuples(paths, st.sampled_from(Level)), max_size=12), paths)
def test_the_effective_level_is_that_of_the_nearest_prefix(changes: list[tuple[str, Level]], query: str) -> None:
    tree = LevelTree()
    own: dict[str, Level] = {}
    for logger, level in changes:
        tree.set(logger, level)
        tree.effective(query)  # fills what must be forgotten
        own[logger] = level

    words = query.split(".")
    prefixes = [".".join(words[:count]) for count in range(len(words), 0, -1)]
    found = [own[prefix] for prefix in prefixes if prefix and own.get(prefix)]
    assert tree.effective(query) == (found or [own.get("") or Level.INFO])[0]
