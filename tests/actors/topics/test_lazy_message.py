"""Messages that may be passed on without being read."""

from __future__ import annotations

import pytest

from actors.interfaces import CdrError, encode
from actors.topics.lazy_message import LazyMessage
from tests.stage import number, word


def test_a_message_of_this_process_is_encoded_when_somebody_asks_and_once() -> None:
    arrival = LazyMessage(number(7))
    assert (arrival.sent_ns, arrival.size) == (None, None)
    cdr = arrival.cdr
    assert cdr == encode(number(7))
    assert arrival.cdr is cdr
    assert arrival.size == len(cdr)


def test_a_message_of_another_process_is_decoded_when_somebody_asks_and_once() -> None:
    cdr = encode(number(7))
    arrival = LazyMessage.received(cdr, type(number(0)), 12)
    assert (arrival.cdr, arrival.size, arrival.sent_ns) == (cdr, len(cdr), 12)
    message = arrival.message
    assert message == number(7)
    assert arrival.message is message


def test_what_is_no_message_can_be_passed_on_and_not_be_read() -> None:
    arrival = LazyMessage.received(b"\0\1\0\0", type(number(0)), 12)
    for _ in "ab":
        with pytest.raises(CdrError, match="end too early"):
            _ = arrival.message
    assert arrival.cdr == b"\0\1\0\0"


def test_a_text_that_no_wire_can_carry_cannot_be_encoded() -> None:
    with pytest.raises(CdrError, match=r"String\.data"):
        _ = LazyMessage(word("\ud800")).cdr
