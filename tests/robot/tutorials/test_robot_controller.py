"""Voice and joystick (Y-33), the status service (Y-32), and three who share /cmd_vel (Y-35)."""

from __future__ import annotations

from math import nan

import pytest

from actors import Child, Node
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.testing import Rig
from robot.contracts import CMD_VEL, ENABLE, JOY_CMD, VOICE
from robot.tutorials import robot_status, velocity_trio
from robot.tutorials.robot_controller import tree
from robot.tutorials.robot_status import RobotStatusService
from robot.tutorials.velocity_trio import Autonomy, SafetyMonitor, Teleop
from tests.robot.stage import said, twist, warnings

ME = "robot_controller"


async def enable(rig: Rig, on: bool = True) -> str:
    reply = await rig.call(ENABLE, SetBool.Request(data=on))
    assert reply.success
    return reply.message


async def say(rig: Rig, words: str) -> None:
    rig.publish(VOICE, String(data=words))
    await rig.quiet()


async def test_a_disabled_controller_warns_of_the_voice_and_is_silent_about_the_joystick(rig: Rig) -> None:
    await rig.start(tree())
    commands = rig.probe(CMD_VEL)
    await say(rig, "forward")
    rig.publish(JOY_CMD, twist(1.0))
    await rig.advance(1.0)
    assert not commands
    assert warnings(rig, ME) == ["Robot disabled, ignoring command"]


@pytest.mark.parametrize(
    ("words", "vx", "wz"),
    [
        ("forward", 1.0, 0.0), ("frente", 1.0, 0.0), ("back", -1.0, 0.0), ("trás", -1.0, 0.0), ("tras", -1.0, 0.0),
        ("left", 0.0, 1.0), ("esquerda", 0.0, 1.0), ("right", 0.0, -1.0), ("direita", 0.0, -1.0),
        ("stop", 0.0, 0.0), ("parar", 0.0, 0.0), ("FORWARD", 1.0, 0.0), ("Esquerda", 0.0, 1.0),
    ],
)  # fmt: skip
async def test_every_word_in_two_languages(rig: Rig, words: str, vx: float, wz: float) -> None:
    await rig.start(tree())
    await enable(rig)
    commands = rig.probe(CMD_VEL)
    await say(rig, words)
    assert list(commands) == [twist(vx, wz=wz)]
    assert said(rig, ME)[-1] == f"Executing: {words.lower()}"


async def test_an_unknown_word_moves_nothing(rig: Rig) -> None:
    await rig.start(tree())
    await enable(rig)
    commands = rig.probe(CMD_VEL)
    await say(rig, "dance")
    assert not commands
    assert warnings(rig, ME) == ["Unknown command: dance"]


async def test_the_joystick_is_clipped_to_the_tutorials_limits(rig: Rig) -> None:
    await rig.start(tree())
    await enable(rig)
    commands = rig.probe(CMD_VEL)
    rig.publish(JOY_CMD, twist(2.0, wz=-3.0))
    await rig.quiet()
    assert list(commands) == [twist(1.0, wz=-1.0)]


async def test_disabling_stops_the_motors_before_the_answer_and_both_may_be_asked_twice(rig: Rig) -> None:
    await rig.start(tree())
    commands = rig.probe(CMD_VEL)
    assert [await enable(rig), await enable(rig)] == ["Robot enabled successfully"] * 2
    assert not commands
    assert await enable(rig, False) == "Robot disabled, stopping motors"
    assert list(commands) == [twist()]  # no time has passed: it was there before the reply
    assert await enable(rig, False) == "Robot disabled, stopping motors"
    assert "\N{LARGE GREEN CIRCLE} Robot ENABLED" in said(rig, ME)


async def test_stop_wins_over_any_other_word_and_sentences_move_nothing(rig: Rig) -> None:
    await rig.start(tree())
    await enable(rig)
    commands = rig.probe(CMD_VEL)
    await say(rig, "stop going forward")
    await say(rig, "don't go forward")
    assert list(commands) == [twist()]


async def test_the_joystick_goes_before_the_voice_for_half_a_second(rig: Rig) -> None:
    await rig.start(tree())
    await enable(rig)
    commands = rig.probe(CMD_VEL)
    rig.publish(JOY_CMD, twist(0.2))
    await rig.advance(0.4)
    await say(rig, "forward")
    assert list(commands) == [twist(0.2)]
    await rig.advance(0.2)
    commands.clear()
    await say(rig, "forward")
    assert list(commands) == [twist(1.0)]


async def test_what_is_not_a_number_is_dropped_and_no_command_drives_for_ever(rig: Rig) -> None:
    await rig.start(tree())
    await enable(rig)
    commands = rig.probe(CMD_VEL)
    rig.publish(JOY_CMD, twist(nan))
    await rig.quiet()
    assert not commands
    assert len(warnings(rig, ME)) == 1
    await say(rig, "forward")
    await rig.advance(1.0)
    assert list(commands) == [twist(1.0), twist()]


# -- status -----------------------------------------------------------------------------------------------------------------


async def test_a_request_without_fields_is_answered_in_four_lines(rig: Rig) -> None:
    await rig.start(robot_status.tree())
    reply = await rig.call(robot_status.GET_STATUS, Trigger.Request())
    assert reply.success
    assert reply.message.splitlines() == [
        "Robot Status:",
        "- Battery: 85.0%",
        "- Position: x=1.5, y=2.0, z=0.0",
        "- Walking: False",
    ]
    assert said(rig, "robot_status_service") == ["Robot Status Service ready"]


async def test_the_battery_is_told_with_one_decimal(rig: Rig) -> None:
    await rig.start(Child(RobotStatusService, parameters={"battery": 83.4567}))
    reply = await rig.call(robot_status.GET_STATUS, Trigger.Request())
    assert reply.message.splitlines()[1] == "- Battery: 83.5%"


async def test_the_controller_says_that_it_is_there(rig: Rig) -> None:
    await rig.start(tree())
    assert said(rig, ME) == ["Robot Controller initialized"]


# -- three on one topic -----------------------------------------------------------------------------------------------------


async def test_the_monitor_hears_both_and_either_may_go(rig: Rig) -> None:
    system = await rig.start(velocity_trio.tree())
    monitor = rig.node(SafetyMonitor)
    await rig.advance(10.0)
    assert monitor.seen == 200
    assert system.supervisor is not None
    await system.supervisor.terminate_child("teleop")
    await rig.advance(10.0)
    assert monitor.seen == 300
    assert (rig.incarnation(Autonomy), rig.incarnation(SafetyMonitor), rig.state(Teleop).state) == (1, 1, "stopped")


async def test_the_monitor_warns_of_what_is_too_fast(rig: Rig) -> None:
    await rig.start(Child(SafetyMonitor), Child(Node, name="other"))
    for vx in (1.0, 1.1, nan):
        rig.publish(velocity_trio.CMD_VEL, twist(vx))
    await rig.quiet()
    assert warnings(rig, "safety_monitor") == [
        "Unsafe speed commanded: 1.10 m/s",
        "Unsafe speed commanded: nan m/s",
    ]
