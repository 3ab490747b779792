"""Sessions that are not ours: processes of ROS 2, and processes of ours that misbehave, played by plain Zenoh sessions."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import closing
from random import Random

import pytest
import zenoh
import zenoh.ext

from actors.transport.format.names import new_session
from actors.transport.keyed.protocol import Delivery, Query, Replied
from actors.transport.protocol import Failed, Link, NoAnswer
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.history import ask_history
from actors.transport.zenoh.outgoing_queries import Question
from actors.transport.zenoh.queryables import Server
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import TOKENS, Changes, Party
from tests.actors.transport.zenoh.fakes import FakeQuery, FakeReply, FakeSession, sample
from tests.actors.transport.zenoh.wires import free_port

KEY = "7/b/a::srv::dds_::B_/H"


def of_server(session: str) -> str:
    return f"@ros2_lv/7/{session}/0/1/SS/%/%/node/%b/a::srv::dds_::B_/H/::,10:,:,:,,"


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
async def a(port: int) -> AsyncIterator[Party]:
    """A transport at a port."""
    one = Party(ZenohKeys(ZenohConfig(listen=(f"tcp/127.0.0.1:{port}",), gossip_port=0)), Changes())
    await one.open()
    yield one
    await one.transport.close()


@pytest.fixture
def other(port: int, a: Party) -> Iterator[zenoh.Session]:
    """A plain session that is linked with it."""
    with closing(zenoh.open(config_of(port))) as session:
        yield session


@pytest.fixture
def ours(port: int, a: Party) -> Iterator[zenoh.Session]:
    """Such a session with the identity of a process of this library, which is expected to beat."""
    with closing(zenoh.open(config_of(port, id=new_session(Random(1))))) as session:
        yield session


def config_of(port: int, **more: str) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {
        **more,
        "connect/endpoints": [f"tcp/127.0.0.1:{port}"],
        "listen/endpoints": [],
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,
        "timestamping/enabled": True,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config


def handler(call: object) -> zenoh.handlers.Callback:  # type: ignore[type-arg]
    return zenoh.handlers.Callback(call, indirect=False)  # type: ignore[arg-type]


async def test_a_process_of_ros_2_is_shown_by_its_tokens(a: Party, other: zenoh.Session) -> None:
    session = str(other.zid())
    token = other.liveliness().declare_token(of_server(session))
    await a.until(lambda: a.has("appeared", of_server(session)), "its server appears")
    assert a.transport.report() == (Link(session, "", 0, 0, 0, 0),)

    token.undeclare()
    await a.until(lambda: a.has("vanished", of_server(session)), "its server vanishes")

    assert [one.kind for one in a.log] == ["up", "appeared", "down", "vanished"]
    assert a.transport.report() == ()


async def test_the_questions_to_a_process_that_has_fallen_silent_end_unless_another_serves_them(
    a: Party, ours: zenoh.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.zenoh.heartbeat.PERIOD", 0.02)
    monkeypatch.setattr("actors.transport.zenoh.heartbeat.SILENCE", 0.3)
    session = str(ours.zid())
    asked: list[object] = []
    both = "7/both/a::srv::dds_::B_/H"
    scope = "@robactor/_ros2_lv_7"
    kept = [
        ours.declare_queryable(KEY, handler(asked.append), complete=True),
        ours.declare_queryable(both, handler(asked.append), complete=True),
        ours.liveliness().declare_token(of_server(session)),
        ours.liveliness().declare_token(of_server(session).replace("%b", "%both")),
        ours.liveliness().declare_token(of_server(session).replace("SS", "SX")),
        ours.liveliness().declare_token(of_server(session).replace("SS", "MP")),
        ours.liveliness().declare_token(of_server("c3").replace("%b", "%both")),
        ours.liveliness().declare_token(f"{scope}/{session}/4711/lab"),
    ]
    await a.until(lambda: len(a.told("appeared")) == 5, "all tokens appear")
    ours.put(f"{scope}/alive", session.encode())  # who has never been heard has not fallen silent
    (lost, _), (waiting, _), (elsewhere, _) = a.ask(KEY), a.ask(both), a.ask("7/else/T/H", timeout=60)
    await a.until(lambda: lost, "the question ends")

    assert lost == [NoAnswer(timed_out=False)]
    assert waiting == []
    assert elsewhere == [NoAnswer(timed_out=False)]
    assert [one.kind for one in a.log if one.of == session] == ["up", "down"]
    assert [one for one in a.transport.report() if one.session == session] == []

    ours.put(f"{scope}/alive", b"\xff")
    ours.put(f"{scope}/alive", session.encode())
    await a.until(lambda: a.is_linked(session), "it is heard again")
    assert {one.of for one in a.told("appeared")[5:]} == {one.of for one in a.told("vanished")}
    assert [(one.host, one.process) for one in a.transport.report() if one.session == session] == [("lab", 4711)]
    assert len(kept) == 8


async def test_when_many_tokens_have_vanished_their_memory_is_given_back(
    a: Party, other: zenoh.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.zenoh.connection.MANY", 3)
    monkeypatch.setattr("actors.transport.zenoh.connection.AFTER", 0.01)
    changes, loop = Changes(), asyncio.get_running_loop()
    given: list[str] = []

    def note(what: str) -> None:
        given.append(what)
        changes.note()

    monkeypatch.setattr("actors.transport.zenoh.connection.give_back", lambda: loop.call_soon_threadsafe(note, "all"))
    tokens = [
        other.liveliness().declare_token(of_server(str(other.zid())).replace("%b", f"%b{number}"))
        for number in range(3)
    ]
    await a.until(lambda: len(a.told("appeared")) == 3, "all tokens appear")
    for token in tokens:
        token.undeclare()
    await changes.until(lambda: given, "memory is given back")
    assert len(a.told("vanished")) == 3


async def test_a_transport_that_closes_meanwhile_gives_nothing_back(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.transport.zenoh.connection.MANY", 1)
    monkeypatch.setattr("actors.transport.zenoh.connection.give_back", pytest.fail)
    one = Party(ZenohKeys(ZenohConfig(listen=(f"tcp/127.0.0.1:{port}",), gossip_port=0)), Changes())
    await one.open()
    with closing(zenoh.open(config_of(port))) as session:
        token = session.liveliness().declare_token(of_server(str(session.zid())))
        await one.until(lambda: one.told("appeared"), "its server appears")
        token.undeclare()
        await one.until(lambda: one.told("vanished"), "its server vanishes")
        await one.transport.close()


async def test_processes_of_ros_2_are_asked_now_and_then_so_that_something_comes_from_them(
    a: Party, other: zenoh.Session, ours: zenoh.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.zenoh.heartbeat.PERIOD", 0.02)
    monkeypatch.setattr("actors.transport.zenoh.connection.QUESTIONS", 2)
    changes, loop = Changes(), asyncio.get_running_loop()
    asked: list[str] = []

    def answer(query: zenoh.Query) -> None:
        with query:
            asked.append(str(query.key_expr))
            query.reply(query.key_expr, b"")
        loop.call_soon_threadsafe(changes.note)

    kept = [
        one.declare_queryable(f"@/{one.zid()}/peer/robactor", handler(answer), complete=True) for one in (ours, other)
    ]
    await changes.until(lambda: len(asked) > 2, "the process of ROS 2 has been asked three times")
    assert set(asked) == {f"@/{other.zid()}/peer/robactor"}
    assert kept


async def test_a_question_of_a_plain_session_without_payload_is_answered(a: Party, other: zenoh.Session) -> None:
    def answer(query: Query) -> None:
        query.reply(query.payload + query.attachment + b"!", b"answered")

    served = asyncio.Event()
    loop = asyncio.get_running_loop()
    querier = other.declare_querier(KEY)
    listener = querier.declare_matching_listener(handler(lambda _: loop.call_soon_threadsafe(served.set)))
    a.serve(KEY, answer)
    await served.wait()

    replies = await asyncio.to_thread(lambda: [reply.ok for reply in querier.get()])

    assert [reply.payload.to_bytes() for reply in replies if reply is not None] == [b"!"]
    assert listener is not None


async def test_a_question_that_a_plain_session_has_answered_and_not_ended_is_forgotten(
    a: Party, other: zenoh.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[zenoh.Query] = []
    forgotten: list[str] = []
    forget = Question.cancel

    def cancel(question: Question) -> None:
        forgotten.append(question.key)
        forget(question)

    monkeypatch.setattr(Question, "cancel", cancel)

    def answer(query: zenoh.Query) -> None:
        kept.append(query)
        query.reply(KEY, b"first")

    served = other.declare_queryable(KEY, handler(answer), complete=True)
    token = other.liveliness().declare_token(of_server(str(other.zid())))
    await a.until(lambda: a.told("appeared"), "its server appears")
    assert await a.answer(KEY) == Replied(b"first", b"")
    while not forgotten:
        await asyncio.sleep(0.01)
    assert (forgotten, len(kept)) == ([KEY], 1)
    assert served is not token


async def test_an_answer_without_attachment_is_taken(a: Party, other: zenoh.Session) -> None:
    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(KEY, b"plain")

    served = other.declare_queryable(KEY, handler(answer), complete=True)
    token = other.liveliness().declare_token(of_server(str(other.zid())))
    await a.until(lambda: a.told("appeared"), "its server appears")

    assert await a.answer(KEY) == Replied(b"plain", b"")
    assert served is not token


async def test_history_passes_between_ours_and_plain_advanced_classes_both_ways(a: Party, other: zenoh.Session) -> None:
    loop = asyncio.get_running_loop()
    token = other.liveliness().declare_token(of_server(str(other.zid())))
    await a.until(lambda: a.told("appeared"), "the two are linked")
    for history in (Delivery(depth=3, history=3), Delivery(reliable=False, depth=3, history=3)):
        key = f"7/map{history.reliable}/T/H"
        ours = a.transport.outlet(key, history)
        own, _ = a.listen(key, history)
        misses = zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5) if history.reliable else None
        theirs = zenoh.ext.declare_advanced_publisher(
            other,
            f"{key}/back",
            cache=zenoh.ext.CacheConfig(max_samples=3),
            publisher_detection=True,
            sample_miss_detection=misses,
        )
        for number in range(5):
            ours.put(b"%d" % number, b"ours")
            theirs.put(b"%d" % number, attachment=b"theirs")
        got: list[bytes] = []
        changes = Changes()

        def take(sample: zenoh.Sample, got: list[bytes] = got, changes: Changes = changes) -> None:
            got.append(sample.payload.to_bytes())
            loop.call_soon_threadsafe(changes.note)

        subscriber = zenoh.ext.declare_advanced_subscriber(
            other,
            key,
            handler(take),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=3),
        )
        heard, _ = a.listen(f"{key}/back", history)
        await changes.until(lambda got=got: b"4" in got, "our history has come to them")  # type: ignore[misc]
        await a.until(lambda heard=heard: 4 in heard.numbers, "their history has come to us")  # type: ignore[misc]

        # a sample that was still on its way when the subscription was made may come, too
        assert got[-3:] == [b"2", b"3", b"4"] == sorted(got)[-3:]
        assert heard.numbers == list(range(heard.numbers[0], 5))
        assert heard.numbers[0] <= 2
        assert {sample.attachment for sample in heard.samples} == {b"theirs"}
        assert own.samples == []
        subscriber.undeclare()
    token.undeclare()


async def test_a_transport_is_opened_once_and_used_while_it_is_open() -> None:
    one = Party(ZenohKeys(ZenohConfig(gossip_port=0)), Changes())
    with pytest.raises(RuntimeError, match="the transport is not open"):
        one.transport.announce("@ros2_lv/7/talker")
    assert one.transport.report() == ()
    await one.open()
    outlet = one.transport.outlet("7/chatter/T/H", Delivery())
    handles = [outlet, one.listen("7/a/T/H")[1], one.transport.serve(KEY, print), one.transport.announce("@a/b")]
    with pytest.raises(RuntimeError, match="a transport is opened once"):
        await one.transport.open(TOKENS, one)

    await one.transport.close()
    outlet.put(b"late", b"")
    for handle in handles:
        handle.close()

    with pytest.raises(RuntimeError, match="the transport is not open"):
        one.listen("7/a/T/H")


async def test_a_token_that_is_announced_twice_is_never_told_to_its_own_transport(
    a: Party, other: zenoh.Session
) -> None:
    text = "@ros2_lv/7/talker"
    first, second = a.transport.announce(text), a.transport.announce(text)
    first.close()
    second.close()
    token = other.liveliness().declare_token("@ros2_lv/7/listener")
    await a.until(lambda: a.told("appeared"), "the other's token appears")

    assert [one.of for one in a.log] == ["@ros2_lv/7/listener"]
    token.undeclare()


async def test_an_opening_that_is_cancelled_leaves_no_session() -> None:
    port = free_port()
    config = ZenohConfig(listen=(f"tcp/127.0.0.1:{port}",), gossip_port=free_port())
    one = Party(ZenohKeys(config), Changes())
    opening = asyncio.create_task(one.open())
    await asyncio.sleep(0)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    while [thread for thread in threading.enumerate() if thread.name == "zenoh worker"]:
        await asyncio.sleep(0.01)

    again = Party(ZenohKeys(config), Changes())
    await again.open()
    await again.transport.close()


async def test_questions_of_a_session_that_was_closed_end() -> None:
    session = zenoh.open(
        zenoh.Config.from_json5("{scouting: {multicast: {enabled: false}, delay: 0}, listen: {endpoints: []}}")
    )
    session.close()
    changes, loop = Changes(), asyncio.get_running_loop()
    ended: list[object] = []
    worker = Worker("test")
    question = Question("7/a/T/H", None, print, print)

    ask_history(session, "7/map/T/H", 1, ("a1", 1), print, lambda: ended.append("history"))  # type: ignore[arg-type]

    def unanswered(one: Question) -> None:
        ended.append(one)
        changes.note()

    question.ask(session, b"", b"", Wakeup(loop), worker, unanswered)  # type: ignore[arg-type]
    await changes.until(lambda: len(ended) == 2, "the question ends")
    worker.close()

    assert ended == ["history", question]


@pytest.mark.parametrize(
    ("reply", "answer"),
    [
        (FakeReply(sample(b"yes", attachment=b"a")), Replied(b"yes", b"a")),
        (FakeReply(None, sample(b"no")), Failed(b"no")),
    ],
)
async def test_the_first_answer_to_a_question_counts_and_it_lingers_until_it_is_ended(
    reply: FakeReply, answer: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.zenoh.outgoing_queries.bare", lambda *calls: calls)
    session, worker, loop = FakeSession(), Worker("test"), asyncio.get_running_loop()
    answers: list[object] = []
    question = Question("7/a/T/H", None, answers.append, lambda one: None)
    question.ask(session, b"", b"", Wakeup(loop), worker, pytest.fail)  # type: ignore[arg-type]
    await worker.result(lambda: None)
    worker.close()

    replied, ended = session.handler
    replied(reply)
    replied(FakeReply(sample(b"late")))
    await asyncio.sleep(0.01)
    assert (answers, question.lingers) == ([answer], True)
    ended()
    await asyncio.sleep(0.01)
    assert not question.lingers


async def test_a_question_that_comes_to_a_closed_server_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.transport.zenoh.queryables.direct", lambda call: call)
    session, query, worker = FakeSession(), FakeQuery(), Worker("test")
    forgotten: list[Server] = []
    take = pytest.fail
    server = Server(session, "7/a/T/H", take, Wakeup(asyncio.get_running_loop()), worker, forgotten.append)  # type: ignore[arg-type]

    session.handler(query)
    server.close()
    server.close()
    await asyncio.sleep(0.01)
    worker.close()

    assert query.dropped == 1
    assert forgotten == [server]
