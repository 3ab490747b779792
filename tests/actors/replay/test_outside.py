"""What others do to a recorded node reaches the replayed one: they call in vain, interrupt its tasks, publish for it, use its own threads."""

from __future__ import annotations

import asyncio

import pytest

from actors import (
    CallTimeout,
    Child,
    Node,
    Service,
    Topic,
    execute,
    run,
)
from actors.interfaces.rcl_interfaces.srv import GetParameters
from actors.interfaces.std_msgs.msg import String, UInt8MultiArray
from actors.interfaces.std_srvs.srv import Trigger
from actors.qos import LATCHED
from actors.replay import Journal, Recording, ReplayError, replay
from tests.actors.replay.nodes import (
    DONE,
    SHARED,
    Clockwatcher,
    Closed,
    Computing,
    Drawing,
    Hasty,
    Hearing,
    Interrupted,
    Patient,
    Rash,
    Reading,
    Stubborn,
    Worker,
)
from tests.actors.replay.story import ASK_MANY, HERO, OTHERS, TOLD, Visitor

PARAMETERS = Service(GetParameters, "/hero/get_parameters")


async def recorded(node: Child | type[Node], *others: Child | type[Node], seconds: float = 0.2) -> Recording:
    child = node if isinstance(node, Child) else Child(node)
    journal = Journal(child.name)
    async with run(*others, child, observers=(journal,), sinks=(), seed=5) as system:
        await system.clock.sleep(seconds)
    return journal.recording(child.name)


def texts(recording: Recording) -> list[str]:
    return [value.data for kind, name, value in recording.outputs() if (kind, name) == ("publish", "/told")]


def test_what_a_node_asks_of_itself_is_no_input_and_is_replayed() -> None:
    recording = execute(lambda: recorded(Closed), clock="virtual")
    assert texts(recording) == ["mine [2]"]
    assert not {"call", "goal"} & {kind for kind, *_ in recording.outputs()}
    assert replay(recording).equal


def test_a_caller_that_gave_up_is_answered_no_more_in_the_replay_either() -> None:
    async def main() -> Recording:
        journal = Journal("hero")
        async with run(OTHERS, HERO, Visitor, observers=(journal,), sinks=(), seed=5) as system:
            visitor = system.node(Visitor)
            with pytest.raises(CallTimeout, match="/hero did not answer /ask_many in time"):
                await visitor.call(ASK_MANY, Trigger.Request(), timeout=0.005)
            answer = await visitor.call(PARAMETERS, GetParameters.Request(names=["factor"]))
            assert answer.values[0].integer_value == 2
        return journal.recording("hero")

    recording = execute(main, clock="virtual")
    given_up = [entry for entry in recording.entries if isinstance(entry, tuple) and entry[0] == "given up"]
    assert [type(entry[4]) for entry in given_up] == [CallTimeout]
    answers = [value for kind, _, value in recording.outputs() if kind == "answer"]
    assert len(answers) == 1, "only that of the parameters"
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_a_task_that_other_code_cancels_is_canceled_in_the_replay_at_the_same_instant() -> None:
    async def main() -> Recording:
        SHARED.clear()
        journal = Journal("interrupted")
        async with run(Interrupted, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.25)
            SHARED[0].cancel()
            await system.clock.sleep(0.1)
        return journal.recording("interrupted")

    recording = execute(main, clock="virtual")
    assert texts(recording) == ["interrupted at 0.25"]
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_a_node_that_was_killed_is_killed_in_the_replay() -> None:
    recording = execute(lambda: recorded(Child(Stubborn, stop=0.1), seconds=0.05), clock="virtual")
    assert texts(recording) == ["was killed"]
    assert any(isinstance(entry, tuple) and entry[0] == "interrupt" for entry in recording.entries)
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_a_task_that_a_changed_node_does_not_have_is_not_canceled() -> None:
    class Idle(Interrupted):
        async def on_start(self) -> None:
            pass

    async def main() -> Recording:
        SHARED.clear()
        journal = Journal("interrupted")
        async with run(Interrupted, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.25)
            SHARED[0].cancel()
            await system.clock.sleep(0.1)
        return journal.recording("interrupted")

    verdict = replay(execute(main, clock="virtual"), node=Idle)
    assert (verdict.lacking, verdict.failure) == ("", "")
    assert [(one.name, one.replayed) for one in verdict.differences] == [("/told", "nothing")]


def test_an_answer_that_has_been_given_is_not_given_up() -> None:
    async def main() -> Recording:
        journal = Journal("hero")
        async with run(OTHERS, HERO, Visitor, observers=(journal,), sinks=(), seed=5) as system:
            loop = asyncio.get_running_loop()
            asking = loop.create_task(system.node(Visitor).call(ASK_MANY, Trigger.Request()))
            due = loop.time() + 0.02
            await asyncio.sleep(0.01)
            loop.call_at(due, lambda: loop.call_soon(asking.cancel))  # the answer is there, but has not been taken
            with pytest.raises(asyncio.CancelledError):
                await asking
        return journal.recording("hero")

    recording = execute(main, clock="virtual")
    assert [kind for kind, *_ in recording.outputs()].count("answer") == 1
    assert "given up" not in recording.counts()
    assert replay(recording).equal


