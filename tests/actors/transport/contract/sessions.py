"""The contract of sessions, tokens and reports."""

from __future__ import annotations

from tests.actors.transport.contract.parties import Happened, Wire, parties, token


class SessionContract:
    """Transports find each other, and show their tokens."""

    async def test_transports_find_each_other_once(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            await a.told_to(b, c)
            await b.told_to(a, c)
            await c.told_to(a, b)

            assert sorted(a.told("up", "down")) == sorted([Happened("up", b.session), Happened("up", c.session)])
            assert sorted(c.told("up", "down")) == sorted([Happened("up", a.session), Happened("up", b.session)])

    async def test_a_session_is_a_hexadecimal_number_of_its_own_and_known_before_open(self, wire: Wire) -> None:
        one, other = wire.transport(), wire.transport()

        assert one.session != other.session
        assert f"{int(one.session, 16):x}" == one.session
        assert len(one.session) <= 32

    async def test_a_token_appears_to_the_others_and_vanishes_when_it_is_withdrawn(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            handle = a.transport.announce(token("talker"))
            await a.told_to(b, c)
            handle.close()
            await a.told_to(b, c)

            for other in (b, c):
                mine = [one.kind for one in other.log if one.of == token("talker")]
                assert mine == ["appeared", "vanished"]

    async def test_a_token_of_its_own_does_not_appear_to_a_transport(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            a.transport.announce(token("talker"))
            await a.told_to(b)
            await b.told_to(a)

            assert not a.has("appeared", token("talker"))

    async def test_tokens_of_before_appear_to_one_that_opens_later(self, wire: Wire) -> None:
        async with parties(wire, 1) as (a,):
            gone = a.transport.announce(token("gone"))
            a.transport.announce(token("talker"))
            gone.close()

            async with parties(wire, 1) as (late,):
                await late.until(lambda: late.has("appeared", token("talker")), "the token appears")
                await a.until(lambda: a.is_linked(late.session), "the older one has found the newer one")

                assert not late.has("appeared", token("gone"))

    async def test_tokens_that_are_not_watched_for_are_not_told(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            for text in ("@ros2_lv/8/talker", "ros2_lv/7/talker", "@ros2_lv/77/talker", token("one/two/three")):
                a.transport.announce(text)
            await a.told_to(b)

            assert [one.of for one in b.told("appeared")][:-1] == [token("one/two/three")]

    async def test_a_token_may_live_again_and_closing_twice_is_harmless(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            for _ in range(2):
                handle = a.transport.announce(token("talker"))
                await a.told_to(b)
                handle.close()
                handle.close()
                await a.told_to(b)

            mine = [one.kind for one in b.log if one.of == token("talker")]
            assert mine == ["appeared", "vanished"] * 2

    async def test_when_a_transport_closes_the_others_hear_of_the_link_first_and_of_its_tokens_then(
        self, wire: Wire
    ) -> None:
        async with parties(wire, 2) as (a, b):
            for name in ("one", "two"):
                a.transport.announce(token(name))
            await a.told_to(b)
            before = len(b.log)

            await a.transport.close()
            await b.until(lambda: len(b.log) == before + 4, "the link and three tokens are gone")

            assert b.log[before] == Happened("down", a.session)
            assert {one.kind for one in b.log[before + 1 :]} == {"vanished"}
            assert {token("one"), token("two")} < {one.of for one in b.log[before + 1 :]}

    async def test_a_closed_transport_tells_nothing_any_more(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            heard, _ = a.listen("7/chatter/T/H")
            _, _ = c.listen("7/chatter/T/H")
            asked = a.serve("7/add/T/H")
            outlet = await b.outlet("7/chatter/T/H")
            b.serve("7/sub/T/H")
            await b.told_to(a, c)
            answers, _ = a.ask("7/sub/T/H")
            before = list(a.log)

            await a.transport.close()
            outlet.put(b"late", b"")
            await b.told_to(c)

            assert (heard.samples, asked, answers) == ([], [], [])
            assert a.log == before

    async def test_a_transport_can_be_closed_twice_and_before_it_was_opened(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            await a.transport.close()
            await a.transport.close()
            await wire.transport().close()

            await b.until(lambda: not b.is_linked(a.session), "the link is gone")
            assert [one.kind for one in b.told("up", "down")] == ["up", "down"]

    async def test_the_report_names_who_is_connected_and_what_was_exchanged(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            heard, _ = b.listen("7/image/T/H")
            outlet = await a.outlet("7/image/T/H")
            outlet.put(bytes(10_000), b"")
            await a.until(lambda: heard.samples, "it has arrived")

            sent = {link.session: link for link in a.transport.report()}
            received = {link.session: link for link in b.transport.report()}
            assert set(sent) == {b.session, c.session}
            assert sent[b.session].sent_bytes >= 10_000
            assert received[a.session].received_bytes >= 10_000
            assert received[a.session].dropped == 0

            await c.transport.close()
            await a.until(lambda: not a.is_linked(c.session), "one has left")
            assert {link.session for link in a.transport.report()} == {b.session}
