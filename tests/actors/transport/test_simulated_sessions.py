"""What a process on a simulated network does at awkward moments, beyond the contract of all transports."""

from __future__ import annotations

import asyncio

import pytest

from actors.time.deadlock import Deadlock
from actors.time.virtual_loop import VirtualLoop
from actors.transport.keyed.protocol import Replied
from actors.transport.protocol import NoAnswer
from actors.transport.simulated.topology import Host
from tests.actors.transport.contract.parties import ALL_OF_IT, token
from tests.actors.transport.lab import KEY, Lab, Timed, numbered

pytestmark = pytest.mark.virtual


# Moments --------------------------------------------------------------------------------------------------------------


async def test_a_question_that_arrives_when_its_server_has_closed_ends_without_answer() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    server = b.transport.serve("7/add/T/H", lambda query: query.reply(b"", b""))
    await b.told_to(a)

    server.close()
    server.close()

    assert await a.answer("7/add/T/H") == NoAnswer(timed_out=False)


async def test_one_of_two_servers_in_a_process_may_leave_a_question_to_the_other() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    first, second = b.serve("7/add/T/H"), b.serve("7/add/T/H")
    await b.told_to(a)
    answers, _ = a.ask("7/add/T/H")
    await lab.until(lambda: first and second, "both are asked")

    first[0].drop()
    first[0].drop()
    await asyncio.sleep(1.0)
    assert answers == []
    second[0].reply(b"mine", b"")
    await lab.until(lambda: answers, "it is answered")

    assert answers == [Replied(b"mine", b"")]


def test_a_question_that_has_ended_leaves_no_timer() -> None:
    async def main() -> None:
        lab = Lab()
        a, b = await lab.parties("a", "b")
        b.serve("7/add/T/H", lambda query: query.reply(b"", b""))
        await b.told_to(a)
        await a.answer("7/add/T/H", timeout=3600.0)
        await asyncio.Event().wait()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        with pytest.raises(Deadlock):
            runner.run(main())
        assert runner.get_loop().time() < 10.0


async def test_a_process_that_dies_while_it_is_told_of_a_loss_hears_no_more_of_it() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    b.transport.announce(token("of_b"))
    await b.told_to(a)
    write = a._write

    def die(kind: str, of: object) -> None:
        write(kind, of)
        if kind == "down":
            lab.network.kill(a.transport)

    a._write = die  # type: ignore[method-assign]
    lab.network.kill(b.transport)
    await lab.unlinked(a, b)
    await asyncio.sleep(1.0)

    assert a.log[-1] == ("down", b.session)


async def test_an_answer_to_a_process_that_has_gone_reaches_nobody() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    queries = b.serve("7/add/T/H")
    await b.told_to(a)
    answers, _ = a.ask("7/add/T/H")
    await lab.until(lambda: queries, "it is asked")
    lab.network.kill(a.transport)
    await lab.unlinked(b, a)

    queries[0].reply(b"", b"")
    await asyncio.sleep(1.0)

    assert answers == []


async def test_a_process_that_dies_while_it_is_found_is_lost_again() -> None:
    lab = Lab()
    for name in ("a", "b"):
        lab.network.add_host(name)
    a, b = await lab.party("a"), await lab.party("b")
    write = b._write

    def kill(kind: str, of: object) -> None:
        write(kind, of)
        lab.network.kill(a.transport)

    b._write = kill  # type: ignore[method-assign]
    await lab.until(lambda: b.log, "it is found")
    await lab.unlinked(b, a)

    assert b.kinds() == ["up", "down"]
    assert a.log == []


async def test_tokens_that_are_not_watched_for_do_not_vanish_either() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    other = a.transport.announce("@ros2_lv/8/other")
    await a.told_to(b)

    other.close()
    await a.told_to(b)

    assert b.kinds("vanished") == []


# What is the same for all ---------------------------------------------------------------------------------------------


async def test_a_token_of_two_processes_lives_until_both_have_withdrawn_it() -> None:
    lab = Lab()
    a, b, c = await lab.parties("a", "b", "c")
    first = a.transport.announce(token("shared"))
    b.transport.announce(token("shared"))
    await a.told_to(c)
    await b.told_to(c)

    first.close()
    await a.told_to(c)
    assert c.kinds("vanished") == []
    lab.network.kill(b.transport)
    await lab.unlinked(c, b)

    assert [one for one in c.log if one.of == token("shared")] == [
        ("appeared", token("shared")),
        ("vanished", token("shared")),
    ]


