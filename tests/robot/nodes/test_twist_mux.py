"""Who drives: voice, joystick, teleop and autonomy through the robot controller (X-07, X-07b, N-46, N-47, N-49, S-32, S-33, Y-33, Y-35)."""

from __future__ import annotations

from math import inf, nan
from pathlib import Path

import numpy as np
import pytest

from actors import Child, Node, Topic
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Pose, PoseStamped, Twist, TwistStamped
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.testing import Rig
from robot.contracts import (
    AUTONOMY_CMD,
    AUTONOMY_CMD_STAMPED,
    BATTERY_STATUS,
    CMD_VEL,
    DRIVE_STATUS,
    ENABLE,
    GAIT_STATUS,
    GET_STATUS,
    JOY_CMD,
    POSE,
    RESTORE_CONFIG,
    SAFETY_STATE,
    SAVE_CONFIG,
    SCAN,
    TELEOP_CMD,
    TELEOP_CMD_STAMPED,
    VOICE,
)
from robot.hardware.beams import MAX_RANGE, beam_angles
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus, SafetyState
from robot.nodes.status import RobotStatus
from robot.nodes.twist_mux import TUTORIAL_LIMITS, RobotController
from tests.robot.stage import said, twist


def controller(**parameters: object) -> Child:
    return Child(RobotController, parameters=parameters)


TUTORIAL = controller(enabled=True, **TUTORIAL_LIMITS)


async def speak(rig: Rig, *words: str) -> None:
    for word in words:
        rig.publish(VOICE, String(data=word))
        await rig.quiet()


# -- the tutorial's controller --------------------------------------------------------------------------------------------------


async def test_it_starts_disabled_and_a_voice_is_warned_a_joystick_is_not(rig: Rig) -> None:
    await rig.start(RobotController)
    cmd = rig.probe(CMD_VEL)
    await speak(rig, "forward")
    rig.publish(JOY_CMD, twist(0.5))
    await rig.advance(1.0)
    assert not cmd
    assert said(rig, "robot_controller") == ["Robot disabled, ignoring command"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("forward", "frente", "FORWARD", "Frente"), twist(1.0)),
        (("back", "trás", "tras", "TRÁS"), twist(-1.0)),
        (("left", "esquerda"), twist(wz=1.0)),
        (("right", "Direita"), twist(wz=-1.0)),
        (("stop", "parar", "PARAR"), twist()),
    ],
)
async def test_words_in_two_languages_become_velocities(rig: Rig, words: tuple[str, ...], expected: Twist) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    await speak(rig, *words)
    assert list(cmd) == [expected] * len(words)
    assert said(rig, "robot_controller") == [f"Executing: {word.lower()}" for word in words]


