"""A process whose loop hangs is noticed, but not by a loop that hung itself."""

from __future__ import annotations

from asyncio import AbstractEventLoop
from collections.abc import Callable
from typing import Any, cast

import pytest

from actors.transport.zenoh.heartbeat import Heartbeat


class Clock:
    """As much of a loop as a heartbeat uses: one timer, moved by hand."""

    def __init__(self) -> None:
        self.now = 100.0
        self.timer: tuple[float, Callable[[], None]] | None = None

    def time(self) -> float:
        return self.now

    def call_soon(self, call: Callable[[], None]) -> Clock:
        return self.call_at(self.now, call)

    def call_at(self, when: float, call: Callable[[], None]) -> Clock:
        self.timer = when, call
        return self

    def cancel(self) -> None:
        self.timer = None

    def run(self, seconds: float, each: Callable[[], Any] = lambda: None) -> None:
        """Let the time pass, tick by tick."""
        end = self.now + seconds
        while self.timer is not None and self.timer[0] <= end:
            when, call = self.timer
            self.now = max(when, self.now)
            call()
            each()
        self.now = end


class Watched:
    def __init__(self) -> None:
        self.clock = Clock()
        self.beats = 0
        self.failure: Exception | None = None
        self.deaf = 0.0
        self.others = ["a1", "b2"]
        self.silent: list[tuple[float, str]] = []
        self.heartbeat = Heartbeat(
            cast("AbstractEventLoop", self.clock),
            self.beat,
            lambda: self.others,
            lambda session: self.silent.append((self.clock.now - 100, session)),
            lambda: self.deaf,
        )

    def beat(self) -> None:
        self.beats += 1
        if self.failure is not None:
            raise self.failure


def test_it_beats_twice_a_second_until_it_is_closed() -> None:
    one = Watched()
    one.others = []

    one.clock.run(10.0)
    assert one.beats == 21
    one.heartbeat.close()
    one.clock.run(10.0)
    assert one.beats == 21


def test_it_goes_on_after_a_beat_that_raised() -> None:
    """What a beat makes, such as calls that wait, may fail; the others must not lose this process for that."""
    one = Watched()
    one.failure = ValueError("in a callback")
    with pytest.raises(ValueError, match="in a callback"):
        one.clock.run(1.0)

    one.failure = None
    one.clock.run(3.0)
    assert (one.beats, [session for _, session in one.silent]) == (7, ["a1", "b2"])


def test_who_is_not_heard_for_two_seconds_is_silent() -> None:
    one = Watched()

    one.clock.run(2.4, each=lambda: one.heartbeat.heard("b2", one.clock.now))
    assert one.silent == []
    one.clock.run(0.1)

    assert one.silent == [(2.5, "a1")]


def test_who_comes_later_has_its_time() -> None:
    one = Watched()
    one.others = []
    one.clock.run(10.0)

    one.others = ["a1"]
    one.clock.run(2.4)
    assert one.silent == []


def test_after_this_loop_hung_the_others_have_their_time_again() -> None:
    one = Watched()
    one.clock.run(1.0)

    one.clock.now += 5.0
    one.clock.run(2.0)
    assert one.silent == []
    one.clock.run(1.0)
    assert {session for _, session in one.silent} == {"a1", "b2"}


def test_nobody_is_silent_whose_beats_may_be_stuck_behind_samples_that_a_full_subscription_holds_back() -> None:
    one = Watched()

    def hold() -> None:
        one.deaf = one.clock.now

    one.clock.run(10.0, each=hold)
    one.clock.run(2.0)
    assert one.silent == []
    one.clock.run(0.5)
    assert {session for _, session in one.silent} == {"a1", "b2"}
