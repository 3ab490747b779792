"""The first contact with a publisher that keeps samples."""

from __future__ import annotations

import pytest

from actors.transport.zenoh.contact import Contacts, Source
from tests.actors.transport.zenoh.fakes import FakeReply, FakeSample, numbered, sample


class Reader:
    """A subscription that writes down what it gets, and whom it asks."""

    def __init__(self) -> None:
        self.got: list[bytes] = []
        self.asked: list[Source] = []
        self.contacts = Contacts("own", self.asked.append, lambda one: self.got.append(one.payload.to_bytes()))

    def take(self, *samples: FakeSample) -> None:
        for one in samples:
            self.contacts.take(one)


def test_a_publisher_heard_from_its_first_sample_on_is_not_asked() -> None:
    reader = Reader()

    reader.take(numbered(0), numbered(1), numbered(1), numbered(3), numbered(2))

    assert reader.got == [b"0", b"1", b"3"]
    assert reader.asked == []


def test_what_was_kept_comes_before_what_made_the_contact() -> None:
    reader = Reader()

    reader.take(numbered(7), numbered(8))
    assert reader.got == []
    for number in (5, 6, 7):
        reader.contacts.answered(("a1", 1), FakeReply(numbered(number)))
    reader.contacts.complete(("a1", 1))
    reader.take(numbered(8), numbered(9))

    assert reader.asked == [("a1", 1)]
    assert reader.got == [b"5", b"6", b"7", b"8", b"9"]


def test_each_publisher_is_asked_for_itself() -> None:
    reader = Reader()

    reader.take(numbered(3, publisher=1), numbered(4, publisher=2))
    reader.contacts.complete(("a1", 2))
    reader.take(numbered(5, publisher=2))

    assert reader.asked == [("a1", 1), ("a1", 2)]
    assert reader.got == [b"4", b"5"]


def test_late_answers_and_answers_without_a_number_are_not_taken() -> None:
    reader = Reader()

    reader.take(numbered(3))
    reader.contacts.answered(("a1", 1), FakeReply(sample(b"no number")))
    reader.contacts.answered(("a1", 1), FakeReply(None))
    reader.contacts.complete(("a1", 1))
    reader.contacts.answered(("a1", 1), FakeReply(numbered(2)))
    reader.contacts.complete(("a1", 1))

    assert reader.got == [b"3"]


def test_samples_without_a_number_pass() -> None:
    reader = Reader()

    reader.take(sample(b"one"), sample(b"one", sender="a1"))

    assert reader.got == [b"one", b"one"]


def test_numbers_start_again_after_32_bits() -> None:
    reader = Reader()
    reader.take(numbered(2**32 - 1))
    reader.contacts.complete(("a1", 1))

    reader.take(numbered(0), numbered(1), numbered(2**32 - 1))

    assert reader.got == [b"%d" % (2**32 - 1), b"0", b"1"]


def test_the_publishers_heard_of_longest_ago_are_forgotten() -> None:
    reader = Reader()
    for publisher in range(1001):
        reader.take(numbered(0, publisher=publisher))

    reader.take(numbered(0, publisher=1000), numbered(0, publisher=0))

    assert len(reader.got) == 1002


def test_what_this_session_keeps_itself_does_not_come_back() -> None:
    reader = Reader()
    own = numbered(3)
    assert own.source_info is not None
    own.source_info.source_id.zid = "own"

    reader.take(sample(b"one", sender="own"), own)

    assert reader.got == []
    assert reader.asked == []


def test_no_more_samples_wait_for_what_is_kept_than_a_process_can_bear(monkeypatch: pytest.MonkeyPatch) -> None:
    """A publisher that never answers, or thousands of them, would else fill the memory for as long as they are asked."""
    monkeypatch.setattr("actors.transport.zenoh.contact._MOST_HELD", 3)
    reader = Reader()

    reader.take(numbered(5), numbered(5), numbered(6), numbered(7))
    assert (reader.got, reader.asked) == ([], [("a1", 1)])
    reader.take(numbered(9, publisher=2))
    assert reader.got == [b"9"]
    reader.contacts.answered(("a1", 1), FakeReply(numbered(4)))
    assert reader.got == [b"9", b"4", b"5", b"6", b"7"]

    reader.contacts.complete(("a1", 1))
    reader.take(numbered(8), numbered(10, publisher=2), numbered(3, publisher=3))
    assert reader.got == [b"9", b"4", b"5", b"6", b"7", b"8", b"10"]
    assert reader.asked == [("a1", 1), ("a1", 3)]
