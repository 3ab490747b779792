"""The queues of outlets and subscriptions: what waits, what is dropped, who is held back."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import Any

import pytest
import zenoh

from actors.transport.keyed.protocol import Delivery, Sample, TakesTogether
from actors.transport.protocol import PATIENCE
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker
from actors.transport.zenoh.outlets import Outlet, Publishers
from actors.transport.zenoh.subscriptions import Subscription
from actors.transport.zenoh.traffic import Traffic
from tests.actors.transport.zenoh.fakes import FakePublisher, FakeSample, sample

LARGE = bytes(64 * 1024)
RELIABLE = Delivery(reliable=True, keep_all=True)


class Sender:
    """An outlet whose worker waits until it may go."""

    def __init__(self, delivery: Delivery, *, matching: bool = True) -> None:
        self.publisher = FakePublisher(matching)
        self.traffic = Traffic()
        self.worker = Worker("test")
        self.told: list[bool] = []
        self.forgotten: list[Outlet] = []
        self.soon: list[Callable[[], None]] = []
        self._go = threading.Event()
        self.wakeup = Wakeup(asyncio.get_running_loop())
        self.outlet = Outlet(
            delivery,
            Publishers(self.publisher, self.publisher, delivery.keep_all or bool(delivery.history)),
            self.wakeup,
            self.worker,
            self.traffic,
            lambda outlet: self.told.append(outlet.wanted),
            self.soon.append,
            self.forgotten.append,
        )
        self.worker.do(lambda: self._go.wait() and None)

    def put(self, *payloads: bytes) -> None:
        for payload in payloads:
            self.outlet.put(payload, b"")

    async def finish(self) -> list[bytes]:
        """Let the worker go, and see what was put."""
        self._go.set()
        await self.worker.result(lambda: None)
        return self.publisher.payloads

    def match(self, matching: bool) -> None:
        """Zenoh tells that somebody, or nobody, listens."""
        self.publisher.handler(FakePublisher(matching))


@pytest.fixture(autouse=True)
def plain_handlers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Handlers that a test can call."""
    monkeypatch.setattr("actors.transport.zenoh.outlets.direct", lambda call: call)


async def test_a_small_sample_is_put_at_once_and_a_large_one_by_the_worker() -> None:
    one = Sender(Delivery(depth=10))

    one.put(b"small")
    assert one.publisher.payloads == [b"small"]
    one.put(LARGE, b"behind")
    assert one.publisher.payloads == [b"small"]

    assert await one.finish() == [b"small", LARGE, b"behind"]
    one.put(b"again at once")
    assert one.publisher.payloads[-1] == b"again at once"
    assert one.traffic.sent == len(b"small" + LARGE + b"behind" + b"again at once")


async def test_a_sample_that_may_not_be_dropped_is_put_by_the_worker_if_somebody_listens() -> None:
    wanted, unwanted = Sender(RELIABLE), Sender(RELIABLE, matching=False)

    wanted.put(b"1")
    unwanted.put(b"1")
    assert (wanted.publisher.payloads, unwanted.publisher.payloads) == ([], [b"1"])

    assert await wanted.finish() == [b"1"]
    assert unwanted.traffic.sent == 0


async def test_a_sample_waits_for_a_reader_of_which_the_loop_has_yet_to_be_told_in_the_worker_too() -> None:
    one = Sender(RELIABLE, matching=False)
    one.publisher.matching = True  # Zenoh knows, and what it has posted to the loop waits

    one.put(b"1")
    assert (one.outlet.wanted, one.publisher.payloads) == (False, [])

    assert await one.finish() == [b"1"]


async def test_the_oldest_of_too_many_waiting_samples_are_dropped_and_counted() -> None:
    one = Sender(Delivery(depth=2))

    one.put(LARGE + b"1", LARGE + b"2", LARGE + b"3", b"4")

    assert await one.finish() == [LARGE + b"3", b"4"]
    assert one.traffic.unsent == 2
    one.put(b"5")
    assert one.publisher.payloads[-1] == b"5"


async def test_what_may_not_be_dropped_is_dropped_when_64_megabytes_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.transport.zenoh.outlets.KEEP_ALL", 100)
    one = Sender(RELIABLE)

    one.put(bytes(60), bytes(60), b"too much")

    assert await one.finish() == [bytes(60), bytes(60)]
    assert one.traffic.unsent == 1
    one.put(b"room again")
    assert (await one.finish())[-1] == b"room again"


async def test_what_zenoh_refuses_is_counted() -> None:
    one = Sender(Delivery())
    one.publisher.refusal = zenoh.ZError("closed")
    one.put(b"1", LARGE)
    await one.finish()

    assert one.traffic.unsent == 2


