"""Nodes of the robot are replayed alone, from journals of a run in which things went wrong, to the same bits."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Literal

import pytest

from actors import Child, Node, Supervisor, execute, run
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.std_srvs.srv import SetBool, Trigger, Trigger_Request, Trigger_Response
from actors.replay import Journal, ReplayError, load, recording_in, replay
from actors.replay.recording import starts_of
from robot.assembly import Robot
from robot.contracts import DOCK, EMERGENCY_STOP, NAVIGATE_TO_POSE, STAND
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.action import Dock
from robot.nodes.gait import Gait
from tests.figures.load import processor_seconds
from tests.robot.run.test_run import robot

NODES = ("navigation", "gait", "battery", "safety_monitor", "robot_controller", "localizer")
INNER: dict[str, set[tuple[str, str]]] = {
    "all/robot/navigation": {("goal", "/navigate_to_pose")},
    "all/robot/safety": set(),
}
"""What passes only inside of a subtree."""


class Deaf(Gait):
    """A gait that does not answer when a stopped robot is to stand, so that the safety monitor's call times out."""

    node_name = "gait"
    asked = 0

    @STAND.serve(concurrent=5)
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        self.asked += 1
        if self.asked > 1:
            await asyncio.Event().wait()
        return await super().stand(request)


class Operator(Node):
    """Who sends the robot to places."""

    async def go(self, x: float, y: float) -> str:
        async with self.send_goal(
            NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=pose_stamped(Pose2(x, y), Time()))
        ) as goal:
            return repr(await goal.ended())

    async def dock(self) -> str:
        async with self.send_goal(DOCK, Dock.Goal()) as goal:
            return (await goal).outcome


def with_deaf_gait(tree: Supervisor) -> Supervisor:
    control, *others = tree.children
    assert isinstance(control, Supervisor)
    children = [
        one.replace(factory=Deaf) if one.name == "gait" else one for one in control.children if isinstance(one, Child)
    ]
    return tree.replace(children=(control.replace(children=tuple(children)), *others))


async def troubled_walk() -> tuple[Journal, list[str]]:
    """Stand up, walk, be sent elsewhere, slow down, crash one after another, be stopped: the journals, and what became of the goals."""
    journal = Journal(*NODES, "motors")
    robot = Robot("kitchen", body="kinematic")
    tree = Supervisor("all", children=[with_deaf_gait(robot.tree), Child(Operator)])
    async with run(tree, observers=(journal,), sinks=()) as system:
        sleep, operator = system.clock.sleep, system.node(Operator)
        await sleep(1.0)
        await operator.call(STAND, Trigger.Request())
        await sleep(2.5)
        first = asyncio.ensure_future(operator.go(1.5, 0.5))
        await sleep(1.5)
        second = asyncio.ensure_future(operator.go(0.5, 0.5))
        await sleep(1.0)
        assert system.node("navigation").set_parameter("max_speed", 0.4).successful
        await sleep(0.5)
        await operator.call(EMERGENCY_STOP, SetBool.Request(data=True))
        await sleep(2.0)
        for node in NODES:
            system.crash(node, ValueError(f"{node} is struck"))
            await sleep(0.4)
        await sleep(0.5)
        return journal, [await first, await second]


@cache
def troubled() -> tuple[Journal, list[str]]:
    """The same on the virtual clock, walked once for all tests."""
    return execute(troubled_walk, clock="virtual")


@contextmanager
def burning(loops: int) -> Generator[None]:
    """So many processes that do nothing but occupy a core each. Each has to have computed for a second at the end."""
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops)]
    try:
        yield
    finally:
        used = [processor_seconds({burner.pid}) for burner in burners]
        for burner in burners:
            burner.kill()
            burner.wait()
    assert all(seconds > 1.0 for seconds in used), used


@pytest.mark.parametrize(
    ("clock", "loops"),
    [
        ("virtual", 0),
        pytest.param("real", 0, marks=pytest.mark.realtime),
        pytest.param("real", 2, marks=pytest.mark.realtime),
    ],
)
def test_six_nodes_are_replayed_alone_bit_for_bit_by_a_process_without_body_and_world(
    clock: Literal["virtual", "real"], loops: int, tmp_path: Path
) -> None:
    with burning(loops):
        journal, goals = troubled() if clock == "virtual" else execute(troubled_walk, clock=clock)
    assert goals[0] == "<ABORTED: preempted by a newer goal>"
    with pytest.raises(ReplayError, match="KinematicBody is the robot's hardware"):
        journal.recording("motors")
    asked = [
        entry
        for entry in journal.recording("safety_monitor").entries
        if isinstance(entry, tuple) and entry[0] == "done"
    ]
    assert any("CallTimeout" in repr(entry[5]) for entry in asked)  # the call that timed out
    program = """
import gc, json, sys
from actors.replay import load, replay
for path in sys.argv[1:]:
    verdict = replay(load(path, trust=True))
    alive = sorted({type(one).__name__ for one in gc.get_objects()} & {"KinematicBody", "PhysicsBody", "LinkedBody", "Robot", "Scene"})
    print(json.dumps([verdict.equal, verdict.compared, [*map(str, verdict.differences)], verdict.lacking, alive, "mujoco" in sys.modules]))
"""
    for node in NODES:
        lives = [entry for entry in journal.recording(node).entries if isinstance(entry, tuple) and entry[0] == "start"]
        assert len(lives) == 2, node  # it crashed, and lived again
    paths = [journal.save(tmp_path / node, node) for node in NODES]
    done = subprocess.run([sys.executable, "-c", program, *paths], capture_output=True, text=True, check=True)
    for node, line in zip(NODES, done.stdout.splitlines(), strict=True):
        equal, compared, differences, lacking, alive, has_engine = json.loads(line)
        assert (equal, differences, lacking) == (True, [], ""), node
        assert compared > 10, node
        assert (alive, has_engine) == ([], False), node


