"""The contract of processes that are lost, and that are cut off and found again."""

from __future__ import annotations

from actors.transport.protocol import NoAnswer
from tests.actors.transport.contract.parties import Breakable, Happened, Mortal, kept, parties, token


class LossContract:
    """What is guaranteed when a process ends without a farewell."""

    async def test_the_link_goes_first_then_the_tokens_then_the_questions(self, wire: Mortal) -> None:
        async with parties(wire, 3) as (a, b, c):
            for party in (b, c):
                party.serve(f"7/{party.session}/T/H")
            b.transport.announce(token("of_b"))
            await b.told_to(a)
            await c.told_to(a)
            lost, _ = a.ask(f"7/{b.session}/T/H")
            kept_waiting, _ = a.ask(f"7/{c.session}/T/H")
            before = len(a.log)

            wire.kill(b.transport)
            await a.until(lambda: lost, "the question has ended")

            after = a.log[before:]
            assert after[0] == Happened("down", b.session)
            assert after[-1] == Happened("answered", NoAnswer(timed_out=False))
            assert {one.kind for one in after[1:-1]} == {"vanished"}
            assert token("of_b") in {one.of for one in after[1:-1]}
            assert kept_waiting == []
            assert a.is_linked(c.session)

    async def test_an_outlet_is_not_wanted_any_more(self, wire: Mortal) -> None:
        async with parties(wire, 2) as (a, b):
            b.listen("7/chatter/T/H")
            outlet = await a.outlet("7/chatter/T/H")

            wire.kill(b.transport)
            await a.until(lambda: not outlet.wanted, "nobody wants it any more")

            outlet.put(b"into the void", b"")
            assert not a.is_linked(b.session)


class PartitionContract:
    """What is guaranteed when two processes are cut off from each other, and find each other again."""

    async def test_both_lose_each_other_and_everything_is_announced_again(self, wire: Breakable) -> None:
        async with parties(wire, 2) as (a, b):
            a.transport.announce(token("of_a"))
            b.transport.announce(token("of_b"))
            await a.told_to(b)
            await b.told_to(a)
            heard, _ = b.listen("7/chatter/T/H")
            outlet = await a.outlet("7/chatter/T/H")

            wire.cut(a.transport, b.transport)
            await a.until(lambda: a.has("vanished", token("of_b")) and b.has("vanished", token("of_a")), "all is lost")
            assert not outlet.wanted
            wire.heal(a.transport, b.transport)
            await a.until(lambda: a.is_linked(b.session) and b.is_linked(a.session) and outlet.wanted, "all is found")
            await a.told_to(b)
            await b.told_to(a)
            outlet.put(b"1", b"")
            await a.until(lambda: heard.samples, "a sample has arrived")

            for one, text in ((a, token("of_b")), (b, token("of_a"))):
                assert [entry.kind for entry in one.log if entry.of == text] == ["appeared", "vanished", "appeared"]
            assert [one.kind for one in a.told("up", "down")] == ["up", "down", "up"]

    async def test_history_that_was_missed_comes_afterwards_and_what_had_come_does_not_come_twice(
        self, wire: Breakable
    ) -> None:
        async with parties(wire, 2) as (a, b):
            heard, _ = b.listen("7/map/T/H", kept(3))
            outlet = await a.outlet("7/map/T/H", kept(3))
            outlet.put(b"0", b"")
            outlet.put(b"1", b"")
            await a.until(lambda: len(heard.samples) == 2, "the first two have arrived")

            wire.cut(a.transport, b.transport)
            await a.until(lambda: not a.is_linked(b.session) and not b.is_linked(a.session), "they are cut off")
            outlet.put(b"2", b"")
            wire.heal(a.transport, b.transport)
            await a.until(lambda: 2 in heard.numbers, "the missed one has come")
            await a.told_to(b)

            assert heard.numbers == [0, 1, 2]