async def test_it_tells_when_somebody_listens_at_once_and_when_nobody_does_afterwards() -> None:
    one = Sender(Delivery(), matching=False)

    one.match(True)
    one.match(True)
    assert one.told == []
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert one.told == [True]
    one.match(False)
    await asyncio.sleep(0.01)
    assert one.told == [True]
    assert one.outlet.wanted
    one.soon.pop()()

    assert one.told == [True, False]
    assert not one.outlet.wanted


async def test_who_comes_back_in_the_meantime_was_never_away() -> None:
    one = Sender(Delivery())

    one.match(False)
    one.match(True)
    await asyncio.sleep(0.01)
    one.soon.pop()()

    assert one.told == []


async def test_a_closed_outlet_sends_what_waits_and_nothing_more() -> None:
    one = Sender(Delivery(depth=10))
    one.put(LARGE)

    one.outlet.close()
    one.outlet.close()
    one.put(b"late")
    one.match(False)
    await asyncio.sleep(0.01)
    one.soon.pop()()

    assert await one.finish() == [LARGE]
    assert one.publisher.undeclared == 1
    assert one.forgotten == [one.outlet]
    assert one.told == []


async def test_who_can_wait_waits_until_what_may_not_be_dropped_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.transport.zenoh.outlets.FULL", 100)
    one, other = Sender(RELIABLE), Sender(Delivery(depth=10))
    one.put(bytes(60))
    assert one.outlet.drained is None
    one.put(bytes(60))
    other.put(LARGE, LARGE)
    assert other.outlet.drained is None, "it drops"
    drained = one.outlet.drained
    assert drained is not None
    waiting = asyncio.ensure_future(drained())
    await asyncio.sleep(0.01)
    assert not waiting.done()
    await one.finish()
    await waiting
    assert one.outlet.drained is None
    await other.finish()


class Receiver:
    """A subscription, and what it gets: after each sample it has no room for the next one until `room` is set, if that is cleared."""

    def __init__(self, delivery: Delivery) -> None:
        self.got: list[Sample] = []
        self.closes = False
        self.room = asyncio.Event()
        self.room.set()
        self.traffic = Traffic()
        self.declared = FakePublisher()
        self.subscription = Subscription(
            "own",
            "7/chatter/T/H",
            delivery,
            self if isinstance(self, TakesTogether) else self.take,
            Wakeup(asyncio.get_running_loop()),
            self.traffic,
            lambda _: self.declared,
            lambda _, source: None,
            lambda _: None,
        )

    def take(self, sample: Sample) -> Any:
        self.got.append(sample)
        if self.closes:
            self.subscription.close()
        return None if self.room.is_set() else self.room.wait

    def arrive(self, *samples: FakeSample) -> None:
        """Samples arrive on this thread."""
        for one in samples:
            self.subscription.arrived(one)

    async def until(self, number: int) -> list[bytes]:
        while len(self.got) < number:
            await asyncio.sleep(0.001)
        return [one.payload for one in self.got]

    def dropped(self, session: str) -> int:
        self.traffic.begin("unused")
        return self.traffic.report({session: None})[0].dropped


async def test_a_full_queue_drops_the_oldest_and_counts_them_by_their_sender() -> None:
    one = Receiver(Delivery(depth=2))
    one.traffic.begin("a1")

    one.arrive(*(sample(b"%d" % number, sender="a1") for number in range(7)))

    assert await one.until(4) == [b"3", b"4", b"5", b"6"]
    await asyncio.sleep(0.01)
    assert len(one.got) == 4
    assert one.dropped("a1") == 3


class Together(Receiver):
    """One that takes samples together, too; `refuses` those of a payload."""

    def __init__(self, delivery: Delivery, refuses: bytes = b"none") -> None:
        self.refuses = refuses
        self.pieces: list[list[bytes]] = []
        self.received: list[bytes] = []
        super().__init__(delivery)

    def __call__(self, sample: Sample) -> Any:
        self.received.append(sample.payload)
        return super().take(sample)

    def together(self, payloads: list[bytes], attachments: list[bytes]) -> bool:
        if self.refuses in payloads:
            return False
        self.pieces.append(payloads)
        self.received += payloads
        return True

    async def all(self, number: int) -> list[bytes]:
        while len(self.received) < number:
            await asyncio.sleep(0.001)
        return self.received


def attached(number: int, sender: bytes = b"a", payload: bytes = b"") -> FakeSample:
    attachment = number.to_bytes(16, "little") + b"\x10" + 16 * sender
    return sample(payload or b"%d" % number, attachment=attachment, sender=sender.decode())


async def test_samples_of_one_sender_that_came_while_the_loop_was_busy_are_passed_on_together() -> None:
    one = Together(Delivery(depth=500))
    one.traffic.begin("a")
    one.arrive(*(attached(number) for number in range(300)))

    assert await one.all(300) == [b"%d" % number for number in range(300)]
    assert len(one.pieces) >= 4
    assert max(map(len, one.pieces)) == 64
    assert one.traffic.report({"a": None})[0].received_bytes == sum(map(len, one.received))


