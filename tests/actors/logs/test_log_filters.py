"""What keeps a log line from being written, and what is put into it: options, values, levels."""

from __future__ import annotations

from typing import Any

import pytest

from actors import Child, Node, Topic, every
from actors.checks import create
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.logs import DEBUG, ERROR, INFO, WARN, LogRecord, NodeLog
from actors.logs.levels import Level, LevelTree
from actors.testing import Rig
from tests.stage import events

CLOCK = Topic(ClockMessage, "/clock")


class Stopped:
    """A clock that shows what it is told."""

    seconds = 0.0

    def now(self) -> float:
        return self.seconds

    def now_ns(self) -> int:
        return round(self.seconds * 1e9)


def log_of(written: list[LogRecord], clock: Stopped | None = None, level: int = INFO) -> NodeLog:
    shown: Any = clock or Stopped()
    return create(NodeLog, "/gait", 1, shown, written.append, LevelTree(Level(level)))


def test_once_skip_first_and_throttle_work_on_every_method() -> None:
    for name in ("debug", "info", "warning", "warn", "error", "fatal", "exception"):
        written: list[LogRecord] = []
        clock = Stopped()
        log = log_of(written, clock, level=DEBUG)
        for second in (0.0, 0.5, 1.0, 1.5, 2.0):
            clock.seconds = second
            getattr(log, name)("once", once=True)
            getattr(log, name)("not the first", skip_first=True)
            getattr(log, name)("slowly", throttle_duration_sec=1.0, leg=3)
        assert [(line.time, line.event) for line in written if line.event != "not the first"] == [
            (0.0, "once"), (0.0, "slowly"), (1.0, "slowly"), (2.0, "slowly"),
        ]  # fmt: skip
        assert [line.time for line in written if line.event == "not the first"] == [0.5, 1.0, 1.5, 2.0]
        assert {tuple(line.fields) for line in written} == {(), ("leg",)}, "the options are no fields"


def test_each_place_in_the_source_counts_for_itself() -> None:
    written: list[LogRecord] = []
    log = log_of(written)
    for _ in range(3):
        log.info("here", once=True)
        log.info("there", once=True)
    assert [line.event for line in written] == ["here", "there"]


def test_a_line_below_the_level_uses_nothing_up() -> None:
    written: list[LogRecord] = []
    log = log_of(written, level=WARN)
    for _ in range(2):
        log.info("quiet", once=True)
        log.level = INFO
    assert [line.event for line in written] == ["quiet"]


def test_a_place_whose_options_change_is_refused_with_its_line() -> None:
    log = log_of([])
    with pytest.raises(ValueError, match=rf"the log call at {__file__}:\d+ in test_a_place.* changed its throttle_ns"):
        for seconds in (1.0, 2.0):
            log.info("odd", throttle_duration_sec=seconds)


def test_a_throttle_may_follow_another_clock_and_is_not_stuck_when_that_goes_back() -> None:
    written: list[LogRecord] = []
    other = Stopped()
    log = log_of(written)
    for second in (100.0, 100.5, 3.0, 3.5):
        other.seconds = second
        log.info("slowly", throttle_duration_sec=1.0, throttle_time_source_type=other, at=second)
    assert [line.fields for line in written] == [{"at": 100.0}, {"at": 3.0}]


async def test_the_options_count_per_node_and_life_on_the_nodes_clock(rig: Rig) -> None:
    class Chatter(Node):
        @every(hz=10)
        def tick(self) -> None:
            self.log.info("once", once=True)
            self.log.info("slowly", throttle_duration_sec=1.0)

    await rig.start(Child(Chatter, name="a"), Child(Chatter, name="b"))
    await rig.advance(2.05)
    told = [(line.node, line.event, round(line.time, 3)) for line in rig.logs if line.node in ("/a", "/b")]
    assert [line for line in told if line[0] == "/a"] == [
        ("/a", "once", 0.1), ("/a", "slowly", 0.1), ("/a", "slowly", 1.1),
    ]  # fmt: skip
    assert len(told) == 6
    rig.crash("a")
    await rig.advance(0.5)
    assert [line.incarnation for line in events(rig.logs, "once") if line.node == "/a"] == [1, 2]


async def test_a_throttle_counts_simulated_seconds(rig: Rig) -> None:
    class Simulated(Node):
        @every(hz=10)
        def tick(self) -> None:
            self.log.info("slowly", throttle_duration_sec=1.0)

    await rig.start(Child(Simulated, parameters={"use_sim_time": True}))
    for tenth in range(31):
        rig.publish(CLOCK, ClockMessage(clock=rig.system.clock.stamp(tenth / 10)))
        await rig.advance(0.001)
    assert len(events(rig.logs, "slowly")) == 3


def test_values_are_put_into_the_event_as_in_logging() -> None:
    written: list[LogRecord] = []
    log = log_of(written)
    log.info("%s legs of %d", "three", 4)
    log.info("%(leg)s is lame", {"leg": "left"})
    log.info("100 %")
    log.info("fits %d", "not", side="left")
    assert [line.event for line in written] == ["three legs of 4", "left is lame", "100 %", "fits %d"]
    assert written[-1].fields == {"side": "left", "args": ("not",)}


def test_exception_logs_the_error_at_hand_with_its_traceback() -> None:
    written: list[LogRecord] = []
    log = log_of(written)
    try:
        raise OSError("encoder lost")
    except OSError:
        log.exception("arm lost", joint=3)
    log.exception("nothing at hand")
    first, second = written
    assert (first.level, first.event) == (ERROR, "arm lost")
    place = first.fields.pop("at")
    assert place.startswith(f"{__file__}:") and place.endswith(
        "test_exception_logs_the_error_at_hand_with_its_traceback"
    )
    assert first.fields == {"error": "OSError: encoder lost", "joint": 3}
    assert first.traceback.splitlines()[0] == "Traceback (most recent call last):"
    assert first.traceback.splitlines()[-2:] == ['    raise OSError("encoder lost")', "OSError: encoder lost"]
    assert (second.level, second.fields, second.traceback) == (ERROR, {}, "")


async def test_the_level_of_one_node_is_set_while_it_runs_and_stays_over_its_lives(rig: Rig) -> None:
    class Shy(Node):
        @every(hz=1)
        def tick(self) -> None:
            self.log.debug("psst")

    await rig.start(Child(Shy, name="a"), Child(Shy, name="b"))
    rig.state("a").running.log.set_level("error")  # type: ignore[union-attr]
    rig.crash("a")
    await rig.advance(1.5)
    assert {line.node for line in events(rig.logs, "psst")} == {"/b"}
    log = rig.state("a").running.log  # type: ignore[union-attr]
    assert (rig.incarnation("a"), log.level) == (2, ERROR)
    log.level = DEBUG
    await rig.advance(1.0)
    assert {line.node for line in events(rig.logs, "psst")} == {"/a", "/b"}
    with pytest.raises(ValueError, match="'loud' is not a log level"):
        log.set_level("loud")