async def test_what_is_declared_before_a_transport_is_open_is_shown_when_it_is() -> None:
    lab = Lab()
    (a,) = await lab.parties("a")
    heard, _ = lab.hear(a)
    lab.network.add_host("b")
    early = lab.network.transport("b")
    early.announce(token("early"))
    outlet = early.outlet(KEY, ALL_OF_IT)
    outlet.put(numbered(1), b"")

    await early.open("@ros2_lv/**", Timed(early, lab.changes))
    await lab.until(lambda: a.has("appeared", token("early")) and outlet.wanted, "it is shown")
    outlet.put(numbered(2), b"")
    await lab.until(lambda: heard, "a sample arrives")

    assert [number for _, number in heard] == [2]


async def test_a_closed_transport_reaches_nobody_whatever_is_asked_of_it() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    heard, subscription = lab.hear(b)
    outlet = await a.outlet(KEY)
    token_handle = a.transport.announce(token("gone"))
    await a.transport.close()
    await lab.unlinked(b, a)
    before = list(a.log)

    outlet.put(numbered(1), b"")
    outlet.close()
    token_handle.close()
    a.transport.announce(token("late"))
    answers, _ = a.ask("7/add/T/H")
    late = a.transport.outlet(KEY, ALL_OF_IT)
    late.put(numbered(2), b"")
    subscription.close()
    subscription.close()
    await asyncio.sleep(10.0)

    assert (heard, answers, a.log) == ([], [], before)
    assert not b.has("appeared", token("late"))
    assert not late.wanted


async def test_an_error_of_a_callback_goes_to_the_loop_and_the_rest_arrives() -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    reported: list[dict[str, object]] = []
    lab.loop.set_exception_handler(lambda _, context: reported.append(context))

    def fail(sample: object) -> None:
        raise RuntimeError("a bug")

    b.transport.subscribe("7/bug/T/H", ALL_OF_IT, fail)
    heard, _ = lab.hear(b)
    await b.told_to(a)
    bad, outlet = await a.outlet("7/bug/T/H"), await a.outlet(KEY)

    bad.put(b"", b"")
    outlet.put(numbered(1), b"")
    await lab.until(lambda: heard, "the other sample arrives")

    assert [str(one["exception"]) for one in reported] == ["a bug"]


@pytest.mark.parametrize("how", ["wanted", "unwanted", "vanished"])
async def test_outlets_may_be_closed_while_they_are_told_of_a_change(how: str) -> None:
    lab = Lab()
    a, b = await lab.parties("a", "b")
    outlets = [a.transport.outlet(KEY, ALL_OF_IT) for _ in range(2)]
    write = a._write

    def close_all(kind: str, of: object) -> None:
        write(kind, of)
        if kind == how:
            for outlet in outlets:
                outlet.close()

    a._write = close_all  # type: ignore[method-assign]
    b.transport.announce(token("of_b"))
    _, subscription = lab.hear(b)
    await b.told_to(a)
    if how == "vanished":
        lab.network.kill(b.transport)
        await lab.unlinked(a, b)
    else:
        subscription.close()
        await b.told_to(a)

    assert [outlet.wanted for outlet in outlets] == [False, False]
    assert (
        a.kinds("wanted", "unwanted")
        == {
            "wanted": ["wanted"],
            "unwanted": ["wanted", "wanted", "unwanted"],
            "vanished": ["wanted", "wanted"],
        }[how]
    )


async def test_a_network_names_what_it_does_not_have() -> None:
    lab = Lab()
    lab.network.add_host("robot", router=True, clock_offset=0.5)

    with pytest.raises(ValueError, match="no host 'robt'; did you mean 'robot'"):
        lab.network.transport("robt")
    with pytest.raises(ValueError, match="no host 'base'"):
        lab.network.cut("robot", "base")
    with pytest.raises(ValueError, match="'robot' already"):
        lab.network.add_host("robot")
    with pytest.raises(ValueError, match="it is on 'robot'"):
        lab.network.add_host("base", router=True)
    robot = lab.network.host("robot")
    assert isinstance(robot, Host)
    assert (robot.clock_offset, repr(robot)) == (0.5, "<Host robot peer>")
    assert repr(lab.network.transport("robot")).endswith(" on robot>")


async def test_who_starts_while_a_machine_stands_still_meets_it_when_it_goes_on() -> None:
    lab = Lab(lease=4.0)
    (a,) = await lab.parties("a")
    lab.network.add_host("b")
    lab.network.pause("a")

    b = await lab.party("b")
    await asyncio.sleep(1.0)
    assert b.kinds() == []

    lab.network.resume("a")
    await lab.linked(a, b)
