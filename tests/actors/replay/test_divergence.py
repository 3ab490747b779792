"""A node that was changed is given the recording's inputs as far as it still takes them, and its own course for the rest."""

from __future__ import annotations

import asyncio
import signal
from typing import Any

import pytest

from actors import Child, Node, Service, background, every, execute, parameter, publishes, run
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.parameters.errors import ParameterNotDeclared
from actors.replay import Journal, Recording, replay
from actors.replay.recording import APART
from tests.actors.replay.story import NUMBERS, OTHERS, TOLD, squared, story

LATE = Service(Trigger, "late")
BELL: list[asyncio.Event] = []


class Plain(Node):
    """Says hello once it has computed."""

    told = publishes(TOLD)

    async def on_start(self) -> None:
        self.told(String(data=f"hello {await self.offload(squared, 3, takes=0.01)}"))


class Silent(Plain):
    """Does nothing any more."""

    async def on_start(self) -> None:
        pass


class Lazy(Plain):
    """Says it without computing."""

    async def on_start(self) -> None:
        self.told(String(data="hello 9"))


class Louder(Plain):
    """Says more at the end."""

    async def on_start(self) -> None:
        await super().on_start()
        self.told(String(data="and goodbye"))


class Hesitant(Plain):
    """Would say it, but takes that back."""

    async def on_start(self) -> None:
        await asyncio.sleep(0)
        await asyncio.sleep(0.005)
        asyncio.get_running_loop().call_soon(self.told, String(data="hello 9")).cancel()


class Two(Node):
    """Sends on two topics."""

    told = publishes(TOLD)
    number = publishes(NUMBERS)
    word = "first"
    count = 2

    async def on_start(self) -> None:
        self.told(String(data=self.word))
        asyncio.get_running_loop().call_soon(self.number, Int32(data=3))
        self.number(Int32(data=self.count))


class TwoTheOtherWay(Two):
    """Sends in the other order."""

    async def on_start(self) -> None:
        self.number(Int32(data=self.count))
        self.told(String(data=self.word))


class Answering(Node):
    """Answers, and crashes at the third number."""

    told = publishes(TOLD)

    @NUMBERS.on()
    def number(self, message: Int32) -> None:
        if message.data == 3:
            raise ZeroDivisionError("at three")
        self.told(String(data=str(message.data)))

    @LATE.serve(concurrent=1)
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        await self.clock.sleep(0.01)
        return Trigger.Response(success=True)


class Unanswering(Answering):
    """Answers nobody any more."""

    @LATE.serve(concurrent=1)
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        await asyncio.Event().wait()
        raise AssertionError

    @NUMBERS.on()
    def number(self, message: Int32) -> None:
        self.told(String(data=f"number {message.data}"))
        super().number(message)


class Mended(Answering):
    """Does not crash any more."""

    @NUMBERS.on()
    def number(self, message: Int32) -> None:
        self.told(String(data=f"number {message.data}"))


class Asking(Node):
    """Asks the one that answers."""

    @background
    async def asks(self) -> None:
        await self.clock.sleep(0.005)
        await self.call(LATE, Trigger.Request(), timeout=0.02)


class Insisting(Asking):
    """Asks again."""

    @background
    async def asks(self) -> None:
        await super().asks()
        await super().asks()


class Ringing(Node):
    """Waits for an object that it shares with others."""

    told = publishes(TOLD)
    word = parameter("woken")

    async def on_start(self) -> None:
        self.told(String(data=self.word))
        self.create_task(self.wait())

    async def wait(self) -> None:
        await BELL[0].wait()
        self.told(String(data="rung"))


class Bare(Node):
    """Takes the place of a node that did everything, and does nothing of it."""

    told = publishes(TOLD)

    @every(hz=10)
    def tick(self) -> None:
        self.told(String(data=f"tick at {self.clock.now():.1f}"))


async def recorded(node: type[Node], *others: type[Node], seconds: float = 0.1) -> Recording:
    child = Child(node)
    journal = Journal(child.name)
    async with run(*others, child, observers=(journal,), sinks=(), seed=5) as system:
        await system.clock.sleep(seconds)
    return journal.recording(child.name)


@pytest.fixture(scope="module")
def plain() -> Recording:
    return execute(lambda: recorded(Plain), clock="virtual")


@pytest.fixture(scope="module")
def answering() -> Recording:
    """Two lives, with a crash in between, and a call that was answered."""
    return execute(lambda: recorded(Answering, OTHERS.factory, Asking, seconds=0.08), clock="virtual")  # type: ignore[arg-type]


def told(verdict: Any) -> list[tuple[str, Any, Any]]:
    return [(one.field, one.recorded, one.replayed) for one in verdict.differences if one.name == "/told"]


