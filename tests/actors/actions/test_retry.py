"""Retrying goals and calls (A-08): only what may pass, on the node's clock, and it says how often it tried."""

from __future__ import annotations

import pytest

from actors import (
    Aborted,
    ActionUnavailable,
    ActorError,
    Backoff,
    CallTimeout,
    Child,
    Done,
    GoalAborted,
    GoalRejected,
    Node,
    Reject,
    ServiceFailed,
    ServiceUnavailable,
    Steps,
    temporary,
)
from actors.errors import NodeRestarting, NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.runtime.retry import PASSING, retry
from actors.testing import Rig
from tests.stage import ADD, COUNT, events, order, result, step, total, two

EVEN = Backoff(1.0, 10.0, jitter=0.0)


class Shaky(Node):
    """Fails as often as the order of the goal says, then works."""

    async def on_start(self) -> None:
        self.tries: list[float] = []

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("cannot count backwards")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        self.tries.append(self.clock.now())
        yield step(len(self.tries))
        if len(self.tries) <= goal.order:
            raise OSError(f"motor {len(self.tries)} stalled")
        yield Done(result(len(self.tries)))

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.tries.append(self.clock.now())
        if request.b < 0:
            raise ValueError("negative")
        if len(self.tries) <= request.b:
            await self.clock.sleep(5.0)
        return total(request.a)


async def test_a_server_fails_twice_and_the_third_attempt_succeeds(rig: Rig) -> None:
    await rig.start(Shaky)
    failures: list[ActorError] = []
    seen: list[list[int]] = []

    done = await retry(
        rig.me,
        COUNT,
        order(2),
        attempts=3,
        backoff=EVEN,
        on_failure=failures.append,
        on_feedback=lambda feedback: seen.append(feedback.sequence.tolist()),
    )

    assert done == result(3)
    assert [type(error) for error in failures] == [GoalAborted, GoalAborted]
    assert "motor 1 stalled" in str(failures[0])
    assert rig.node(Shaky).tries == [0.0, 1.0, 3.0]
    assert seen == [[1], [2], [3]]
    told = events(rig.logs, "attempt")
    assert [record.event for record in told] == ["attempt 1 of 3 failed", "attempt 2 of 3 failed"]
    assert [record.fields["again_in"] for record in told] == [1.0, 2.0]


async def test_the_last_failure_is_raised_and_says_how_often_it_was_tried(rig: Rig) -> None:
    await rig.start(Shaky)
    with pytest.raises(GoalAborted, match="motor 2 stalled") as raised:
        await retry(rig.me, COUNT, order(5), attempts=2, backoff=EVEN)
    assert raised.value.__notes__ == ["tried 2 times in 1.000 s"]
    last = events(rig.logs, "attempt")[-1]
    assert last.event == "attempt 2 of 2 failed"
    assert last.fields["again_in"] is None


async def test_an_aborted_goal_with_a_result_is_tried_again(rig: Rig) -> None:
    class Halfway(Node):
        tries = 0

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            Halfway.tries += 1
            yield Done(result(1)) if Halfway.tries == 2 else Aborted(result(0), "blocked")

    await rig.start(Halfway)
    assert await retry(rig.me, COUNT, order(1)) == result(1)


async def test_a_rejection_is_the_servers_word_and_not_tried_again(rig: Rig) -> None:
    await rig.start(Shaky)
    with pytest.raises(GoalRejected, match="backwards") as raised:
        await retry(rig.me, COUNT, order(-1), attempts=5)
    assert not hasattr(raised.value, "__notes__")
    assert rig.now == 0.0
    assert events(rig.logs, "attempt") == []


async def test_a_call_that_times_out_is_tried_again_with_its_own_timeout(rig: Rig) -> None:
    await rig.start(Shaky)
    failures: list[ActorError] = []
    # the first attempt holds the server for five seconds, the second (from 2.5 s to 4 s) waits behind it, the third is served
    reply = await retry(rig.me, ADD, two(7, 1), attempts=9, backoff=EVEN, timeout=1.5, on_failure=failures.append)
    assert reply == total(7)
    assert {type(error) for error in failures} == {CallTimeout}
    assert len(failures) == 2
    assert rig.now == 6.0


async def test_a_failed_handler_is_not_tried_again_unless_asked_for(rig: Rig) -> None:
    await rig.start(Shaky)
    with pytest.raises(ServiceFailed, match="negative"):
        await retry(rig.me, ADD, two(1, -1), attempts=5)
    assert len(rig.node(Shaky).tries) == 1
    with pytest.raises(ServiceFailed) as raised:
        await retry(rig.me, ADD, two(1, -1), attempts=5, backoff=EVEN, on=(*PASSING, ServiceFailed))
    assert len(rig.node(Shaky).tries) == 6
    assert raised.value.__notes__ == ["tried 5 times in 15.000 s"]


async def test_a_restart_of_the_server_is_ridden_out(rig: Rig) -> None:
    await rig.start(Child(Shaky, backoff=Backoff(2.0, 2.0, jitter=0.0)))
    rig.crash(Shaky)
    await rig.quiet()
    failures: list[ActorError] = []
    assert await retry(rig.me, ADD, two(7, 0), backoff=EVEN, on_failure=failures.append) == total(7)
    assert [type(error) for error in failures] == [NodeRestarting, NodeRestarting]
    assert rig.now == 3.0


async def test_a_server_that_is_gone_for_good_is_not_waited_for(rig: Rig) -> None:
    await rig.start(Child(Shaky, restart=temporary))
    rig.node(Shaky).stop("done")
    await rig.quiet()
    with pytest.raises(NotRunning):
        await retry(rig.me, ADD, two(7, 0), attempts=5)
    assert rig.now == 0.0


async def test_a_server_that_comes_late_is_found(rig: Rig) -> None:
    await rig.start(Node)
    failures: list[ActorError] = []
    with pytest.raises(ServiceUnavailable):
        await retry(rig.me, ADD, two(1, 1), attempts=2, backoff=EVEN, timeout=0.5)
    with pytest.raises(ActionUnavailable):
        await retry(rig.me, COUNT, order(1), attempts=2, backoff=EVEN, timeout=0.5, on_failure=failures.append)
    assert len(failures) == 2
    assert rig.now == 4.0


async def test_the_waits_are_jittered_by_the_nodes_own_random_numbers(rig: Rig) -> None:
    await rig.start(Shaky)
    expected = Backoff(1.0, 10.0).delay(0, rig.system.runtime.random("/rig#1"))
    await retry(rig.me, COUNT, order(1), backoff=Backoff(1.0, 10.0))
    assert rig.now == pytest.approx(expected)
    assert 1.0 < rig.now <= 1.2


@pytest.mark.parametrize("attempts", [0, -1])
async def test_less_than_one_attempt_is_refused(rig: Rig, attempts: int) -> None:
    await rig.start(Shaky)
    with pytest.raises(ValueError, match="at least one"):
        await retry(rig.me, ADD, two(1, 1), attempts=attempts)


async def test_one_attempt_is_a_plain_call(rig: Rig) -> None:
    await rig.start(Shaky)
    with pytest.raises(CallTimeout) as raised:
        await retry(rig.me, ADD, two(1, 1), attempts=1)
    assert raised.value.__notes__ == ["tried once in 1.000 s"]
