"""The latch behind the safety monitor: when a stop begins, what holds it, and what ends it (F-08)."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from robot.control.stop_causes import StopLatch

KEYS = ("tilt", "request", "battery")
steps = st.lists(st.tuples(st.sampled_from(("begin", "end", "clear")), st.sampled_from(KEYS)), max_size=30)


def test_a_latched_cause_outlives_what_caused_it() -> None:
    latch = StopLatch()
    assert latch.begin("tilt", "it tilts")
    assert not latch.begin("tilt", "it tilts more")  # no news
    assert list(latch.reasons) == list(latch.present) == ["it tilts"]
    assert not latch.clear()
    latch.end("tilt")
    assert latch.stopped
    assert list(latch.reasons) == ["it tilts"]
    assert not latch.present
    assert latch.clear()
    assert repr(latch) == "<StopLatch clear>"


def test_a_cause_that_is_not_latched_ends_by_itself() -> None:
    latch = StopLatch()
    latch.begin("battery", "empty", latched=False)
    assert latch.end("battery")
    assert not latch.stopped
    assert not latch.end("battery")


def test_clearing_leaves_what_is_still_there() -> None:
    latch = StopLatch()
    latch.begin("tilt", "it tilts")
    latch.begin("request", "asked for")
    latch.end("request")
    assert not latch.clear()
    assert latch.reasons == ("it tilts",)
    assert repr(latch) == "<StopLatch it tilts>"


def test_a_new_latch_keeps_the_latched_causes_of_the_old_one() -> None:
    latch = StopLatch()
    latch.begin("request", "asked for")
    latch.begin("battery", "empty", latched=False)
    again = StopLatch(latch.kept)
    assert (again.stopped, again.reasons, again.present) == (True, ("asked for",), ())


@given(steps)
def test_whatever_happens_it_is_stopped_exactly_while_a_cause_is_there_or_uncleared(
    taken: list[tuple[str, str]],
) -> None:
    latch, present, held = StopLatch(), set[str](), set[str]()
    for what, key in taken:
        latched = key != "battery"
        if what == "begin":
            latch.begin(key, key, latched=latched)
            present.add(key)
            held.add(key)
        elif what == "end":
            latch.end(key)
            present.discard(key)
            if not latched:
                held.discard(key)
        else:
            latch.clear()
            held &= present
        assert set(latch.reasons) == held
        assert set(latch.present) == present
        assert latch.stopped is bool(held)
