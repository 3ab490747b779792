"""What a simulated process tells of itself beside the news of its nodes: what its supervisor reports, and its flight record."""

from __future__ import annotations

import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import pytest
from mcap.reader import make_reader

from actors import Child, Intensity, Node, Supervisor, Topic, every, publishes, run
from actors.bag import FlightRecorder
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.testing import Rig
from tests.actors.supervision.kit import virtual


class Counter(Node):
    out = publishes(Topic(Int32, "count"))

    @every(hz=10)
    def tick(self) -> None:
        self.out(Int32(data=1))


TREE = Supervisor("top", intensity=Intensity(3, within=60.0), children=[Child(Counter, process=True)])


async def test_what_the_life_of_a_child_says_once_more_in_its_process_is_reported_here(rig: Rig) -> None:
    system = await rig.start(TREE)
    process = cast("Any", cast("Any", system.runtime.processes).running["top", "counter"])
    supervisor = process.hosted.system.supervisor
    task = supervisor.incarnation(("counter",))

    task.owner.ready(task)
    await rig.advance(0.1)

    (report,) = [report for report in system.reports if report.context == "unexpected"]
    assert (report.supervisor, report.child.id) == (("top",), "counter")
    assert report.note == "it said once more that it has started; dropped"
    assert rig.state("counter").state == "running"


@pytest.mark.parametrize("broken", [True, False])
@virtual
async def test_a_process_whose_child_fails_writes_its_flight_record_and_names_it_and_one_that_stops_does_not(
    broken: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    lines: list[LogRecord] = []
    async with run(TREE, sinks=(lines.append,), observers=(FlightRecorder(),)) as system:
        await system.clock.sleep(1.0)
        if broken:
            system.crash("counter", OSError("broken"))
            await system.clock.sleep(1.0)

    files = [Path(line.fields["file"]) for line in lines if line.event == "flight record of a process"]
    assert files == list(tmp_path.iterdir())  # noqa: ASYNC240  # the run is over
    assert len(files) == broken
    for file in files:
        summary = make_reader(BytesIO(file.read_bytes())).get_summary()
        assert summary is not None
        assert "/count" in {channel.topic for channel in summary.channels.values()}
