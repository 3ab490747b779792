"""The contract of questions."""

from __future__ import annotations

from actors.transport.keyed.protocol import Query, Replied
from actors.transport.protocol import Failed, NoAnswer
from tests.actors.transport.contract.parties import Wire, parties


class QuestionContract:
    """A question ends exactly once."""

    async def test_a_question_is_answered(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            queries = b.serve("7/add/T/H", lambda query: query.reply(query.payload + b"!", b"answered"))
            await b.told_to(a)

            assert await a.answer("7/add/T/H", b"1+1") == Replied(b"1+1!", b"answered")
            assert [(query.payload, query.attachment) for query in queries] == [(b"1+1", b"asked")]

    async def test_questions_that_are_expected_are_answered_as_all_others(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            prepared = a.transport.prepare("7/add/T/H")
            assert await a.answer("7/add/T/H") == NoAnswer(timed_out=False)
            b.serve("7/add/T/H", lambda query: query.reply(query.payload, b""))
            await b.told_to(a)

            assert await a.answer("7/add/T/H", b"1") == Replied(b"1", b"")
            prepared.close()
            prepared.close()
            assert await a.answer("7/add/T/H", b"2") == Replied(b"2", b"")

    async def test_a_question_is_answered_with_an_error(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            b.serve("7/add/T/H", lambda query: query.fail(b"no"))
            await b.told_to(a)

            assert await a.answer("7/add/T/H") == Failed(b"no")

    async def test_a_question_that_is_dropped_ends_without_answer(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            b.serve("7/add/T/H", lambda query: query.drop())
            await b.told_to(a)

            assert await a.answer("7/add/T/H") == NoAnswer(timed_out=False)

    async def test_a_question_that_nobody_serves_ends_without_answer(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            gone = b.transport.serve("7/gone/T/H", lambda query: query.reply(b"", b""))
            b.serve("7/add/T/H/more")
            await b.told_to(a)
            gone.close()
            await b.told_to(a)

            assert await a.answer("7/add/T/H") == NoAnswer(timed_out=False)
            assert await a.answer("7/gone/T/H") == NoAnswer(timed_out=False)

    async def test_a_question_ends_when_its_time_is_over(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            queries = b.serve("7/add/T/H")
            await b.told_to(a)

            assert await a.answer("7/add/T/H", timeout=0.2) == NoAnswer(timed_out=True)
            for query in queries:
                query.reply(b"too late", b"")
            await b.told_to(a)
            assert len(a.told("answered")) == 1

    async def test_a_question_that_was_given_up_is_not_told_of(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            queries = b.serve("7/add/T/H")
            await b.told_to(a)
            answers, handle = a.ask("7/add/T/H", b"given up", timeout=60.0)
            kept_answers, _ = a.ask("7/add/T/H", b"kept", timeout=60.0)
            await a.until(lambda: len(queries) == 2, "both questions have arrived")

            handle.close()
            handle.close()
            for query in queries:
                query.reply(query.payload, b"")
            await a.until(lambda: kept_answers, "the other question is answered")

            assert kept_answers == [Replied(b"kept", b"")]
            assert answers == []

    async def test_the_first_answer_counts(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            queries = [*[party.serve("7/add/T/H") for party in (b, c)]]
            await b.told_to(a)
            await c.told_to(a)
            answers, _ = a.ask("7/add/T/H")
            await a.until(lambda: any(queries), "somebody is asked")

            for query in (query for asked in queries for query in asked):
                query.reply(b"mine", b"")
                query.reply(b"again", b"")
                query.fail(b"again")
                query.drop()
            await a.until(lambda: answers, "it is answered")
            await b.told_to(a)
            await c.told_to(a)

            assert answers == [Replied(b"mine", b"")]

    async def test_a_question_that_one_leaves_is_answered_by_another(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            left = b.serve("7/add/T/H", lambda query: query.drop())
            asked = c.serve("7/add/T/H")
            await b.told_to(a)
            await c.told_to(a)
            answers, _ = a.ask("7/add/T/H")
            await a.until(lambda: left and asked, "both are asked")
            await b.told_to(a)

            assert answers == []
            asked[0].reply(b"mine", b"")
            await a.until(lambda: answers, "it is answered")
            assert answers == [Replied(b"mine", b"")]

    async def test_many_questions_are_each_answered_with_their_own_answer(self, wire: Wire) -> None:
        async with parties(wire, 3) as (a, b, c):
            for party in (a, b):
                party.serve(f"7/{party.session}/T/H", lambda query: query.reply(query.payload[::-1], b""))
                await party.told_to(c)

            asked = [
                (party, b"%d" % number, c.ask(f"7/{party.session}/T/H", b"%d" % number)[0])
                for number in range(100)
                for party in (a, b)
            ]
            await c.until(lambda: all(answers for _, _, answers in asked), "all are answered")

            assert [answers for _, _, answers in asked] == [[Replied(payload[::-1], b"")] for _, payload, _ in asked]

    async def test_a_question_ends_when_who_was_asked_closes(self, wire: Wire) -> None:
        async with parties(wire, 2) as (a, b):
            queries: list[Query] = b.serve("7/add/T/H")
            await b.told_to(a)
            answers, _ = a.ask("7/add/T/H", timeout=None)
            await a.until(lambda: queries, "it is asked")

            await b.transport.close()
            await a.until(lambda: answers, "the question ends")

            assert answers == [NoAnswer(timed_out=False)]