def test_a_node_that_waited_for_an_instant_and_for_a_server_that_came_late_waits_for_them_again() -> None:
    async def main() -> Recording:
        journal = Journal("patient")
        async with run(Patient, observers=(journal,), sinks=()) as system:
            await system.clock.sleep_until(system.clock.now() + 0.5)
            await system.join(Child(Closed))
            await system.clock.sleep(0.1)
        return journal.recording("patient")

    recording = execute(main, clock="virtual")
    assert texts(recording) == ["at 0.02", "mine at 0.50"]
    heard = [value[0] for kind, _, value in recording.outputs() if kind == "log"]
    assert heard.count("heard") >= 2
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_work_that_other_code_cancels_is_canceled_in_the_replay() -> None:
    async def main() -> Recording:
        SHARED.clear()
        DONE.clear()
        journal = Journal("computing")
        async with run(Computing, observers=(journal,), sinks=()):
            while not SHARED:
                await asyncio.sleep(0)
            SHARED[0].cancel()
            DONE.set()
            while not texts(journal.recording("computing")):
                await asyncio.sleep(0)
        return journal.recording("computing")

    recording = execute(main, clock="real")
    assert texts(recording) == ["the work was canceled"]
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_a_node_that_comes_late_is_given_the_last_message_of_each_publisher_in_their_order() -> None:
    recording = execute(
        lambda: recorded(Reading, Child(Drawing, name="one"), Child(Drawing, name="two")), clock="virtual"
    )
    assert texts(recording) == ["map of one", "map of two"]
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_a_crash_that_a_node_brings_upon_itself_is_no_input() -> None:
    async def main() -> Recording:
        journal = Journal("rash")
        async with run(Child(Rash), observers=(journal,), sinks=()) as system:
            SHARED[:] = [system]
            await system.clock.sleep(0.5)
        return journal.recording("rash")

    recording = execute(main, clock="virtual")
    (first, _) = [value for kind, name, value in recording.outputs() if (kind, name) == ("end", "/rash")]
    assert first.startswith("RuntimeError")
    assert "crash" not in recording.counts()


def test_a_journal_that_has_nothing_new_is_not_published() -> None:
    heard: list[int] = []

    class Ear(Node):
        @Topic(UInt8MultiArray, "/interrupted/_journal", LATCHED).on()
        def hear(self, message: UInt8MultiArray) -> None:
            heard.append(len(message.data))

    async def main() -> None:
        async with run(Child(Ear), Interrupted, observers=(Journal("interrupted", publish=True),), sinks=()) as system:
            await system.clock.sleep(5)

    execute(main, clock="virtual")
    assert len(heard) <= 2, "its start, and at most its end"


def test_messages_that_were_too_old_when_their_turn_came_are_too_old_in_the_replay() -> None:
    recording = execute(lambda: recorded(Hearing, Hasty), clock="virtual")
    assert texts(recording) == ["in time 0", "in time 1"]  # the others waited for longer than their lifespan
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_what_other_code_publishes_with_the_nodes_publisher_is_not_counted_as_the_nodes() -> None:
    heard: list[str] = []

    class Ear(Node):
        @TOLD.on()
        def hear(self, message: String) -> None:
            heard.append(message.data)

    async def main() -> Recording:
        journal = Journal("closed")
        async with run(Child(Ear), Closed, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.1)
            system.node(Closed).told(String(data="by another"))
            await system.clock.sleep(0.1)
        return journal.recording("closed")

    recording = execute(main, clock="virtual")
    assert heard == ["mine [2]", "by another"]
    assert texts(recording) == ["mine [2]"]
    assert replay(recording).equal


def test_on_the_real_clock_the_readings_and_threads_of_the_node_are_replayed_and_those_of_others_are_not_kept() -> None:
    async def main() -> Recording:
        SHARED[:] = [asyncio.Event()]
        journal = Journal("worker")
        async with run(Worker, observers=(journal,), sinks=()):
            await SHARED[0].wait()
            assert await asyncio.to_thread(pow, 3, 2) == 9
        return journal.recording("worker")

    recording = execute(main, clock="real")
    assert texts(recording) == ["144", "169"]
    assert recording.counts()["clock reading"] > 0
    assert [name for kind, name, _ in recording.outputs() if kind == "offload"] == ["executor", "worker"]
    SHARED[:] = [asyncio.Event()]
    verdict = replay(recording)
    assert verdict.equal, verdict
    other = replay(recording, node=Clockwatcher)  # it reads the clock more often
    assert (other.lacking, other.failure) == ("", "")
    assert not other.equal


def test_a_loop_that_makes_its_tasks_itself_is_refused() -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        loop.set_task_factory(lambda loop, coroutine, **options: asyncio.Task(coroutine, loop=loop, **options))
        try:
            with pytest.raises(ReplayError, match="an event loop without a task factory of its own"):
                async with run(Closed, observers=(Journal("closed"),), sinks=()):
                    pass
        finally:
            loop.set_task_factory(None)

    execute(main, clock="virtual")


def test_a_loop_that_is_not_of_python_is_refused() -> None:
    class Fixed(asyncio.SelectorEventLoop):
        """Stands for a class of a native library, of which no further class can be derived."""

        def __init_subclass__(cls) -> None:
            raise TypeError("not an acceptable base type")

    async def main() -> None:
        with pytest.raises(ReplayError, match="a journal needs an event loop of asyncio, not <"):
            async with run(Closed, observers=(Journal("closed"),), sinks=()):
                pass

    with asyncio.Runner(loop_factory=Fixed) as runner:
        runner.run(main())
