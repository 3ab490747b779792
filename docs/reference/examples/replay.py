"""Replay: verdicts as values, subtrees, journals in bags."""

from pathlib import Path

from actors import Child, Node, Supervisor, Topic, every, execute, parameter, publishes, run
from actors.bag import RecordOptions, Recorder, Selection
from actors.interfaces.std_msgs.msg import Int32
from actors.replay import (
    Difference, Journal, NoJournal, ReplayError, Recording, Verdict, has_journal, journals_in, load, replay, recording_in, recordings_in,
)

# -- in a program

COUNT, SUM = Topic(Int32, "count"), Topic(Int32, "sum")


class Counter(Node):
    count = publishes(COUNT)

    @every(hz=100)
    def tick(self) -> None:
        self.count(Int32(data=self.count.count))


class Adder(Node):
    sum = publishes(SUM)
    limit = parameter(1000)

    async def on_start(self) -> None:
        self.total = 0

    @COUNT.on()
    def add(self, message: Int32) -> None:
        self.total = min(self.limit, self.total + message.data)
        self.sum(Int32(data=self.total))


async def record() -> Journal:
    journal = Journal("/adder")
    async with run(Counter, Adder, observers=(journal,)) as system:
        await system.clock.sleep(0.5)
    return journal


recording = execute(record, clock="virtual").recording("/adder")
assert replay(recording).equal

(found,) = replay(recording, parameters={"limit": 100}).differences
assert str(found) == "publish /sum[14] at 0.150000 s, field data: recorded 105, replayed 100"

later: Recording = recording
verdict: Verdict = replay(later, parameters={"limit": 100})
first: Difference = verdict.differences[0]
assert (first.kind, first.name, first.number, first.recorded, first.replayed) == ("publish", "/sum", 14, 105, 100)
assert not verdict.equal and verdict.compared > 15 and verdict.failure == ""
Path("notes.txt").write_text("not a journal")
try:
    load("notes.txt")
except ReplayError as error:
    print(error)

# -- a subtree

TOTAL = Topic(Int32, "total")


class Totals(Node):
    total = publishes(TOTAL)

    @SUM.on()
    def add(self, message: Int32) -> None:
        if message.data % 10 == 0:
            self.total(Int32(data=message.data))


async def record_team() -> Journal:
    journal = Journal("world/team")
    team = Supervisor("team", Adder, Totals)
    async with run(Supervisor("world", Counter, team), observers=(journal,)) as system:
        await system.clock.sleep(0.5)
    return journal


recording = execute(record_team, clock="virtual").recording("world/team")
assert replay(recording).equal
verdict = replay(recording, changed="adder", parameters={"limit": 100})
assert str(verdict.inner[0]) == "publish /sum[14] at 0.150000 s, field data: recorded 105, replayed 100"
assert verdict.differences[0].name == "/total" and not verdict.equal

# -- a journal in a bag

async def walk_with_journal() -> None:
    journal = Journal("/adder", publish=True)
    tree = Child(Recorder, args=(Path("both"), RecordOptions(selection=Selection(all_topics=True, hidden=True))))
    async with run(tree, Adder, Counter, observers=(journal,)) as system:
        await system.clock.sleep(2.0)


execute(walk_with_journal, clock="virtual")
assert has_journal("both", "adder") and not has_journal("both", "counter")
assert journals_in("both") == {"/adder"} == {*recordings_in("both")}
assert replay(recording_in("both", "adder")).equal
try:
    recording_in("both", "world/team")
except NoJournal as error:
    print(error)  # both has no journal of world/team; it has those of: /adder
