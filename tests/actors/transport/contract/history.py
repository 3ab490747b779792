"""The contract of samples that are kept for later subscriptions."""

from __future__ import annotations

from tests.actors.transport.contract.parties import Wire, kept, parties


class HistoryContract:
    """A late subscription gets what was kept, and then what is new."""

    async def test_a_late_subscription_gets_what_was_kept_and_then_what_is_new(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            arrived, _ = b.listen("7/mark/T/H", kept(1))
            mark = await a.outlet("7/mark/T/H", kept(1))
            outlet = a.transport.outlet("7/map/T/H", kept(3))
            for number in range(5):
                outlet.put(b"%d" % number, b"kept")
            # What is on its way when somebody subscribes may still reach the subscription. It comes before the mark.
            mark.put(b"", b"")
            await a.until(lambda: arrived.samples, "the mark has come")

            heard, _ = b.listen("7/map/T/H", kept(3))
            await a.until(lambda: len(heard.samples) == 3, "the history has come")
            outlet.put(b"5", b"new")
            await a.until(lambda: 5 in heard.numbers, "the new sample has come")

            assert heard.numbers == [2, 3, 4, 5]
            assert heard.samples[0].key == "7/map/T/H"
            assert heard.samples[0].attachment == b"kept"

    async def test_history_and_new_samples_meet_without_gap_and_without_double(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            outlet = a.transport.outlet("7/map/T/H", kept(1000))
            for number in range(100):
                outlet.put(b"%d" % number, b"")

            heard, _ = b.listen("7/map/T/H", kept(1000))
            for number in range(100, 200):
                outlet.put(b"%d" % number, b"")
                if number % 10 == 0:
                    await b.told_to(a)
            await a.until(lambda: 199 in heard.numbers, "the last one has come")

            assert heard.numbers == list(range(200))

    async def test_a_transport_that_opens_later_gets_the_history_too(self, wire: Wire) -> None:
        async with parties(wire, 1) as (a,):
            outlet = a.transport.outlet("7/map/T/H", kept(1))
            outlet.put(b"1", b"")
            outlet.put(b"2", b"")

            async with parties(wire, 1) as (late,):
                heard, _ = late.listen("7/map/T/H", kept(1))
                await late.until(lambda: heard.samples, "the history has come")

                assert heard.numbers == [2]

    async def test_history_comes_only_where_it_is_wanted_and_kept(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, witness):
            gone, _ = witness.listen("7/map/T/H", kept(0))
            await witness.told_to(a)
            keeping, forgetting = a.transport.outlet("7/map/T/H", kept(5)), a.transport.outlet("7/map/T/H", kept(0))
            for number in range(3):
                keeping.put(b"%d" % number, b"")
                forgetting.put(b"%d" % (10 + number), b"")
            await a.until(lambda: len(gone.samples) == 6, "all samples have left")

            plain, _ = b.listen("7/map/T/H", kept(0))
            one, _ = b.listen("7/map/T/H", kept(1))
            await b.told_to(a)
            await a.until(lambda: one.samples, "the history has come")
            keeping.put(b"3", b"")
            await a.until(lambda: 3 in plain.numbers and 3 in one.numbers, "the new sample has come")

            assert plain.numbers == [3]
            assert one.numbers == [2, 3]
