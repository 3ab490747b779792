"""What a user sees of an error: the traceback from their own line on, once for each kind in the console, always in JSON."""

from __future__ import annotations

import gc
import io
import json
import weakref
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any

import numpy as np
import pytest
import structlog

from actors import Child, Intensity, Node, Service, Supervisor, background, every, open_node, run, transient
from actors.errors import described
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs import msg as geometry
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.logs import LogRecord, console_sink, json_sink, log_message, structlog_sink
from actors.runtime.incarnation import incarnation_of
from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.policy import all_significant, any_significant, rest_for_one
from actors.supervision.reasons import Returned, Stop
from actors.supervision.refs import ChildRef
from actors.supervision.report import Report, log_line
from actors.testing import Rig
from tests.stage import ADD, events, total, two

FOR_EVER = Intensity(100, within=1.0)


class Shaky(Node):
    """Divides by a singular matrix every second."""

    @every(hz=1)
    def solve(self) -> None:
        np.linalg.inv(np.zeros((2, 2)))


class Adder(Node):
    """Cannot add."""

    broken = "a"

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(int(self.broken))


@pytest.fixture
def three_crashes(rig: Rig) -> Any:
    async def crash(*sinks: Any) -> None:
        await rig.start(Supervisor("system", children=[Child(Shaky)], intensity=FOR_EVER))
        for sink in sinks:
            rig.system.observe(lines=sink)
        with rig.expect_failure(np.linalg.LinAlgError):
            await rig.advance(3.0)

    return crash


async def test_the_console_shows_the_traceback_of_the_first_crash_and_counts_the_others(
    three_crashes: Any,
) -> None:
    out = io.StringIO()
    await three_crashes(console_sink(out))
    lines = [line for line in out.getvalue().splitlines() if "restarted" not in line]
    crashes = [line for line in lines if "child terminated" in line]
    assert len(crashes) == 3
    assert f"at='{__file__}:" in crashes[0] and "in Shaky.solve'" in crashes[0]
    assert "times=" not in crashes[0]
    assert [line.rpartition(" ")[2] for line in crashes[1:]] == ["times=2", "times=3"]
    below = lines[lines.index(crashes[0]) + 1 : lines.index(crashes[1])]
    assert below[0] == "Traceback (most recent call last):"
    assert below[1].startswith(f'  File "{__file__}", line ') and below[1].endswith(", in solve")
    assert below[-1] == "numpy.linalg.LinAlgError: Singular matrix"
    assert not any("incarnation.py" in line or "inbox.py" in line for line in lines)


async def test_json_has_every_traceback_in_one_field(three_crashes: Any) -> None:
    out = io.StringIO()
    await three_crashes(json_sink(out))
    lines = [json.loads(line) for line in out.getvalue().splitlines()]
    crashes = [line for line in lines if line["event"] == "child terminated"]
    assert [(line["life"], line.get("times")) for line in crashes] == [(1, None), (2, 2), (3, 3)]
    for line in crashes:
        assert line["exception"].startswith(f'Traceback (most recent call last):\n  File "{__file__}", line ')
        assert line["exception"].endswith("\nnumpy.linalg.LinAlgError: Singular matrix")
    assert all("exception" not in line for line in lines if line not in crashes)


async def test_structlog_gets_the_error_as_exc_info_the_first_time(three_crashes: Any) -> None:
    with structlog.testing.capture_logs() as captured:
        await three_crashes(structlog_sink)
    crashes = [line for line in captured if line["event"] == "child terminated"]
    kind, error, trace = crashes[0]["exc_info"]
    assert kind is type(error) is np.linalg.LinAlgError
    assert trace.tb_frame.f_code.co_qualname == "Shaky.solve"
    assert [("exc_info" in line, line.get("times")) for line in crashes] == [(True, None), (False, 2), (False, 3)]


async def test_a_failing_service_and_a_goal_show_theirs_and_an_error_is_told_once(rig: Rig) -> None:
    class Strict(Adder):
        def on_error(self, error: Exception, handler: str) -> Any:
            return "fail"

    await rig.start(Child(Adder), Child(Strict, namespace="strict"))
    for _ in range(2):
        with pytest.raises(Exception, match="invalid literal"):
            await rig.call(ADD, two(1, 2))
    first, second = events(rig.logs, "service handler failed")
    assert first.fields["at"] == second.fields["at"] and first.fields["at"].endswith("in Adder.add")
    assert (first.times, second.times) == (1, 2)
    assert first.traceback.splitlines()[-1] == "ValueError: invalid literal for int() with base 10: 'a'"
    with rig.expect_failure(ValueError, node="strict"):
        with pytest.raises(Exception, match="invalid literal"):
            await rig.call(Service(AddTwoInts, "/strict/add"), two(1, 2))
        await rig.advance(0.1)
    (ended,) = events(rig.logs, "child terminated")
    assert (ended.times, ended.traceback) == (1, ""), "the line before has it"