def test_what_a_changed_node_does_not_send_any_more_is_told(plain: Recording) -> None:
    assert replay(plain).equal
    assert told(replay(plain, node=Silent)) == [("", String(data="hello 9"), "nothing")]


def test_what_a_changed_node_sends_beyond_the_recording_is_told(plain: Recording) -> None:
    assert told(replay(plain, node=Louder)) == [("", "nothing", String(data="and goodbye"))]


def test_a_call_that_the_recorded_node_did_not_make_is_told() -> None:
    recording = execute(lambda: recorded(Asking, Answering), clock="virtual")
    assert replay(recording).equal
    more, *_ = replay(recording, node=Insisting).differences
    assert (more.kind, more.name, more.number, more.recorded) == ("call", "/late", 1, "nothing")


def test_a_node_that_needs_less_to_send_the_same_is_equal_to_its_recording(plain: Recording) -> None:
    assert replay(plain, node=Lazy).equal


def test_a_node_that_sends_in_another_order_differs_where_the_recording_sent_something_else() -> None:
    recording = execute(lambda: recorded(Two), clock="virtual")
    first, *_ = replay(recording, node=TwoTheOtherWay).differences
    assert (first.kind, first.name, first.recorded) == ("publish", "/told", String(data="first"))
    assert first.replayed == "publish /numbers: std_msgs.msg.Int32(data=2)"


def test_an_unchanged_node_is_played_to_up_to_its_first_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = execute(lambda: recorded(Two), clock="virtual")
    monkeypatch.setattr(Two, "word", "other")
    monkeypatch.setattr(Two, "count", 4)
    ended, through = replay(recording), replay(recording, every=True)
    assert [one.name for one in through.differences] == ["/told", "/numbers"]
    assert ended.differences == through.differences[:1]


def test_a_callback_that_a_node_off_the_tape_has_taken_back_does_not_run(plain: Recording) -> None:
    assert told(replay(plain, node=Hesitant)) == [("", String(data="hello 9"), "nothing")]


def test_a_mended_node_lives_on_where_the_recorded_one_crashed(answering: Recording) -> None:
    assert replay(answering).equal
    lives = [entry for entry in answering.entries if isinstance(entry, tuple) and entry[0] == "start"]
    verdict = replay(answering, node=Mended)
    assert len(lives) == 2
    assert verdict.failure == ""
    assert told(verdict) == [("data", "1", "number 1")]


def test_a_request_that_a_changed_node_leaves_unanswered_runs_out_as_it_would_have(answering: Recording) -> None:
    verdict = replay(answering, node=Unanswering)
    assert verdict.lacking == ""
    assert [one for one in verdict.differences if one.kind == "answer"]


def test_an_error_of_whoever_sets_parameters_is_no_error_of_the_node() -> None:
    async def main() -> Recording:
        journal = Journal("plain")
        async with run(Plain, observers=(journal,), sinks=()) as system:
            with pytest.raises(ParameterNotDeclared):
                system.node(Plain).set_parameter("ghost", 1)
        return journal.recording("plain")

    verdict = replay(execute(main, clock="virtual"))
    assert verdict.equal
    assert verdict.failure == ""


def test_a_node_that_takes_nothing_of_what_the_recorded_one_took_goes_its_own_way() -> None:
    journal, _ = execute(story, clock="virtual")
    verdict = replay(journal.recording("hero"), node=Bare, parameters={})
    lacking = {one.name for one in verdict.differences}
    assert (verdict.failure, verdict.lacking) == ("", "")
    assert {"/told", "/measured", "/ask"} <= lacking


def test_what_no_journal_carries_does_not_end_the_replay_of_a_node_that_has_left_the_recording() -> None:
    async def main() -> Recording:
        BELL[:] = [asyncio.Event()]
        journal = Journal("ringing")
        async with run(Ringing, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.1)
            BELL[0].set()
            await system.clock.sleep(0.1)
        return journal.recording("ringing")

    recording = execute(main, clock="virtual")
    BELL[:] = [asyncio.Event()]

    class Late(Ringing):
        async def on_start(self) -> None:
            await self.clock.sleep(0.02)
            await super().on_start()

    verdict = replay(recording, node=Late)
    assert verdict.lacking == ""
    assert told(verdict) == [("", String(data="woken"), "nothing")]  # at its time; it came later


def test_a_journal_that_speaks_of_what_it_has_not_told_before_ends_the_replay_with_an_error(plain: Recording) -> None:
    start, *rest = plain.entries
    damaged = Recording(plain.node, [start, ("deliver", 0.0, APART, 0, 17, String(data="lost"), None), *rest])
    with pytest.raises(KeyError, match="17"):
        replay(damaged)


def test_an_interrupt_from_the_keyboard_ends_the_replay(plain: Recording) -> None:
    with pytest.raises(KeyboardInterrupt):
        replay(plain, pause=("/told", 0), debugger=lambda: signal.raise_signal(signal.SIGINT))
