"""The trace of a run: equal for equal runs, different for the smallest difference."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from actors import Child, Node, Supervisor, every, execute, publishes, run
from actors.bag import Trace
from actors.bag.trace import canonical
from actors.testing import Rig
from tests.stage import NUMBERS, WORDS, number, word

ROOT = Path(__file__).parents[3]


class Player(Node):
    """Rolls a die ten times a second."""

    numbers = publishes(NUMBERS)
    words = publishes(WORDS)

    @every(hz=10)
    def roll(self) -> None:
        self.numbers(number(self.rng.randrange(6)))


def trace_of(seed: int = 0, act: Callable[[Player], None] | None = None, at: float = 1.0) -> Trace:
    """The trace of two seconds of a player who does something of his own at some time."""

    async def main() -> Trace:
        trace = Trace()
        async with run(Supervisor("game", children=[Child(Player)]), seed=seed, sinks=(), observers=(trace,)) as system:
            await system.clock.sleep(at)
            core = system.runtime.directory.find("/player")
            assert core is not None
            assert isinstance(core.node, Player)
            if act is not None:
                act(core.node)
            await system.clock.sleep(2.0 - at)
        return trace

    return execute(main, clock="virtual")


def test_the_same_seed_gives_the_same_trace_and_another_seed_another() -> None:
    assert trace_of(seed=1).hexdigest() == trace_of(seed=1).hexdigest()
    assert trace_of(seed=1).hexdigest() != trace_of(seed=2).hexdigest()


ACTS: dict[str, Callable[[Player], None]] = {
    "nothing": lambda player: None,
    "a message": lambda player: player.numbers(number(7)),
    "another value": lambda player: player.numbers(number(8)),
    "another topic": lambda player: player.words(word("7")),
    "an unencodable text": lambda player: player.words(word("\ud800")),
    "another unencodable text": lambda player: player.words(word("\ud801")),
    "a line": lambda player: player.log.info("dice"),
    "another level": lambda player: player.log.warning("dice"),
    "a field": lambda player: player.log.info("dice", eyes=6),
    "another field": lambda player: player.log.info("dice", eyes="6"),
}


def test_every_difference_shows() -> None:
    hashes = {name: trace_of(act=act).hexdigest() for name, act in ACTS.items()}
    hashes["at another time"] = trace_of(act=ACTS["a message"], at=1.05).hexdigest()
    assert len(set(hashes.values())) == len(hashes), hashes
    assert trace_of(act=ACTS["nothing"]).hexdigest() == hashes["nothing"]


async def test_messages_lines_and_events_of_supervisors_count(rig: Rig) -> None:
    trace = rig.observe(Trace())
    await rig.start(Player)
    await rig.advance(1.0)
    assert (trace.messages, trace.lines, trace.events) == (10, 1, 1)
    before = trace.hexdigest()
    assert repr(trace) == f"<trace {before[:16]} of 10 messages, 1 log lines, 1 events>"
    rig.crash(Player)
    await rig.settled()
    assert trace.events == 3
    assert trace.hexdigest() != before


async def test_a_trace_follows_one_system(rig: Rig) -> None:
    system = await rig.start(Player)
    trace = Trace().attach(system)
    with pytest.raises(RuntimeError, match="make another one"):
        trace.attach(system)


class Thing:
    pass


def test_words_for_a_value_depend_on_the_value_alone() -> None:
    one, other = Thing(), Thing()
    assert repr(one) != repr(other)
    assert canonical(one) == canonical(other)
    assert canonical({"things": [one, (other, 1.5)]}) == canonical({"things": [other, (one, 1.5)]})
    assert canonical({"b", "a", "c"}) == "{'a', 'b', 'c'}"
    assert canonical(frozenset((2, 1))) == "{1, 2}"
    assert canonical({"at": 0x1F}) != canonical({"at": 0x2F})


SCRIPT = """
from actors import Child, Node, Supervisor, every, execute, publishes, run
from actors.bag import Trace
from tests.stage import WORDS, word

class Guest(Node):
    out = publishes(WORDS)

    @every(hz=10)
    def say(self):
        self.out(word(str(self.rng.random())))
        self.log.info("seen", who={"ada", "bob", "cleo", "dora"}, this=self.say, it=object())
        if self.clock.now() > 0.5 and self.incarnation == 1:
            raise ValueError(f"odd: {object()!r}")

async def main():
    trace = Trace()
    tree = Supervisor("party", children=[Child(Guest, name=name) for name in ("x", "y", "z")])
    async with run(tree, seed=3, sinks=(), observers=(trace,)) as system:
        await system.clock.sleep(2.0)
    return trace.hexdigest()

print(execute(main, clock="virtual"))
"""


def test_neither_the_process_nor_the_seed_of_its_hashes_matters() -> None:
    def trace(hash_seed: str) -> str:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": hash_seed}
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    first = trace("1")
    assert len(first) == 64
    assert first == trace("2") == trace("random")
