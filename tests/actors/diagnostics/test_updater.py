"""The diagnostics of one node: its tasks, their period, and the two usual tasks."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from actors import Child, Node
from actors.diagnostics import DIAGNOSTICS, FrequencyStatus, Status, TimeStampStatus, Updater
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from actors.testing import Rig

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Motor(Node):
    """Has a temperature, and a task that can break."""

    automatically_declare_parameters_from_overrides = True

    async def on_start(self) -> None:
        self.celsius: float | None = 20.5
        self.updater = Updater(self, hardware_id="motor-7")
        self.updater.add("temperature", self.temperature)

    def temperature(self, status: Status) -> None:
        if self.celsius is None:
            raise OSError("no sensor")
        status.ok("cool") if self.celsius < 60 else status.warn("hot")
        status.add("celsius", self.celsius)
        status.add("poles", 7)


def flat(messages: Iterable[DiagnosticArray]) -> list[tuple[int, str, str]]:
    return [(one.level, one.name, one.message) for message in messages for one in message.status]


async def test_it_publishes_what_its_tasks_say_once_a_second(rig: Rig) -> None:
    await rig.start(Node)
    seen = rig.probe(DIAGNOSTICS)
    await rig.system.join(Child(Motor))
    assert flat(seen) == [(OK, "motor: temperature", "Node starting up")]
    motor = rig.node(Motor)
    await rig.advance(1.0)
    motor.celsius = 70.0
    await rig.advance(1.0)
    assert flat(seen)[1:] == [(OK, "motor: temperature", "cool"), (WARN, "motor: temperature", "hot")]
    (status,) = seen.newest.status
    assert status.hardware_id == "motor-7" and [(one.key, one.value) for one in status.values] == [
        ("celsius", "70.000000"),
        ("poles", "7"),
    ]
    assert seen.newest.header.stamp == Time(sec=2) and seen.times == [0.0, 1.0, 2.0]


async def test_a_task_that_raises_is_an_error_and_does_not_end_the_node(rig: Rig) -> None:
    await rig.start(Motor)
    seen = rig.probe(DIAGNOSTICS)
    rig.node(Motor).celsius = None
    await rig.advance(1.0)
    assert flat(seen) == [(ERROR, "motor: temperature", "the task raised OSError: no sensor")]
    assert rig.incarnation(Motor) == 1
    assert not rig.node(Motor).set_parameter("diagnostic_updater.period", 2.0).successful  # it is read-only


async def test_tasks_are_added_removed_and_broadcast(rig: Rig) -> None:
    await rig.start(Motor)
    seen, updater = rig.probe(DIAGNOSTICS), rig.node(Motor).updater
    updater.add("silent", lambda status: None)
    updater.broadcast(WARN, "going down")
    updater.force_update()
    assert flat(seen) == [
        (OK, "motor: silent", "Node starting up"),
        (WARN, "motor: temperature", "going down"), (WARN, "motor: silent", "going down"),
        (OK, "motor: temperature", "cool"), (ERROR, "motor: silent", "No message was set"),
    ]  # fmt: skip
    assert repr(updater) == "<diagnostics of /motor: temperature, silent>"
    with pytest.raises(LookupError, match="has no task 'silemt'; did you mean 'silent'"):
        updater.remove("silemt")
    updater.remove("silent")
    updater.remove("temperature")
    before = len(seen)
    await rig.advance(3.0)
    assert len(seen) == before and repr(updater).endswith("no tasks>")


async def test_the_period_and_the_name_come_from_parameters(rig: Rig) -> None:
    given = {"diagnostic_updater.period": 0.25, "diagnostic_updater.use_fqn": True}
    await rig.start(Child(Motor, namespace="/spot", parameters=given))
    seen, updater = rig.probe(DIAGNOSTICS), rig.node(Motor).updater
    await rig.advance(1.0)
    assert seen.times == [0.25, 0.5, 0.75, 1.0] and seen.newest.status[0].name == "/spot/motor: temperature"
    assert updater.period == 0.25
    updater.period = 2.0
    await rig.advance(2.0)
    assert seen.times[4:] == [3.0]


@pytest.mark.parametrize(
    ("first", "second", "merged"),
    [
        ((OK, "fine"), (OK, "well"), (OK, "fine")),
        ((OK, "fine"), (WARN, "hot"), (WARN, "hot")),
        ((WARN, "hot"), (OK, "fine"), (WARN, "hot")),
        ((WARN, "hot"), (ERROR, "burnt"), (ERROR, "hot; burnt")),
        ((ERROR, ""), (WARN, "hot"), (ERROR, "hot")),
    ],
)
def test_two_summaries_are_merged(first: tuple[int, str], second: tuple[int, str], merged: tuple[int, str]) -> None:
    status = Status("x")
    status.summary(*first)
    status.merge_summary(*second)
    assert (status.level, status.message) == merged
    assert repr(Status("x")) == "<x: Error, No message was set>"


# -- how often ------------------------------------------------------------------------------------------------------------------


class Scanner(Node):
    """Ticks as often as the test says."""

    async def on_start(self) -> None:
        self.exact = FrequencyStatus(self.clock, 10.0, window=3)
        self.between = FrequencyStatus(self.clock, 5.0, 20.0, tolerance=0.0)

    def tick(self) -> None:
        self.exact.tick()
        self.between.tick()

    def said(self, task: FrequencyStatus) -> tuple[int, str, dict[str, str]]:
        status = Status("scans")
        task(status)
        return status.level, status.message, dict(status.values)


@pytest.mark.parametrize(
    ("hz", "exact", "between"),
    [
        (0.0, (ERROR, "No events recorded."), (ERROR, "No events recorded.")),
        (4.0, (WARN, "Frequency too low."), (WARN, "Frequency too low.")),
        (9.5, (OK, "Desired frequency met"), (OK, "Desired frequency met")),
        (20.0, (WARN, "Frequency too high."), (OK, "Desired frequency met")),
        (25.0, (WARN, "Frequency too high."), (WARN, "Frequency too high.")),
    ],
)
async def test_a_frequency_is_met_too_low_or_too_high(
    rig: Rig, hz: float, exact: tuple[int, str], between: tuple[int, str]
) -> None:
    await rig.start(Scanner)
    node = rig.node(Scanner)
    if hz:
        node.create_timer(1 / hz, node.tick)
    await rig.advance(4.0)
    assert node.said(node.exact)[:2] == exact and node.said(node.between)[:2] == between


async def test_a_frequency_is_measured_over_the_last_updates(rig: Rig) -> None:
    await rig.start(Scanner)
    node = rig.node(Scanner)
    assert node.said(node.exact)[2]["Actual frequency (Hz)"] == "0.000000"  # no time has passed
    timer = node.create_timer(0.1, node.exact.tick)
    for _ in range(4):
        await rig.advance(1.0)
        level, _, values = node.said(node.exact)
    assert level == OK and values["Events in window"] == "30" and values["Events since startup"] == "40"
    assert values["Duration of window (s)"] == "3.000000" and values["Target frequency (Hz)"] == "10.000000"
    assert (values["Minimum acceptable frequency (Hz)"], values["Maximum acceptable frequency (Hz)"]) == (
        "9.000000",
        "11.000000",
    )
    timer.cancel()
    for _ in range(3):
        await rig.advance(1.0)
        level, message, values = node.said(node.exact)
    assert (level, message, values["Events in window"]) == (ERROR, "No events recorded.", "0")
    assert "Target frequency (Hz)" not in node.said(node.between)[2]


# -- how old --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ages", "level", "message"),
    [
        ([], WARN, "No data since last update."),
        ([0.5, 4.0], OK, "Timestamps are reasonable."),
        ([0.5, 5.5], ERROR, "Timestamps too far in past seen."),
        ([-2.0, 0.5], ERROR, "Timestamps too far in future seen."),
        ([100.0], ERROR, "Zero timestamp seen."),
        ([0.5, 100.0], ERROR, "Zero timestamp seen."),
    ],
)
async def test_stamps_are_reasonable_or_too_far_away(rig: Rig, ages: list[float], level: int, message: str) -> None:
    await rig.start(Node)
    await rig.advance(100.0)
    task = TimeStampStatus(rig.me.clock)
    for age in ages:
        seconds = 100.0 - age
        task.tick(Time(sec=int(seconds), nanosec=round(seconds % 1 * 1e9)))
    first, second = Status("age"), Status("age")
    task(first)
    assert (first.level, first.message) == (level, message)
    values = dict(first.values)
    real = [age for age in ages if age != 100.0]
    if real:
        assert (
            values["Earliest timestamp delay"] == f"{min(real):f}"
            and values["Latest timestamp delay"] == f"{max(real):f}"
        )
    assert values["Late diagnostic update count"] == str(int(any(5.0 < age < 100.0 for age in ages)))
    assert values["Early diagnostic update count"] == str(int(any(age < -1.0 for age in ages)))
    assert values["Zero seen diagnostic update count"] == str(int(100.0 in ages))
    task(second)
    assert second.message == "No data since last update."