def test_a_constant_that_was_changed_is_found_at_its_first_effect() -> None:
    journal, _ = troubled()
    first = replay(journal.recording("navigation"), parameters={"max_speed": 0.5}).differences[0]
    assert (first.kind, first.name, first.field) == ("feedback", "/navigate_to_pose", "estimated_time_remaining.sec")
    assert 3.5 < first.time < 4.0, "the walk had just begun"
    assert first.recorded < first.replayed, "the slower robot needs longer"


async def docking_walk() -> Journal:
    """Stand up and walk to the charging station, while the battery's node is struck: the journals of two subtrees."""
    journal = Journal("all/robot/navigation", "all/robot/safety", "all/robot/control")
    robot = Robot("kitchen", body="kinematic")
    async with run(Supervisor("all", children=[robot.tree, Child(Operator)]), observers=(journal,), sinks=()) as system:
        sleep, operator = system.clock.sleep, system.node(Operator)
        await sleep(1.0)
        await operator.call(STAND, Trigger.Request())
        docking = asyncio.ensure_future(operator.dock())
        await sleep(4.0)
        system.crash("battery", ValueError("battery is struck"))
        assert system.node("safety_monitor").set_parameter("silence", 0.6).successful
        assert await docking == "docked"
        await sleep(0.5)
    return journal


@pytest.fixture(scope="module")
def docked() -> Journal:
    return execute(docking_walk, clock="virtual")


@pytest.mark.parametrize("subtree", ["all/robot/navigation", "all/robot/safety"])
def test_a_subtree_of_the_robot_is_replayed_alone_by_what_crossed_its_border(docked: Journal, subtree: str) -> None:
    recording = docked.recording(subtree)
    verdict = replay(recording)
    assert (verdict.differences, verdict.inner, verdict.lacking) == ((), (), "")
    assert verdict.compared > 100
    inner = {entry[1:3] for entry in recording.entries if isinstance(entry, tuple) and entry[0] == "inner"}
    assert inner == INNER[subtree]
    senders = {entry[5] for entry in recording.entries if isinstance(entry, tuple) and entry[0] == "publisher"}
    assert not senders & {start.node for start in starts_of(recording)}, "what passes inside is no input"


def test_a_planted_constant_inside_a_subtree_is_found_at_its_first_effect_at_the_border(
    docked: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "robot.nodes.docking.BEFORE", Pose2(-0.75, 0.0)
    )  # m before the station: where the docking node has the robot sent
    verdict = replay(docked.recording("all/robot/navigation"))
    (inside,) = verdict.inner
    assert (inside.kind, inside.name) == ("goal", "/navigate_to_pose")
    (found,) = verdict.differences
    assert inside.time <= found.time
    assert found.name in ("/plan", "/autonomy/cmd_vel")


def test_a_subtree_with_the_body_is_refused_by_the_name_of_its_node(docked: Journal) -> None:
    with pytest.raises(
        ReplayError, match=r"no journal of all/robot/control: /motors: .*KinematicBody is the robot's hardware"
    ):
        docked.recording("all/robot/control")


def test_a_run_writes_the_journals_that_it_keeps_into_a_folder(tmp_path: Path) -> None:
    words = (
        "--backend",
        "kinematic",
        "--duration",
        "5",
        "--replay",
        "battery",
        "--journals",
        str(tmp_path / "journals"),
    )
    done = robot("run", "--clock", "virtual", *words)
    assert done.returncode == 0, done.stderr
    verdict = replay(load(tmp_path / "journals" / "battery.journal"))
    assert verdict.equal, verdict
    assert verdict.compared > 5
    refused = robot("run", "--journals", str(tmp_path))
    assert refused.returncode == 2
    assert "--journals: give the nodes: --replay NODE" in refused.stderr


@pytest.mark.slow(reason="two runs")
def test_the_flight_record_of_a_run_holds_the_journals_that_it_kept(tmp_path: Path) -> None:
    record = tmp_path / "flight.mcap"
    words = ("--backend", "kinematic", "--duration", "5", "--replay", "battery", "--flight-record", str(record))
    done = robot("run", "--clock", "virtual", *words)
    assert done.returncode == 0, done.stderr
    verdict = replay(recording_in(record, "battery"))
    assert verdict.equal, verdict
    assert verdict.compared > 5


def test_a_run_keeps_the_journal_of_a_subtree_and_names_the_one_that_was_meant(tmp_path: Path) -> None:
    words = ("--backend", "kinematic", "--duration", "3", "--replay", "robot/navigation", "--journals", str(tmp_path))
    done = robot("run", "--clock", "virtual", *words)
    assert done.returncode == 0, done.stderr
    recording = load(tmp_path / "robot.navigation.subtree.journal")
    assert {start.node for start in starts_of(recording)} == {"/navigation", "/docking", "/tutorial_walks"}
    assert replay(recording).equal
    refused = robot("run", "--replay", "robot/navigatio")
    assert refused.returncode == 2
    assert "--replay: there is no subtree 'robot/navigatio'; did you mean 'robot/navigation'?" in refused.stderr
