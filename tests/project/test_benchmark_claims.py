"""The benchmarks beside the tutorials' claims measure what they say: each is run for a moment, and its figures add up. How fast it was is no matter."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import pytest

from tests.benchmarks import Row, wire
from tests.benchmarks._claims import callbacks, graphs, latency
from tests.benchmarks._wire import Work

Figures: TypeAlias = dict[tuple[str, str, str], float]
SIZES = graphs.SIZES
CLAIMS = (Path(__file__).parents[2] / "docs" / "reference" / "performance.md").read_text(encoding="utf-8")


def figures(rows: Sequence[Row]) -> Figures:
    """(workload without its claim, name, unit) -> value; every row has one."""
    found: Figures = {}
    for row in rows:
        assert row.value is not None
        found[row.workload.partition(" (")[0], row.name, row.unit] = row.value
    assert len(found) == len(rows)
    return found


@pytest.fixture(scope="module")
def latencies() -> Figures:
    """The figures of `latency`, measured for a moment."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(latency, "ROUNDS", 50)
        patch.setattr(latency, "SECONDS", 0.1)
        return figures(latency.rows())


@pytest.fixture(scope="module")
def graph_figures() -> Figures:
    """Those of `graphs`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(graphs, "SIZES", (10, 100))
        patch.setattr(graphs, "LOOKED_AT", 0.3)
        patch.setattr(graphs, "SECONDS", 0.5)
        return figures(graphs.rows())


def test_latency_has_a_median_and_a_tail_for_small_and_for_large_messages(latencies: Figures) -> None:
    for size in ("64 B", "921,600 B"):
        work = f"publisher to callback in one process, {size}"
        median, tail = (latencies[work, "one message at a time", unit] for unit in ("us p50", "us p99"))
        assert 0 < median <= tail


def test_megabytes_are_messages_times_their_size_and_a_cameras_load_is_named_beside_them(
    latencies: Figures,
) -> None:
    load = f"{921_600 / 0.033 / 1e6:.1f} MB/s"
    for text, size in (("64 B", 64), ("921,600 B", 921_600)):
        work = f"one process, {text}"
        messages, megabytes = (latencies[work, "as fast as possible", unit] for unit in ("messages/s", "MB/s"))
        assert megabytes == pytest.approx(messages * size / 1e6, rel=0.1)  # what the last turn sent may be under way
    assert load in CLAIMS


def test_four_callbacks_that_block_are_timed_one_after_another_and_in_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(callbacks, "FRAMES", 3)
    monkeypatch.setattr(callbacks, "CALLS", 100)
    found = figures(callbacks.rows())
    work = "four callbacks that block for 10 ms each"
    in_turn, side_by_side = (found[work, name, "ms"] for name in ("one after another", "in worker threads"))
    assert in_turn >= callbacks.CALLBACKS * callbacks.WORK * 1e3
    assert side_by_side >= callbacks.WORK * 1e3


def test_round_trips_have_median_tail_and_the_share_below_a_millisecond(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(callbacks, "FRAMES", 3)
    monkeypatch.setattr(callbacks, "CALLS", 100)
    found = figures(callbacks.rows())
    work = "a service's round trip in one process"
    median, tail, share = (found[work, "one at a time", unit] for unit in ("us p50", "us p99", "% below 1 ms"))
    assert 0 < median <= tail
    assert 0 <= share <= 100
    assert (median < 1000) == (share >= 50) or share == 50


def test_graphs_of_10_100_and_300_nodes_have_a_start_a_load_and_a_size_in_memory(graph_figures: Figures) -> None:
    for size in (10, 100):
        name = f"{size} nodes"
        assert graph_figures["nodes that publish 10 times a second", name, "ms to start"] > 0
        assert graph_figures["nodes that publish 10 times a second", name, "% of a core"] > 0
        assert graph_figures["nodes that publish 10 times a second", name, "kB each"] > 1.0
    (row,) = (line for line in CLAIMS.splitlines() if line.startswith("| hundreds of nodes"))
    assert "{}, {} and {} nodes".format(*SIZES) in row
    assert all(unit in row for unit in ("ms", "% of a core", "kB"))


def test_a_loop_of_500_hz_has_its_jitter_and_its_missed_ticks_alone_and_beside_a_camera(
    graph_figures: Figures,
) -> None:
    for name in ("alone", "beside a camera of 28 MB/s"):
        median, tail, worst, missed = (
            graph_figures["a control loop of 500 Hz, 0.5 s", name, unit]
            for unit in ("us p50", "us p99", "us worst", "ticks missed")
        )
        assert 0 <= median <= tail <= worst
        assert missed == int(missed)


@pytest.mark.realtime
@pytest.mark.parametrize("work", ["latency", "images", "shared", "calls"])
def test_between_two_processes_each_has_its_figures(work: Work) -> None:
    measured = wire.measured("ours", work)
    assert len(measured) == len(wire.WORKS[work][1])
    assert all(value > 0 for value in measured)
    if work == "latency":
        assert measured[0] <= measured[1]


@pytest.mark.parametrize(
    "words",
    ["latency", "throughput", "depth", "burst", "executor", "services", "shared memory", "compression", "500 Hz"],
)
def test_every_claim_of_the_tutorials_has_its_measurement_beside_it(words: str) -> None:
    rows = [line.split("|")[1:3] for line in CLAIMS.splitlines() if line.startswith("| ")]
    assert any(words in claim and re.search(r"\d", measured) for claim, measured in rows), words