async def test_samples_of_several_senders_and_those_that_are_refused_are_passed_on_one_by_one() -> None:
    one = Together(Delivery(depth=500), refuses=b"20")
    for sender in "ab":
        one.traffic.begin(sender)
    one.arrive(*(attached(number, b"ab"[number % 2 :][:1]) for number in range(20)))
    one.arrive(*(attached(number) for number in range(20, 40)))
    one.arrive(sample(b"bare"), sample(b"bare"))

    assert await one.all(42) == [b"%d" % number for number in range(40)] + [b"bare", b"bare"]
    links = one.traffic.report({"a": None, "b": None})
    assert sum(link.received_bytes for link in links) == sum(len(b"%d" % number) for number in range(40))


async def test_a_subscription_that_is_closed_by_the_first_of_several_takes_no_more_of_them() -> None:
    one = Together(Delivery(depth=500), refuses=b"2")
    one.arrive(*(attached(number) for number in range(1, 5)))
    one.closes = True
    await one.all(1)
    await asyncio.sleep(0.01)
    assert one.received == [b"1"]
    one = Together(Delivery(depth=500), refuses=b"2")
    close, calls = one.subscription.close, list[bytes]()

    def closing(sample: Sample) -> None:
        calls.append(sample.payload)
        if len(calls) == 2:
            close()

    one.subscription._take = closing
    one.arrive(*(attached(number) for number in range(1, 5)))
    while len(calls) < 2:
        await asyncio.sleep(0.001)
    await asyncio.sleep(0.01)
    assert calls == [b"1", b"2"]


async def test_large_samples_are_passed_on_one_by_one_and_others_as_many_as_make_a_large_one() -> None:
    one = Together(Delivery(depth=500))
    one.arrive(*(attached(number, payload=LARGE) for number in range(3)))
    assert await one.all(3) == [LARGE] * 3
    assert one.pieces == []
    one.arrive(*(attached(number, payload=bytes(20_000)) for number in range(10)))
    await one.all(13)
    assert {len(piece) for piece in one.pieces} <= {2, 3}
    assert one.pieces


async def test_a_queue_has_room_for_the_history() -> None:
    one = Receiver(Delivery(depth=1, history=5))

    one.arrive(*(sample(b"%d" % number) for number in range(7)))

    assert len(await one.until(7)) == 7


async def test_samples_of_a_patient_subscription_tell_when_they_arrived() -> None:
    one, loop = Receiver(Delivery(depth=10, patience=PATIENCE)), asyncio.get_running_loop()
    before = loop.time()
    one.arrive(sample(b"1"), sample(b"2"))
    after = loop.time()

    assert await one.until(2) == [b"1", b"2"]
    assert all(got.since is not None and before <= got.since <= after for got in one.got)
    assert loop.time() > after
    one.subscription.close()


async def test_history_is_not_waited_for() -> None:
    one = Receiver(Delivery(depth=10, history=5, patience=PATIENCE))
    one.arrive(sample(b"1"))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert [got.since for got in one.got] == [None]


async def test_a_full_queue_that_keeps_all_holds_the_sender_back_until_there_is_room() -> None:
    one, before = Receiver(RELIABLE), asyncio.get_running_loop().time()
    thread = threading.Thread(target=lambda: one.arrive(*(sample(b"%d" % number) for number in range(1500))))
    thread.start()

    assert await one.until(1500) == [b"%d" % number for number in range(1500)]
    thread.join()
    assert Subscription.held_back >= before


async def test_a_reader_without_room_gets_the_next_sample_when_it_has_some() -> None:
    one = Receiver(RELIABLE)
    one.room.clear()
    one.arrive(sample(b"1"), sample(b"2"), sample(b"3"))
    await asyncio.sleep(0.01)
    one.arrive(sample(b"4"))
    await asyncio.sleep(0.01)
    assert [each.payload for each in one.got] == [b"1"]
    one.room.set()
    assert await one.until(4) == [b"1", b"2", b"3", b"4"]


async def test_a_subscription_that_is_closed_while_it_takes_takes_no_more() -> None:
    one = Receiver(Delivery(depth=10))
    one.closes = True
    one.arrive(sample(b"1"), sample(b"2"), sample(b"3"))
    await asyncio.sleep(0.01)
    assert [each.payload for each in one.got] == [b"1"]


async def test_who_may_lose_samples_waits_for_none() -> None:
    one = Receiver(Delivery(depth=10))
    one.room.clear()
    one.arrive(sample(b"1"), sample(b"2"))
    assert await one.until(2) == [b"1", b"2"]