async def test_a_line_keeps_the_traceback_and_not_what_the_handler_held(rig: Rig) -> None:
    class Camera(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            raise OSError("no light")

    await rig.start(Child(Camera))
    errors: list[BaseException | None] = []
    rig.system.observe(lines=lambda record: errors.append(record.error))
    with pytest.raises(Exception, match="no light"):
        await rig.call(ADD, two(1, 2))
    (line,) = events(rig.logs, "service handler failed")
    assert isinstance(errors[0], OSError)
    assert line.error is None
    assert line.traceback.endswith("OSError: no light")
    message = log_message(line, 0)
    assert message.msg.startswith("service handler failed handler=") and message.msg.endswith("\nOSError: no light")


def test_a_record_that_has_let_go_of_its_error_keeps_nothing_alive() -> None:
    class Image:
        pass

    def fail() -> LogRecord:
        image = Image()
        held.append(weakref.ref(image))
        try:
            raise OSError("no light")
        except OSError as error:
            return LogRecord(0.0, 40, "/camera", 1, "dark", {}, error)

    held: list[weakref.ref[Image]] = []
    record = fail()
    gc.collect()
    assert held[0]() is not None
    record.let_go()
    gc.collect()
    assert held[0]() is None
    assert record.traceback.endswith('raise OSError("no light")\nOSError: no light')


async def test_what_fails_late_or_while_cleaning_up_shows_its_traceback(rig: Rig) -> None:
    class Untidy(Node):
        async def on_stop(self, reason: object) -> None:
            raise OSError("brake stuck")

        @background
        async def work(self) -> None:
            raise ValueError("first")

    with rig.expect_failure(ValueError):
        await rig.start(Child(Untidy, restart="temporary"))
        await rig.advance(1.0)
    (line,) = events(rig.logs, "clean-up failed")
    assert line.fields["after"] == "it raised ValueError: first"
    assert line.traceback.endswith("OSError: brake stuck")
    core = incarnation_of(rig.me)
    core.ended = True
    core.fail(OSError("too late"), "a task")
    core.ended = False
    (line,) = events(rig.logs, "failed after the end of its node")
    assert line.fields == {"handler": "a task", "error": "OSError: too late"}


# -- words ------------------------------------------------------------------------------------------------------------------


def said(rig: Rig, part: str = "") -> list[tuple[int, str, dict[str, Any]]]:
    return [(record.level, record.event, record.fields) for record in rig.logs if part in record.event]


async def test_a_restart_says_which_life_began_after_how_long(rig: Rig) -> None:
    class Slow(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(0.4)

    tree = Supervisor("base", strategy=rest_for_one, children=[Child(Slow, name="shaky"), Child(Node, name="other")])
    await rig.start(Supervisor("robot", children=[tree]))
    assert said(rig) == [
        (10, "started shaky", {"child": "robot/base/shaky"}),
        (10, "started other", {"child": "robot/base/other"}),
        (10, "started base", {"child": "robot/base"}),
    ]
    rig.crash("shaky", OSError("pulled out"))
    await rig.settled()
    assert said(rig)[3:] == [
        (40, "child terminated", {"child": "robot/base/shaky", "reason": "it raised OSError: pulled out"}),
        (20, "restarted shaky (life 2) after 0.4 s", {"child": "robot/base/shaky"}),
        (20, "restarted other (life 2) after 0.4 s", {"child": "robot/base/other"}),
    ]
    assert [record.incarnation for record in rig.logs][-2:] == [2, 2]


async def test_a_crash_is_an_error_in_the_log_and_an_end_in_order_a_warning(rig: Rig) -> None:
    await rig.start(Child(Node, name="a"))
    rig.crash("a", OSError("pulled out"))
    await rig.settled()
    rig.crash("a", Stop("enough"))
    await rig.settled()
    ends = events(rig.logs, "child terminated")
    assert [(line.level, line.fields["reason"]) for line in ends] == [
        (40, "it raised OSError: pulled out"),
        (30, "it stopped: enough"),
    ]


async def test_a_restart_without_delay_and_one_of_a_supervisor(rig: Rig) -> None:
    inner = Supervisor("inner", intensity=Intensity(0, within=5.0), children=[Child(Node, name="a")])
    await rig.start(Supervisor("outer", children=[inner, Child(Node, name="b")]))
    with rig.expect_failure(SupervisorGaveUp):
        rig.crash("b")
        rig.crash("a")
        await rig.settled()
    assert said(rig, "restarted") == [
        (20, "restarted b (life 2) at once", {"child": "outer/b"}),
        (20, "restarted inner (life 2)", {"child": "outer/inner"}),
    ]
    assert said(rig, "gives up") == [
        (40, "inner gives up: no restart is allowed", {"child": "outer/inner/a", "reason": "it raised RuntimeError: crashed by the rig"}),
    ]  # fmt: skip


class Errand(Node):
    @background
    async def run(self) -> None:
        self.stop("its errand is over")


@pytest.mark.parametrize("kind", [all_significant, any_significant])
async def test_the_end_of_a_tutorial_is_a_sentence(rig: Rig, kind: Any) -> None:
    children = [Child(Errand, name="client", restart=transient, significant=True)]
    await rig.start(Supervisor("fibonacci", auto_shutdown=kind, children=children))
    await rig.system.wait()
    assert said(rig, "stops") == [
        (20, "fibonacci stops, because client has ended: its errand is over", {"child": "fibonacci/client"})
    ]


async def test_the_end_of_a_child_that_failed_for_good_is_a_sentence_too(rig: Rig) -> None:
    child = Child(Node, name="client", restart="temporary", significant=True)
    await rig.start(Supervisor("lab", auto_shutdown=any_significant, children=[child]))
    rig.crash("client", OSError("lost"))
    await rig.system.wait()
    assert said(rig, "stops")[0][1] == "lab stops, because client has ended: it raised OSError: lost"


def test_a_report_with_a_note_and_a_child_that_returned() -> None:
    child = ChildRef(("lab", "client"), 3, 7)
    odd = Report(
        "unexpected", ("lab",), child, "permanent", 2.0, None, "it said once more that it has started; dropped"
    )
    assert log_line(odd, "", None) == (
        40, "unexpected", {"child": "lab/client", "note": "it said once more that it has started; dropped"}
    )  # fmt: skip
    done = Report("shutdown", ("lab",), child, "transient", 2.0, Returned(), "auto_shutdown=all_significant")
    assert log_line(done, str(done.reason), None)[1] == "lab stops, because client has ended: its work is done"


def test_a_record_with_a_traceback_reads_as_several_lines_and_one_without_as_one() -> None:
    try:
        raise OSError("no light")
    except OSError as error:
        record = LogRecord(1.5, 40, "/camera", 1, "dark", {"leg": 3}, error, times=2)
    lines = str(record).splitlines()
    assert lines[0] == repr(record) == "[     1.500] error /camera: dark leg=3 times=2"
    assert lines[1] == "             Traceback (most recent call last):"
    assert lines[-1] == "             OSError: no light"
    assert str(LogRecord(1.5, 40, "/camera", 1, "dark", {})) == "[     1.500] error /camera: dark"


async def test_what_the_framework_says_of_a_node_obeys_the_nodes_level(rig: Rig) -> None:
    await rig.start(Child(Adder))
    core = rig.state(Adder).running
    assert core is not None
    core.log.set_level("error")
    core.warn("something odd")
    core.log.set_level("warn")
    core.warn("something else")
    assert [line.event for line in events(rig.logs, "something")] == ["something else"]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Twist(linaer=Vector3()), "Unexpected keyword argument 'linaer' of Twist; did you mean 'linear'?"),  # type: ignore[call-arg]
        (lambda: geometry.Twist(foo=1), "Unexpected keyword argument 'foo' of Twist; it has linear, angular"),  # type: ignore[call-arg]
        (lambda: Vector3(1, 2, 3), "Extra positional arguments provided to Vector3: name its fields, as in Vector3(x=...)"),  # type: ignore[call-arg]
        (
            lambda: AddTwoInts.Request(
                a=1,
                c=2,  # type: ignore[call-arg]
            ),
            "Unexpected keyword argument 'c' of AddTwoInts_Request; it has a, b",
        ),
        (lambda: AddTwoInts(a=1), "AddTwoInts is a service type; build AddTwoInts.Request(...) or .Response(...)"),
        (lambda: Fibonacci(order=1), "Fibonacci is an action type; build Fibonacci.Goal(...), .Result(...) or .Feedback(...)"),
        (lambda: [Vector3][0](1.0), "Extra positional arguments provided"),  # type: ignore[call-arg]
    ],
)  # fmt: skip
def test_a_message_that_cannot_be_made_is_named_with_the_field_that_was_meant(
    make: Callable[[], object], says: str
) -> None:
    with pytest.raises(TypeError) as told:
        make()
    assert described(told.value) == f"TypeError: {says}"


@pytest.mark.parametrize("block", [lambda: open_node("script"), lambda: run(Child(Adder))], ids=["open_node", "run"])
async def test_an_error_that_leaves_a_block_says_which_field_of_which_message_was_meant(
    block: Callable[[], AbstractAsyncContextManager[object]],
) -> None:
    with pytest.raises(TypeError) as told:
        async with block():
            Twist(linaer=Vector3())  # type: ignore[call-arg]
    assert told.value.__notes__ == ["Unexpected keyword argument 'linaer' of Twist; did you mean 'linear'?"]
    with pytest.raises(TypeError) as plain:
        async with block():
            raise TypeError("mine")
    assert not hasattr(plain.value, "__notes__")


def test_an_error_of_code_without_a_source_is_described_as_it_is() -> None:
    with pytest.raises(TypeError) as told:
        exec("Vector3(1.0)", {"Vector3": Vector3})
    assert described(told.value) == "TypeError: Extra positional arguments provided"
    assert (
        described(TypeError("Extra positional arguments provided")) == "TypeError: Extra positional arguments provided"
    )
