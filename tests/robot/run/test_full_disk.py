"""A disk that is full amid a recording ends the recording; what was written stays readable, and the robot walks on."""

from __future__ import annotations

import asyncio
from pathlib import Path

from actors import Child, Supervisor, execute, run
from actors.bag import BagReader, Recorder, RecordOptions, Selection, WriterOptions
from actors.interfaces.std_srvs.srv import Trigger
from actors.logs import LogRecord
from actors.replay import Journal
from robot.assembly import Robot
from robot.contracts import STAND
from tests.actors.bag.bags import largest_file
from tests.robot.run.test_replay import Operator


def test_a_disk_that_is_full_ends_the_recording_and_the_robot_walks_on_to_its_goal(tmp_path: Path) -> None:
    lines: list[LogRecord] = []
    selection = Selection(all_topics=True, exclude_regex="image")
    options = RecordOptions(selection=selection, writer=WriterOptions(compression="none"))

    async def main() -> tuple[str, float, int]:
        journal = Journal("gait", folder=tmp_path)
        tree = Supervisor(
            "all",
            children=[
                Robot("kitchen", body="kinematic").tree,
                Child(Operator),
                Child(Recorder, args=(tmp_path / "walk", options)),
            ],
        )
        async with run(tree, observers=(journal,), sinks=(lines.append,)) as system:
            operator, recorder = system.node(Operator), system.node(Recorder)
            await system.clock.sleep(1.0)
            await operator.call(STAND, Trigger.Request())
            await system.clock.sleep(2.5)
            going = asyncio.ensure_future(operator.dock())
            with largest_file(500_000):
                await asyncio.wait_for(recorder.wait(), 60.0)
                full = system.clock.now()
                outcome = await going
            assert recorder.failure is not None
            return outcome, system.clock.now() - full, system.nodes["all", "robot", "control", "gait"].incarnation

    outcome, walked, lives = execute(main, clock="virtual")
    assert outcome == "docked"
    assert walked > 1.0, "it had still to walk when the disk was full"
    assert lives == 1, "a journal that cannot be written does not end its node either"
    (ended,) = [line for line in lines if line.event.startswith("recording has ended")]
    assert ended.fields["because"] == "File too large"
    with BagReader(tmp_path / "walk") as bag:
        topics = [one.topic.name for one in bag.messages()]
    assert topics.count("/odom") > 20
