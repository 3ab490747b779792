"""Bags: written, split, rewritten, recovered without a system."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

from actors import Child, Node, QoS, Topic, every, execute, publishes, run
from actors.bag import (
    BagError, BagFile, BagMessage, BagMetadata, BagReader, BagTopic, BagWriter, Player, PlayOptions, RecordOptions, Recorder, Recovered, Selection, Split,
    WriterOptions, qos_overrides, recover, reindex, rewrite, topic_of,
)
from actors.interfaces import decode, encode
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig

# -- in a program

COUNT = Topic(Int32, "count", 100)
folder = Path(tempfile.mkdtemp())


class Counter(Node):
    count = publishes(COUNT)

    @every(hz=100)
    def tick(self) -> None:
        self.count(Int32(data=self.count.count))


async def record(path: Path) -> tuple[int, int]:
    options = RecordOptions(selection=Selection(topics=["/count"]))
    async with run(Child(Recorder, args=(path, options)), Counter) as system:
        await system.clock.sleep(60.0)
        recorder = system.node(Recorder)
        await recorder.finish()
        return recorder.recorded, recorder.dropped


recorded, dropped = execute(lambda: record(folder / "minute"), clock="virtual")
assert (recorded > 5900, dropped) == (True, 0)

# -- without a system

numbers: BagTopic = topic_of("/number", Int32, [QoS(depth=10)])
writer = BagWriter(folder / "written", WriterOptions(compression="lz4", max_seconds=60.0))
for number in range(3):
    writer.write(numbers, encode(Int32(data=number)), received_ns=number * 10**9, published_ns=number * 10**9)
cut: Split = writer.split()
writer.write(numbers, encode(Int32(data=3)), received_ns=3 * 10**9, published_ns=3 * 10**9)
told: BagMetadata = writer.close()
files: tuple[BagFile, ...] = told.files
assert Path(cut.closed).name == files[0].path and [one.message_count for one in files] == [3, 1]

late: BagMetadata = rewrite([folder / "written"], folder / "late", start_ns=2 * 10**9)
assert sum(late.topics.values()) == 2

(folder / "late" / "metadata.yaml").unlink()
assert reindex(folder / "late").topics == late.topics

torn = folder / "torn.mcap"
torn.write_bytes((folder / "written" / files[0].path).read_bytes()[:-100])  # as if the recorder had been killed
rescued: Recovered = recover(torn, folder / "rescued")
with BagReader(folder / "rescued") as bag:
    first: BagMessage = next(bag.messages())
    assert (first.topic.name, decode(Int32, first.data).data) == ("/number", 0)

try:
    BagReader(folder / "nothing")
except BagError as error:
    print(error)

overrides = folder / "qos.yaml"
overrides.write_text("/count: {reliability: best_effort, history: keep_last, depth: 1}")
profiles: Mapping[str, QoS] = qos_overrides(overrides)
assert RecordOptions(qos=profiles).qos["/count"].depth == 1

# -- what was to be seen at a time

with BagReader(folder / "minute") as bag:
    half = bag.metadata.start_ns + 30 * 10**9
    (latest,) = bag.before(half, {"/count": 1})
assert 0 < half - latest.received_ns <= 10 * 10**6


async def test_a_seek_shows_what_was_there(rig: Rig) -> None:
    await rig.start(Child(Player, args=(folder / "minute", PlayOptions(paused=True, scrub=True))))
    counts = rig.probe(COUNT)
    rig.node(Player).seek(half)
    await rig.advance(0.1)
    assert [message.data for message in counts] == [decode(Int32, latest.data).data]
