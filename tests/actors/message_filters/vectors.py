"""What the filters of ROS 2 let through for given inputs: facts from the behaviour that the test suite of its library states.

An input is written ``0@3``: a message of input 0 with the stamp 3 s. A set is written ``0,1``: the stamps of its messages, in the order of the
inputs. A case says which sets come out, in which order, of messages that come in in the order written.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Case(NamedTuple):
    """Options of the filter, the messages that come in, and the sets that come out."""

    name: str
    options: dict[str, Any]
    messages: str
    out: str


ADAPTIVE = (
    Case("equal stamps", {"queue_size": 10}, "0@0 1@0 0@3 1@3 0@6 1@6", "0,0 3,3 6,6"),
    Case("a constant lag", {"queue_size": 10}, "0@0 1@1 0@3 1@4 0@6 1@7", "0,1 3,4"),
    Case("one message too many", {"queue_size": 10}, "0@0 1@1 0@2 0@3 1@5 0@6 1@7", "0,1 6,5"),
    Case("inputs that get faster", {"queue_size": 10}, "0@0 1@7 0@12 1@15 0@17 1@18", "12,7 17,18"),
    Case(
        "a queue of one, too short",
        {"queue_size": 1},
        "0@0 1@1 1@3 0@4 1@7 0@8 0@10 1@11 0@13 1@14",
        "4,3 10,11",
    ),
    Case(
        "a queue of two, just long enough",
        {"queue_size": 2},
        "0@0 1@1 1@3 0@4 1@7 0@8 0@10 1@11 0@13 1@14",
        "0,1 4,3 8,7 10,11",
    ),
    Case(
        "a queue of five and one fast input",
        {"queue_size": 5},
        "0@0 0@1 0@2 0@3 0@4 0@5 0@6 0@7 0@8 1@3 0@9 0@10 0@11 0@12 1@10 0@13",
        "10,10",
    ),
    Case("two sets at one arrival", {"queue_size": 10}, "0@0 1@1 1@3 0@3", "0,1 3,3"),
    Case(
        "four inputs",
        {"queue_size": 10},
        "0@0 1@1 2@2 3@3 0@5 3@5 1@6 2@6 0@8 1@9 2@10 3@11 0@10 0@13 1@14",
        "0,1,2,3 5,6,6,5 10,9,10,11",
    ),
    Case("four inputs, known early to be best", {"queue_size": 10}, "0@0 1@1 2@2 3@3 0@7", "0,1,2,3"),
    Case(
        "a lower bound of 1.5 s",
        {"queue_size": 10, "lower_bounds": {0: 1.5}},
        "0@0 1@1 0@3 1@4 0@6 1@7",
        "0,1 3,4",
    ),
    Case(
        "a lower bound of 2 s, enough to know at once",
        {"queue_size": 10, "lower_bounds": {0: 2.0}},
        "0@0 1@1 0@3 1@4 0@6 1@7",
        "0,1 3,4 6,7",
    ),
)
"""The adaptive algorithm, `ApproximateTime`."""

EXACT = (
    Case("pairs", {"queue_size": 1}, "0@0 1@0 0@1 1@1 0@2 1@2", "0,0 1,1 2,2"),
    Case("three inputs, one with an earlier message", {"queue_size": 2}, "0@0 1@0.1 0@0.1 2@0.1", "0.1,0.1,0.1"),
    Case("a queue of one forgets the earlier", {"queue_size": 1}, "0@0 1@0 1@0.1 1@0 2@0", ""),
    Case("all of one input first", {"queue_size": 5}, "0@2 0@0 0@4 0@1 0@3 1@3 1@0 1@4 1@1 1@2", "3,3 4,4"),
    Case("an older set after a newer one is dropped", {"queue_size": 10}, "0@1 0@2 1@2 1@1", "2,2"),
    Case("time that is set back", {"queue_size": 10}, "0@5 1@5 0@1 1@1", "5,5 1,1"),
    Case("what fell out of the queue has no set", {"queue_size": 2}, "0@0 0@1 0@2 1@0 1@1 1@2", "1,1 2,2"),
    Case("three inputs in any order", {"queue_size": 3}, "2@1 0@1 1@1 1@2 2@2 0@2", "1,1,1 2,2,2"),
    Case("nothing for stamps that only nearly agree", {"queue_size": 5}, "0@1 1@1.000001", ""),
    Case("the same stamp again has no partner left", {"queue_size": 5}, "0@1 1@1 1@1", "1,1"),
)
"""`TimeSynchronizer`."""

SLOP = (
    Case("equal stamps", {"queue_size": 1, "slop": 0.1}, "0@0 1@0 0@1 1@1 0@2 1@2", "0,0 1,1 2,2"),
    Case(
        "any order, queues long enough",
        {"queue_size": 4, "slop": 0.1},
        "0@2 0@0 0@3 0@1 1@1 1@3 1@0 1@2",
        "1,1 3,3 0,0 2,2",
    ),
    Case("within the slop", {"queue_size": 5, "slop": 0.1}, "0@1 1@1.09", "1,1.09"),
    Case("just the slop is too far", {"queue_size": 5, "slop": 0.1}, "0@1 1@1.1", ""),
    Case("the nearest is taken, and the other left", {"queue_size": 5, "slop": 0.5}, "0@1 0@1.2 1@1.15", "1.2,1.15"),
    Case("the left one finds its own", {"queue_size": 5, "slop": 0.5}, "0@1 0@1.2 1@1.15 1@1.3", "1.2,1.15 1,1.3"),
    Case("one set for one message", {"queue_size": 5, "slop": 1.0}, "0@1 0@1.1 0@1.2 1@1.1", "1.1,1.1"),
    Case(
        "three inputs, the nearest two too far from each other",
        {"queue_size": 5, "slop": 0.5},
        "0@1 2@1.4 2@0.8 1@0.9",
        "1,0.9,0.8",
    ),
    Case(
        "the next nearest, where the nearest are too far apart",
        {"queue_size": 5, "slop": 0.5},
        "0@0.8 0@1.3 2@1.35 1@1.05",
        "1.3,1.05,1.35",
    ),
    Case("what fell out of the queue has no set", {"queue_size": 1, "slop": 0.1}, "0@0 0@1 1@0 1@1", "1,1"),
)
"""`ApproximateTimeSynchronizer`."""

ALIGNED = (
    Case(
        "in order, with a hint of the periods",
        {"timeout": 1.0, "periods": dict.fromkeys(range(4), 0.004), "inputs": 4},
        "2@3 0@1 2@7 0@5 3@2 0@9 1@4 1@8 3@6 |",
        "1 2 3 4 5 6 7 8 9",
    ),
    Case(
        "an input that never had a message is not waited for",
        {"timeout": 1.0, "periods": dict.fromkeys(range(3), 0.002), "inputs": 3},
        "2@2 1@1 2@4 1@3 1@5 |",
        "1 2 3 4 5",
    ),
    Case(
        "an input that has fallen silent is waited for",
        {"timeout": 0.01, "periods": dict.fromkeys(range(2), 0.002), "inputs": 2},
        "0@1 0@3 0@5 0@7 0@9 0@11 0@13 0@15 1@2 1@4 |",
        "1 2 3 4 5",
    ),
    Case(
        "and given up when it is late by the timeout",
        {"timeout": 0.01, "periods": dict.fromkeys(range(2), 0.002), "inputs": 2},
        "0@1 0@3 0@5 0@7 0@9 0@11 0@13 0@15 1@2 1@4 | 0@17 |",
        "1 2 3 4 5 7 9 11 13 15 17",
    ),
    Case(
        "what comes too late is dropped",
        {"timeout": 1.0, "periods": dict.fromkeys(range(2), 0.002), "inputs": 2},
        "1@4 0@3 | 0@1 0@5 0@7 1@2 1@6 |",
        "3 4 5 6 7",
    ),
    Case(
        "without a hint it waits for the next one of each",
        {"timeout": 0.01, "inputs": 3},
        "0@6 2@2 2@4 1@1 1@3 1@5 |",
        "1 2 3 4",
    ),
    Case(
        "without a hint, the timeout flushes",
        {"timeout": 0.01, "inputs": 3},
        "0@6 2@2 2@4 1@1 1@3 1@5 | 0@16 |",
        "1 2 3 4 5 6 16",
    ),
)
"""`InputAligner`: stamps in milliseconds, ``|`` for a dispatch, and what comes out of all outputs together."""


class Interval(NamedTuple):
    """A question to a cache: its size, the stamps that came in, the question with its times, and the stamps of the answer."""

    name: str
    size: int
    stamps: tuple[float, ...]
    question: str
    times: tuple[float, ...]
    answer: tuple[float, ...]


TENS = (10.0, 20.0, 30.0, 40.0, 50.0)
UNSORTED = (10.0, 30.0, 70.0, 5.0, 20.0)

INTERVALS = (
    Interval("nothing in it", 10, (), "get_surrounding_interval", (5, 9), ()),
    Interval("an interval between messages", 10, (0.0, *TENS[:4]), "get_interval", (5, 35), (10, 20, 30)),
    Interval("an interval after all", 10, (0.0, *TENS[:4]), "get_interval", (55, 65), ()),
    Interval("what fell out", 10, tuple(10.0 * k for k in range(20)), "get_interval", (5, 35), ()),
    Interval("borders belong to it", 5, (0, 1, 2, 3, 4), "get_interval", (2, 3), (2, 3)),
    Interval("one between", 5, (0, 1, 2, 3, 4), "get_interval", (2.5, 3.5), (3,)),
    Interval("all", 5, (0, 1, 2, 3, 4), "get_interval", (0, 4), (0, 1, 2, 3, 4)),
    Interval("surrounding", 10, TENS, "get_surrounding_interval", (15, 35), (10, 20, 30, 40)),
    Interval("surrounding, from before all", 10, TENS, "get_surrounding_interval", (0, 35), (10, 20, 30, 40)),
    Interval("surrounding an instant", 10, TENS, "get_surrounding_interval", (35, 35), (30, 40)),
    Interval("surrounding, after all", 10, TENS, "get_surrounding_interval", (55, 55), (50,)),
    Interval("in the order of stamps", 10, UNSORTED, "get_interval", (3, 15), (5, 10)),
    Interval("all in the order of stamps", 10, UNSORTED, "get_interval", (0, 80), (5, 10, 20, 30, 70)),
    Interval("the next after", 10, (50, 60, 70, 80, 90), "get_elem_after_time", (85,), (90,)),
    Interval("the last before", 10, (50, 60, 70, 80, 90), "get_elem_before_time", (85,), (80,)),
    Interval("none before", 10, (50, 60, 70, 80, 90), "get_elem_before_time", (45,), ()),
    Interval("none after", 10, (50, 60, 70, 80, 90), "get_elem_after_time", (95,), ()),
    Interval("before, the same instant", 5, (0, 1, 2, 3, 4), "get_elem_before_time", (3,), (3,)),
    Interval("after, the same instant", 5, (0, 1, 2, 3, 4), "get_elem_after_time", (0,), (0,)),
)
"""`Cache`."""


def arrivals(text: str) -> list[tuple[int, float] | None]:
    """The inputs and stamps of a case; None for a dispatch."""
    found: list[tuple[int, float] | None] = []
    for word in text.split():
        index, _, stamp = word.partition("@")
        found.append(None if word == "|" else (int(index), float(stamp)))
    return found


def sets(text: str) -> list[tuple[float, ...]]:
    """The sets of stamps of a case."""
    return [tuple(map(float, word.split(","))) for word in text.split()]