async def test_a_subscription_that_is_closed_while_it_waits_for_room_leaves_no_task() -> None:
    one = Receiver(RELIABLE)
    one.room.clear()
    one.arrive(sample(b"1"), sample(b"2"))
    await one.until(1)
    one.subscription.close()
    one.room.set()
    await asyncio.sleep(0.01)
    assert [each.payload for each in one.got] == [b"1"]
    assert len(asyncio.all_tasks()) == 1


async def test_a_loop_that_hangs_holds_the_sender_back_once(monkeypatch: pytest.MonkeyPatch) -> None:
    # An odd number of seconds: by it the waits that are meant are told from those of other threads.
    patience, waits, wait = 0.0502, list[float | None](), threading.Event.wait
    monkeypatch.setattr("actors.transport.zenoh.subscriptions._PATIENCE", patience)

    def counted(event: threading.Event, timeout: float | None = None) -> bool:
        waits.append(timeout)
        return wait(event, timeout)

    monkeypatch.setattr(threading.Event, "wait", counted)
    one = Receiver(RELIABLE)
    thread = threading.Thread(target=lambda: one.arrive(*(sample(b"%d" % number) for number in range(1100))))
    thread.start()
    thread.join()  # this loop does not run meanwhile

    assert waits.count(patience) == 1
    assert len(await one.until(1100)) == 1100


async def test_a_reader_that_hangs_for_long_loses_the_oldest_samples_and_they_are_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("actors.transport.zenoh.subscriptions._PATIENCE", 0.001)
    monkeypatch.setattr("actors.transport.zenoh.subscriptions._BEYOND", 10 * 1001)
    one = Receiver(RELIABLE)
    one.traffic.begin("a1")
    for _ in range(2):
        thread = threading.Thread(target=lambda: one.arrive(*(sample(b"x", sender="a1") for _ in range(1015))))
        thread.start()
        thread.join()  # this loop does not run meanwhile
        await one.until(1010)
        one.got.clear()
    assert one.dropped("a1") == 2 * 5


async def test_a_closed_subscription_takes_nothing_and_holds_nobody_back() -> None:
    one = Receiver(RELIABLE)
    one.arrive(*(sample(b"%d" % number) for number in range(1000)))
    thread = threading.Thread(target=lambda: one.arrive(sample(b"held back")))
    thread.start()

    one.subscription.close()
    one.subscription.close()
    thread.join()
    one.arrive(sample(b"late"))
    await asyncio.sleep(0.01)

    assert one.got == []
    assert one.declared.undeclared == 1


async def test_an_oldest_sample_that_the_loop_has_just_taken_is_not_counted_as_lost() -> None:
    one = Receiver(Delivery(depth=0, history=0))

    one.arrive(sample(b"1", sender="a1"))

    assert await one.until(1) == [b"1"]
    one.traffic.begin("a1")
    assert one.dropped("a1") == 0


def test_received_bytes_are_counted_by_sender_and_known_senders_by_their_gid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.transport.zenoh.traffic._KNOWN", 1)
    traffic = Traffic()
    traffic.begin("a1")
    attachment, other = bytes(17) + b"g" * 16, bytes(17) + b"h" * 16
    first: Any = sample(b"", attachment=attachment, sender="a1")
    nobody: Any = sample(b"", attachment=attachment)

    traffic.received(first, attachment, 10)
    traffic.received(nobody, attachment, 20)
    traffic.received(nobody, other, 40)
    traffic.received(nobody, attachment, 80)
    traffic.received(first, b"", 160)

    assert traffic.report({"a1": None})[0].received_bytes == 10 + 20 + 160
    traffic.begin("a1")
    assert traffic.report({"a1": None})[0].received_bytes == 0


def test_sessions_that_anybody_names_and_links_that_have_gone_are_not_kept() -> None:
    traffic = Traffic()

    def kept() -> int:
        return sum(len(one) for one in vars(traffic).values() if isinstance(one, dict))

    traffic.begin("a1")
    before = kept()
    for number in range(100):
        session = f"b{number}"
        traffic.received(sample(b"", sender=session), b"", 10)
        traffic.lost(sample(b"", sender=session))
        traffic.begin(session)
        traffic.received(sample(b"", sender=session), b"%33d" % number, 10)
        traffic.lost(sample(b"", sender=session))
        (link,) = traffic.report({session: None})
        assert (link.received_bytes, link.dropped) == (10, 1)
        traffic.end(session)
    assert kept() == before


async def test_a_reader_that_leaves_while_an_outlet_is_opened_is_not_taken_for_one_that_is_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Zenoh tells a listener of changes only: one between the question and the listener would go unnoticed."""

    def declare(publisher: FakePublisher, handler: Any) -> FakePublisher:
        publisher.matching = False
        return FakePublisher()

    monkeypatch.setattr(FakePublisher, "declare_matching_listener", declare)
    assert not Sender(Delivery()).outlet.wanted
