"""The contract of samples."""

from __future__ import annotations

from actors.transport.keyed.protocol import Delivery
from actors.transport.protocol import NoAnswer
from tests.actors.transport.contract.parties import ALL_OF_IT, Happened, Wire, kept, parties, token


class SampleContract:
    """What is put on a key reaches those who listen to it."""

    async def test_a_sample_reaches_all_others_as_it_was_put(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            heard = [party.listen("7/chatter/T/H")[0] for party in (b, c)]
            await b.told_to(a)
            await c.told_to(a)
            outlet = await a.outlet("7/chatter/T/H")

            outlet.put(b"\x00\x01hello", b"\xff" * 33)
            outlet.put(b"", b"")
            await a.until(lambda: all(len(one.samples) == 2 for one in heard), "both have both samples")

            for one in heard:
                assert [(sample.key, sample.payload, sample.attachment) for sample in one.samples] == [
                    ("7/chatter/T/H", b"\x00\x01hello", b"\xff" * 33),
                    ("7/chatter/T/H", b"", b""),
                ]

    async def test_samples_keep_their_order(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            heard, _ = b.listen("7/chatter/T/H")
            outlet = await a.outlet("7/chatter/T/H")

            for number in range(2000):
                outlet.put(b"%d" % number, b"")
            await a.until(lambda: len(heard.samples) >= 2000, "all have arrived")
            await a.told_to(b)

            assert heard.numbers == list(range(2000))

    async def test_best_effort_samples_arrive_in_order_and_once(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            heard, _ = b.listen("7/scan/T/H", Delivery(reliable=False, depth=5))
            outlet = await a.outlet("7/scan/T/H", Delivery(reliable=False, depth=5))

            for number in range(1000):  # any of them may be lost
                outlet.put(b"%d" % number, b"")
                await a.told_to(b)
                if len(heard.samples) >= 20:
                    break

            assert len(heard.samples) >= 20
            assert heard.numbers == sorted(set(heard.numbers))

    async def test_a_large_sample_arrives_whole(self, wire: Wire) -> None:
        image = bytes(range(256)) * 8000
        async with parties(wire, 2) as (a, b):
            heard, _ = b.listen("7/image/T/H")
            outlet = await a.outlet("7/image/T/H")

            outlet.put(image, b"header")
            outlet.put(b"behind", b"")
            await a.until(lambda: len(heard.samples) == 2, "both have arrived")

            assert heard.payloads == [image, b"behind"]

    async def test_own_samples_and_questions_do_not_come_back(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            own, _ = a.listen("7/chatter/T/H")
            asked = a.serve("7/add/T/H", lambda query: query.reply(b"own", b""))
            heard, _ = b.listen("7/chatter/T/H")
            outlet = await a.outlet("7/chatter/T/H")

            outlet.put(b"mine", b"")
            alone = await a.answer("7/add/T/H")
            await a.until(lambda: heard.samples, "the other has the sample")
            back = await b.outlet("7/chatter/T/H")
            back.put(b"yours", b"")
            await a.until(lambda: own.samples, "a sample has come back")

            assert own.payloads == [b"yours"]
            assert alone == NoAnswer(timed_out=False)
            assert asked == []

    async def test_only_the_very_key_is_heard(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            heard, _ = b.listen("7/chatter/T/H")
            others = [b.listen(key)[0] for key in ("7/chatter/T", "7/chatter/T/H/more", "8/chatter/T/H")]
            outlet = await a.outlet("7/chatter/T/H")

            outlet.put(b"1", b"")
            await a.until(lambda: heard.samples, "the sample has arrived")
            await a.told_to(b)

            assert [one.samples for one in others] == [[], [], []]

    async def test_each_of_two_subscriptions_and_two_outlets_stands_for_itself(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            first, handle = b.listen("7/chatter/T/H")
            second, _ = b.listen("7/chatter/T/H")
            await b.told_to(a)
            outlets = [await a.outlet("7/chatter/T/H") for _ in range(2)]

            for outlet in outlets:
                outlet.put(b"1", b"")
            await a.until(lambda: len(first.samples) == len(second.samples) == 2, "both have both")
            handle.close()
            outlets[0].close()
            outlets[0].close()
            outlets[1].put(b"2", b"")
            await a.until(lambda: len(second.samples) == 3, "the other subscription has the next")

            assert first.numbers == [1, 1]
            assert second.numbers == [1, 1, 2]

    async def test_an_outlet_tells_when_it_is_wanted_and_when_no_longer(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            outlet = a.transport.outlet("7/chatter/T/H", ALL_OF_IT)
            unheard = a.transport.outlet("7/silence/T/H", ALL_OF_IT)
            _, own = a.listen("7/chatter/T/H")
            assert not outlet.wanted

            _, first = b.listen("7/chatter/T/H")
            await b.told_to(a)
            _, second = c.listen("7/chatter/T/H")
            await c.told_to(a)
            first.close()
            await b.told_to(a)
            assert outlet.wanted
            second.close()
            own.close()
            await a.until(lambda: not outlet.wanted, "nobody is left")
            await c.told_to(a)

            assert a.told("wanted", "unwanted") == [Happened("wanted", outlet), Happened("unwanted", outlet)]
            assert not unheard.wanted

    async def test_nothing_is_called_from_within_a_method(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            heard, _ = b.listen("7/chatter/T/H")
            outlet = await a.outlet("7/chatter/T/H", kept(10))
            before = len(a.log), len(b.log)

            outlet.put(b"1", b"")
            answers, _ = a.ask("7/nobody/T/H")
            late, _ = b.listen("7/chatter/T/H", kept(10))
            a.transport.announce(token("talker"))

            assert (heard.samples, late.samples, answers) == ([], [], [])
            assert (len(a.log), len(b.log)) == before
            await a.until(lambda: heard.samples and late.samples and answers, "all of it comes from the loop")

    async def test_methods_may_be_called_from_callbacks(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            echo = b.transport.outlet("7/echo/T/H", ALL_OF_IT)
            b.transport.subscribe("7/chatter/T/H", ALL_OF_IT, lambda sample: echo.put(sample.payload * 2, b"echo"))
            heard, _ = a.listen("7/echo/T/H")
            await a.told_to(b)
            outlet = await a.outlet("7/chatter/T/H")

            outlet.put(b"ab", b"")
            await a.until(lambda: heard.samples, "the echo has come")

            assert heard.payloads == [b"abab"]

    async def test_samples_put_after_a_token_told_of_the_subscription_arrive(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            outlet = a.transport.outlet("7/chatter/T/H", ALL_OF_IT)
            heard, _ = b.listen("7/chatter/T/H")
            await b.told_to(a)

            outlet.put(b"1", b"")
            await a.until(lambda: heard.samples, "the sample has arrived")

            assert heard.numbers == [1]
