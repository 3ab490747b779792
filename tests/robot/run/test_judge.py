"""The judge and the report: what is counted of a run that is played to it, and what is written down of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from actors import Child
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.testing import Rig
from cli.command import UsageError
from robot.contracts import BATTERY_STATE, DRIVE_STATUS, GAIT_STATUS, GOAL_REPORT, SAFETY_STATE
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.msg import DriveStatus, GaitStatus, GoalReport, SafetyState
from robot.planning.errors import ErrorCode
from robot.run.command import Session
from robot.run.crashes import check_crashes
from robot.run.judge import Judge, SafetyStop, Score, ScoredGoal
from robot.run.mission import failure, get_mission
from robot.run.options import parse
from robot.run.report import last_sample, make_report
from robot.run.tasks import Crash, Fetch
from robot.scenes.scene import Box, Scene
from robot.scenes.worlds import get_world
from robot.sim.kinematic import KinematicBody
from robot.sim.simulation import Truth

SCENE = Scene("post", (-5.0, -5.0, 5.0, 5.0), (Box(2.0, 0.0, 0.4, 0.4, height=1.0),), Pose2(0.0, 0.0), Pose2(0.0, 0.0))


class Puppet(KinematicBody):
    """A body that is where it is put."""

    def __init__(self) -> None:
        super().__init__(SCENE, seed=1)
        self.shown: Truth = super().truth()

    def truth(self) -> Truth:
        return self.shown

    def put(self, x: float, y: float = 0.0, **more: Any) -> None:
        self.shown = replace(self.shown, position=np.array([x, y, 0.45]), **more)


async def judged(rig: Rig) -> tuple[Puppet, Score]:
    body, score = Puppet(), Score()
    await rig.start(Child(Judge, args=(body, score)))
    await rig.advance(0.1)
    return body, score


async def test_the_way_is_counted_and_the_sway_of_standing_is_not(rig: Rig) -> None:
    body, score = await judged(rig)
    for x in (0.5, 0.9):
        body.put(x)
        await rig.advance(0.1)
    assert score.walked == pytest.approx(0.9)
    for x in (0.901, 0.9, 0.901, 0.9):
        body.put(x)
        await rig.advance(0.1)
    assert score.walked == pytest.approx(0.9)


async def test_a_fall_counts_once_until_the_robot_stands_again(rig: Rig) -> None:
    body, score = await judged(rig)
    for fallen in (True, True, False, True):
        body.put(0.0, fallen=fallen)
        await rig.advance(0.1)
    assert score.falls == 2
    assert score.fallen_at == pytest.approx(0.11, abs=0.012)


async def test_lying_on_the_floor_is_a_fall_only_while_the_gait_says_that_it_stands_or_walks(rig: Rig) -> None:
    body, score = await judged(rig)
    body.put(0.0, lying=True)
    for mode in ("sit", "rising", "lowering"):
        rig.publish(GAIT_STATUS, GaitStatus(mode=mode))
        await rig.advance(0.1)
    assert score.falls == 0
    for falls, mode in enumerate(("stand", "walk", "stopping"), start=1):
        body.put(0.0, lying=True)
        rig.publish(GAIT_STATUS, GaitStatus(mode=mode))
        await rig.advance(0.1)
        assert score.falls == falls
        body.put(0.0, lying=False)
        await rig.advance(0.1)
    rig.publish(GAIT_STATUS, GaitStatus(mode="walk"))
    await rig.advance(0.3)  # the gait has been silent since: the drives may have sat the robot down
    body.put(0.0, lying=True)
    await rig.advance(0.1)
    assert score.falls == 3


async def test_the_clearance_is_the_least_of_the_outline_to_any_obstacle(rig: Rig) -> None:
    body, score = await judged(rig)
    assert score.clearance == pytest.approx(
        1.8 - 0.55
    )  # the box's face is at 1.8 m, the nose 0.55 m ahead of the middle
    body.put(1.0)
    await rig.advance(0.1)
    body.put(-3.0)
    await rig.advance(0.1)
    assert score.clearance == pytest.approx(0.25)


async def test_an_obstacle_is_touched_when_it_is_first_touched(rig: Rig) -> None:
    body, score = await judged(rig)
    body.put(1.5, touching=("box_0",))
    await rig.advance(0.5)
    (name,) = score.contacts
    assert name == "box_0"
    assert 0.1 <= score.contacts[name] <= 0.12


async def test_who_drove_for_how_long_and_what_stopped_the_robot(rig: Rig) -> None:
    _, score = await judged(rig)
    rig.publish(DRIVE_STATUS, DriveStatus(enabled=True, source="teleop"))
    await rig.advance(2.0)
    rig.publish(DRIVE_STATUS, DriveStatus(enabled=True, source="autonomy"))
    await rig.advance(1.0)
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("tilt",)))
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("tilt",)))
    await rig.advance(1.0)
    rig.publish(SAFETY_STATE, SafetyState(stopped=False, reasons=()))
    await rig.advance(0.1)
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("tilt",)))
    await rig.advance(0.1)
    assert score.drove == {"teleop": pytest.approx(2.0, abs=0.05), "autonomy": pytest.approx(2.2, abs=0.05)}
    assert [stop.reasons for stop in score.stops] == [("tilt",), ("tilt",)]
    assert score.stops[1].at - score.stops[0].at == pytest.approx(1.1, abs=0.01)


async def test_a_goal_is_scored_by_where_the_true_body_is(rig: Rig) -> None:
    body, score = await judged(rig)
    body.put(3.0, 3.9)
    report = GoalReport(name="a", x=3.0, y=4.0, outcome="succeeded", reason="", seconds=7.12345, behind_obstacle=True)
    rig.publish(GOAL_REPORT, report)
    await rig.advance(0.1)
    (goal,) = score.goals
    assert (goal.name, goal.outcome, goal.seconds, goal.true_error, goal.behind_obstacle) == (
        "a",
        "succeeded",
        7.123,
        0.1,
        True,
    )


async def test_the_charge_is_the_latest_that_was_told(rig: Rig) -> None:
    _, score = await judged(rig)
    charging = BatteryState.POWER_SUPPLY_STATUS_CHARGING
    rig.publish(BATTERY_STATE, BatteryState(percentage=0.4, power_supply_status=charging))
    await rig.advance(0.1)
    assert (score.charge, score.charging) == (pytest.approx(0.4), True)


async def test_the_report_holds_the_score_to_four_digits_and_every_topic_and_node(rig: Rig) -> None:
    body, score = await judged(rig)
    score.walked, score.clearance, score.charge = 1.234567, 0.98765, 0.5
    score.stops.append(SafetyStop(1.0, ("tilt",)))
    report = make_report(rig.system, body, score, {"battery_percent": 90.0, "seed": 3})
    assert (report["seed"], report["distance_walked"], report["smallest_clearance"]) == (3, 1.2346, 0.9877)
    assert report["battery"] == {"start_percent": 90.0, "end_percent": 50.0, "charging": False}
    assert report["safety_stops"] == [{"at": 1.0, "reasons": ("tilt",)}]
    (look,) = (row for row in report["timers"] if row["timer"] == "look")
    assert (look["node"], look["hz"], look["missed"]) == ("/judge", 50.0, 0)
    assert {row["name"] for row in report["topics"]} >= {"/battery_state", "/mission/goals"}
    (judge,) = (row for row in report["nodes"] if row["name"] == "/judge")
    assert (judge["incarnation"], judge["restarts"]) == (1, [])


async def test_what_was_not_seen_is_none_and_not_infinite(rig: Rig) -> None:
    await rig.start(Child(Judge, args=(Puppet(), Score())))
    report = make_report(rig.system, Puppet(), Score(), {"battery_percent": 90.0})
    assert (report["smallest_clearance"], report["battery"]["end_percent"]) == (None, None)


def test_the_last_sample_is_the_true_body_and_with_an_arm_what_it_holds() -> None:
    body = Puppet()
    body.put(1.23456, -2.0)
    assert last_sample(body) == {"x": 1.2346, "y": -2.0, "body_height": 0.45, "fallen": False}
    carrier = KinematicBody(get_world("kitchen"), seed=1, arm=True)
    told = last_sample(carrier)
    assert told["held"] is None
    assert told["things"]["cup"] == pytest.approx([2.05, 1.0, 0.45], abs=0.1)


# --- the mission ---------------------------------------------------------------------------------------------------


def scored(outcome: str, reason: str = "", name: str = "a") -> ScoredGoal:
    return ScoredGoal(name, 3.0, 4.0, outcome, reason, 1.0, 1.0, 0.0, False)


REFUSED = replace(scored("aborted", "12.0 Wh are left, the way takes 30.0 Wh"), error_code=ErrorCode.LOW_BATTERY)
DOCKED = scored("succeeded", name="dock")


@pytest.mark.parametrize(
    ("words", "goals", "told"),
    [
        ([], [], None),
        (["--goal", "3", "4"], [], "--goal 3 4: not reached: the robot was 5.0 m away from it when the run ended"),
        (["--goal", "3", "4"], [scored("aborted", "PathBlocked")], "--goal 3 4: not reached: aborted: PathBlocked"),
        (["--goal", "3", "4"], [scored("aborted"), scored("succeeded")], None),
        (["--fetch", "cup"], [], "--fetch cup: not done: the robot was under way when the run ended"),
        (["--fetch", "cup"], [scored("canceled")], "--fetch cup: not done: canceled"),
        (["--goal", "3", "4"], [REFUSED, DOCKED], f"--goal 3 4: not reached: aborted: {REFUSED.reason}"),
        (
            ["--goal", "3", "4"],
            [DOCKED],
            "--goal 3 4: not reached: the robot was 5.0 m away from it, on its dock when the run ended",
        ),
        ([], [scored("aborted", "PathBlocked")], "a (3, 4): aborted: PathBlocked"),
        ([], [scored("aborted"), scored("succeeded")], None),
        ([], [scored("succeeded"), scored("canceled", name="b")], "b (3, 4): canceled"),
        ([], [REFUSED, DOCKED], None),
        ([], [REFUSED], f"a (3, 4): aborted: {REFUSED.reason}"),
    ],
)
def test_what_was_asked_for_and_did_not_come_about_is_one_line(
    words: list[str], goals: list[ScoredGoal], told: str | None
) -> None:
    assert failure(parse(words), Score(goals=goals), Puppet()) == told


@pytest.mark.parametrize("words", [[], ["--goal", "3", "4"]])
def test_a_fall_is_a_failure_whatever_was_reached(words: list[str]) -> None:
    fallen = Score(goals=[scored("succeeded")], falls=1, fallen_at=4.35)
    assert failure(parse(words), fallen, Puppet()) == "the robot fell at 4.3 s"
    assert failure(parse(words), Score(falls=3, fallen_at=4.0), Puppet()) == "the robot fell at 4.0 s and 2 more times"


@pytest.mark.parametrize(
    ("goal", "fetch", "told"),
    [
        ((99.0, 0.0, 0.0), None, "--goal 99 0: that is outside of the world 'kitchen', where x is "),
        (None, Fetch("mug", None), "--fetch mug: the world 'kitchen' has no such thing; "),
        (None, Fetch("cup", (99.0, 0.0, 0.0)), "--fetch cup 99 0 0: that is outside of the world 'kitchen'"),
        (None, Fetch("cup", (1.0, 0.0, -0.1)), "--fetch cup 1 0 -0.1: that is below the floor; give Z of at least 0 m"),
        (
            None,
            Fetch("cup", (2.05, 1.0, 0.1)),
            "--fetch cup 2.05 1 0.1: something 0.45 m high stands there; give Z of at least 0.45 m",
        ),
    ],
)
def test_a_task_that_the_world_does_not_allow_is_refused(goal: Any, fetch: Fetch | None, told: str) -> None:
    with pytest.raises(UsageError) as refused:
        get_mission(goal, fetch, get_world("kitchen"))
    assert str(refused.value).startswith(told)


def test_without_a_task_it_is_the_patrol_and_with_one_the_task() -> None:
    scene = get_world("warehouse")
    assert get_mission(None, None, scene) == "patrol"
    assert get_mission((2.0, 0.0, 0.5), None, scene) == [Pose2(2.0, 0.0, 0.5)]
    with pytest.raises(
        UsageError, match="the world 'warehouse' has no cup; the world 'kitchen' has one: add --world kitchen"
    ):
        get_mission(None, Fetch("cup", None), scene)


def test_a_node_that_does_not_exist_cannot_be_crashed() -> None:
    tree = Session(parse(["--backend", "kinematic"])).robot.tree
    check_crashes(tree, [Crash("gait", 3.0)])
    with pytest.raises(UsageError, match=r"^--crash gate@3: .*gate"):
        check_crashes(tree, [Crash("gate", 3.0)])