async def test_an_unknown_word_moves_nothing(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    await speak(rig, "jump", "don't go forward")
    assert not cmd
    assert said(rig, "robot_controller") == ["Unknown command: jump", "Unknown command: don't go forward"]


async def test_a_joystick_is_clipped_to_the_limits(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    rig.publish(JOY_CMD, twist(2.0, wz=-3.0))
    await rig.quiet()
    assert list(cmd) == [twist(1.0, wz=-1.0)]


async def test_a_stamped_command_drives_as_one_without_a_stamp_does_and_a_person_comes_before_autonomy(
    rig: Rig,
) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    rig.publish(AUTONOMY_CMD_STAMPED, TwistStamped(twist=twist(0.4)))
    await rig.quiet()
    rig.publish(TELEOP_CMD_STAMPED, TwistStamped(twist=twist(0.2)))
    await rig.quiet()
    rig.publish(AUTONOMY_CMD_STAMPED, TwistStamped(twist=twist(0.4)))
    await rig.quiet()
    assert list(cmd) == [twist(0.4), twist(0.2)]


async def test_enable_and_disable_answer_in_the_tutorials_words_and_the_zero_is_first(rig: Rig) -> None:
    await rig.start(RobotController)
    cmd = rig.probe(CMD_VEL)
    for _ in range(2):
        reply = await rig.call(ENABLE, SetBool.Request(data=True))
        assert (reply.success, reply.message) == (True, "Robot enabled successfully")
    assert "\N{LARGE GREEN CIRCLE} Robot ENABLED" in said(rig, "robot_controller")
    rig.publish(JOY_CMD, twist(0.5))
    await rig.quiet()
    cmd.clear()
    reply = await rig.call(ENABLE, SetBool.Request(data=False))
    assert list(cmd) == [twist()]  # before the reply returned
    assert (reply.success, reply.message) == (True, "Robot disabled, stopping motors")
    reply = await rig.call(ENABLE, SetBool.Request(data=False))
    assert (reply.success, reply.message) == (True, "Robot disabled, stopping motors")
    await rig.advance(2.0)
    assert set(map(str, cmd)) == {str(twist())}


async def test_the_parameter_enables_and_disables_as_the_service_does(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    rig.publish(JOY_CMD, twist(0.5))
    await rig.quiet()
    assert rig.node(RobotController).set_parameter("enabled", False).successful
    assert list(cmd) == [twist(0.5), twist()]


async def test_a_disabled_robot_is_still_disabled_after_a_crash_of_its_controller(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    await rig.call(ENABLE, SetBool.Request(data=False))
    cmd = rig.probe(CMD_VEL)
    rig.crash(RobotController)
    await rig.settled()
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.advance(0.5)
    assert rig.incarnation(RobotController) == 2
    assert not cmd


# -- who drives -----------------------------------------------------------------------------------------------------------------


async def test_stop_wins_over_any_other_word(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    await speak(rig, "forward", "stop going forward")
    assert list(cmd) == [twist(1.0), twist()]


async def test_a_joystick_within_half_a_second_makes_voice_ignored(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    rig.publish(JOY_CMD, twist(0.2))
    await rig.advance(0.4)
    await speak(rig, "back")
    assert list(cmd) == [twist(0.2)]
    assert said(rig, "robot_controller") == ["Command ignored: back"]
    await rig.advance(0.2)
    await speak(rig, "back")
    assert cmd.last == twist(-1.0)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
async def test_what_is_no_number_is_dropped_with_a_warning_and_counted(rig: Rig, bad: float) -> None:
    await rig.start(TUTORIAL)
    cmd, status = rig.probe(CMD_VEL), rig.probe(DRIVE_STATUS)
    rig.publish(JOY_CMD, twist(bad))
    rig.publish(JOY_CMD, twist(wz=bad))
    await rig.advance(1.0)
    assert not cmd
    assert [record.fields["dropped"] for record in rig.logs if record.level >= 30] == [1, 2]
    assert status.last is not None
    assert status.last.dropped == 2


async def test_of_four_sources_the_highest_that_was_heard_drives(rig: Rig) -> None:
    await rig.start(controller(enabled=True))
    cmd, status = rig.probe(CMD_VEL), rig.probe(DRIVE_STATUS)
    rig.publish(AUTONOMY_CMD, twist(0.1))
    await speak(rig, "forward")
    rig.publish(JOY_CMD, twist(0.3))
    rig.publish(TELEOP_CMD, twist(0.4))
    for lower in (JOY_CMD, AUTONOMY_CMD):
        rig.publish(lower, twist(0.9))
    await rig.quiet()
    assert [message.linear.x for message in cmd] == [0.1, 1.0, 0.3, 0.4]
    assert [message.source for message in status][1:] == ["autonomy", "voice", "joystick", "teleop"]


async def test_an_accepted_command_is_not_delayed_and_a_lost_source_stops_the_robot(rig: Rig) -> None:
    await rig.start(controller(enabled=True))
    cmd = rig.probe(CMD_VEL)
    for _ in range(5):
        rig.publish(AUTONOMY_CMD, twist(0.5))
        await rig.advance(0.05)
    assert cmd.times == pytest.approx([0.0, 0.05, 0.10, 0.15, 0.20])
    await rig.advance(1.0)
    assert cmd.last == twist()
    assert len(cmd) == 6  # one zero, and not before the half second is over
    assert 0.7 <= cmd.times[-1] <= 0.72


class Watcher(Node):
    """A safety monitor of the diagram: it only listens."""

    def __init__(self) -> None:
        self.seen = 0

    @CMD_VEL.on()
    def watch(self, message: Twist) -> None:
        self.seen += 1


async def test_two_publishers_and_a_monitor_on_cmd_vel_know_nothing_of_each_other(rig: Rig) -> None:
    system = await rig.start(Watcher)
    lives = [await system.join(Child(Node, name=name)) for name in ("teleop", "autonomy")]
    first, second = (joined.node.publisher(CMD_VEL) for joined in lives)
    for _ in range(100):
        first(twist(0.1))
        second(twist(0.2))
        await rig.advance(0.01)
    assert rig.node(Watcher).seen == 200
    await system.leave(lives[0])
    for _ in range(10):
        second(twist(0.2))
        await rig.advance(0.01)
    assert rig.node(Watcher).seen == 210
    assert rig.incarnation(Watcher) == 1


async def test_a_spoken_stop_holds_autonomy_back_until_a_person_drives_or_enables(rig: Rig) -> None:
    await rig.start(controller(enabled=True))
    cmd, status = rig.probe(CMD_VEL), rig.probe(DRIVE_STATUS)
    await speak(rig, "stop")

    async def autonomy(seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            rig.publish(AUTONOMY_CMD, twist(0.5))
            await rig.advance(0.05)

    await autonomy(3.0)
    assert list(cmd) == [twist()]
    assert status.last is not None
    assert status.last.reason == "held back by a spoken stop"
    await rig.call(ENABLE, SetBool.Request(data=True))
    await autonomy(0.1)
    assert cmd.last == twist(0.5)
    await speak(rig, "stop")
    rig.publish(JOY_CMD, twist(0.2))
    await autonomy(0.7)
    assert cmd.last == twist(0.5)


async def test_whatever_ends_the_controller_its_last_word_is_a_zero(rig: Rig) -> None:
    await rig.start(TUTORIAL)
    cmd = rig.probe(CMD_VEL)
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.quiet()
    rig.crash(RobotController)
    await rig.settled()
    assert list(cmd) == [twist(0.5), twist()]


# -- the safety monitor's word --------------------------------------------------------------------------------------------------


async def test_a_controller_that_needs_a_safety_monitor_stands_still_without_one(rig: Rig) -> None:
    await rig.start(controller(enabled=True, safety_timeout=0.3))
    cmd = rig.probe(CMD_VEL)
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.advance(0.1)
    assert {str(message) for message in cmd} == {str(twist())}
    rig.publish(SAFETY_STATE, SafetyState())
    await rig.quiet()
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.quiet()
    assert cmd.last == twist(0.5)
    await rig.advance(0.32)
    assert cmd.last == twist()  # the monitor has died: it stops by itself, long before the command times out
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.advance(0.1)
    assert cmd.last == twist()


async def test_a_monitor_that_hangs_and_repeats_itself_counts_as_silent(rig: Rig) -> None:
    await rig.start(controller(enabled=True, safety_timeout=0.3))
    cmd = rig.probe(CMD_VEL)
    word = SafetyState(stamp=Time(sec=5))
    for _ in range(10):
        rig.publish(SAFETY_STATE, word)
        rig.publish(TELEOP_CMD, twist(0.5))
        await rig.advance(0.05)
    assert twist(0.5) in list(cmd)[:4]
    assert cmd.last == twist()
    rig.publish(SAFETY_STATE, SafetyState(stamp=Time(sec=6)))
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.quiet()
    assert cmd.last == twist(0.5)
    rig.publish(SAFETY_STATE, SafetyState(stamp=Time(sec=1), stopped=True, reasons=("a clock that was set back",)))
    await rig.quiet()
    assert cmd.last == twist()


async def test_a_stop_is_a_zero_at_the_same_instant_and_overrides_teleop(rig: Rig) -> None:
    await rig.start(controller(enabled=True))
    cmd = rig.probe(CMD_VEL)
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.quiet()
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("tilt",)))
    await rig.quiet()
    assert list(cmd) == [twist(0.5), twist()]
    rig.publish(TELEOP_CMD, twist(0.5))
    await speak(rig, "forward")
    await rig.advance(1.0)
    assert {str(message) for message in list(cmd)[1:]} == {str(twist())}
    assert len(cmd) > 50  # it insists: who publishes beside it is not obeyed
    assert "Command ignored: forward" in said(rig, "robot_controller")
    rig.publish(SAFETY_STATE, SafetyState())
    await rig.advance(0.1)
    assert cmd.last == twist()  # nothing from before moves it
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.quiet()
    assert cmd.last == twist(0.5)


# -- status and settings --------------------------------------------------------------------------------------------------------


async def test_the_status_has_four_lines_in_their_order(rig: Rig) -> None:
    await rig.start(RobotStatus)
    reply = await rig.call(GET_STATUS, Trigger.Request())
    assert reply.message.splitlines()[1:] == ["- Battery: unknown", "- Position: unknown", "- Walking: unknown"]
    rig.publish(BATTERY_STATUS, BatteryStatus(percent=85.0))
    pose = Pose(position=PoseStamped().pose.position.replace(x=1.5, y=2.0))
    rig.publish(POSE, PoseStamped(pose=pose))
    rig.publish(GAIT_STATUS, GaitStatus(mode="stand"))
    await rig.quiet()
    reply = await rig.call(GET_STATUS, Trigger.Request())
    assert reply.success
    assert reply.message.splitlines() == [
        "Robot Status:",
        "- Battery: 85.0%",
        "- Position: x=1.5, y=2.0, z=0.0",
        "- Walking: False",
    ]
    rig.publish(GAIT_STATUS, GaitStatus(mode="walk"))
    await rig.quiet()
    assert (await rig.call(GET_STATUS, Trigger.Request())).message.endswith("- Walking: True")


async def test_settings_are_saved_and_restored(rig: Rig, tmp_path: Path) -> None:
    file = tmp_path / "config.yaml"
    await rig.start(Child(RobotStatus, parameters={"config_file": str(file)}), controller(enabled=True, timeout=0.4))
    reply = await rig.call(SAVE_CONFIG, Trigger.Request())
    assert reply.success, reply.message
    before = file.read_text(encoding="utf-8")
    await rig.call(ENABLE, SetBool.Request(data=False))
    reply = await rig.call(RESTORE_CONFIG, Trigger.Request())
    assert reply.success, reply.message
    assert reply.message.startswith("1 parameters restored")
    assert rig.node(RobotController).enabled
    await rig.call(SAVE_CONFIG, Trigger.Request())
    assert file.read_text(encoding="utf-8") == before


async def test_what_cannot_be_saved_or_restored_is_answered_with_the_reason(rig: Rig, tmp_path: Path) -> None:
    file = tmp_path / "no" / "config.yaml"
    await rig.start(Child(RobotStatus, parameters={"config_file": str(file)}), controller(timeout=0.4))
    for service in (SAVE_CONFIG, RESTORE_CONFIG):
        reply = await rig.call(service, Trigger.Request())
        assert not reply.success
        assert "config.yaml" in reply.message
    file.parent.mkdir()
    file.write_text("/robot_controller:\n  ros__parameters:\n    timeout: 0.7\n    enabled: true\n", encoding="utf-8")
    reply = await rig.call(RESTORE_CONFIG, Trigger.Request())
    assert not reply.success
    assert "/robot_controller timeout: " in reply.message
    assert rig.node(RobotController).enabled


# -- the guard ------------------------------------------------------------------------------------------------------------------


def wall_ahead(metres: float) -> LaserScan:
    """A wall across the way, so far ahead of the robot's middle."""
    angles = beam_angles()
    ahead = np.cos(angles) > 0.1
    ranges = np.where(ahead, metres / np.where(ahead, np.cos(angles), 1.0), MAX_RANGE)
    return LaserScan(ranges=np.minimum(ranges, MAX_RANGE).astype(np.float32))


async def test_a_person_who_drives_is_slowed_down_before_what_is_seen_and_told_so_autonomy_is_not(rig: Rig) -> None:
    await rig.start(controller(enabled=True))
    cmd, status = rig.probe(CMD_VEL), rig.probe(DRIVE_STATUS)

    async def told(source: Topic[Twist]) -> float:
        rig.publish(source, twist(1.0))
        await rig.quiet()
        assert cmd.last is not None
        return cmd.last.linear.x

    assert await told(TELEOP_CMD) == 1.0, "without a LiDAR there is nothing to go by"
    rig.publish(SCAN, wall_ahead(5.0))
    assert await told(TELEOP_CMD) == 1.0
    rig.publish(SCAN, wall_ahead(1.2))
    await rig.quiet()
    assert cmd.last is not None
    assert 0.1 < cmd.last.linear.x < 0.9, "the command in force is slowed down as soon as the wall is seen"
    rig.publish(SCAN, wall_ahead(0.65))
    assert await told(TELEOP_CMD) == 0.0
    assert status.last is not None
    assert "something stands in the way" in status.last.reason
    assert sum("guard false" in event for event in said(rig, "robot_controller")) == 1
    await rig.advance(0.4)
    rig.publish(SCAN, wall_ahead(0.65))
    await rig.advance(0.2)
    assert await told(AUTONOMY_CMD) == 1.0
    rig.node(RobotController).set_parameter("guard", False)
    assert await told(TELEOP_CMD) == 1.0
