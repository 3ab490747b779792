"""The safety monitor: stops the robot when a command, an estimate or another node violates a limit."""

from __future__ import annotations

from math import acos, degrees, hypot, isfinite

from actors import ActorError, Node, Service, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.std_srvs.srv import (
    SetBool,
    SetBool_Request,
    SetBool_Response,
    Trigger,
    Trigger_Request,
    Trigger_Response,
)
from actors.time import nanoseconds_of, stamp_of
from robot.contracts import (
    BATTERY_STATUS,
    CMD_VEL,
    EMERGENCY_STOP,
    GAIT_STATUS,
    ODOMETRY,
    SAFETY_STATE,
    SENSOR_DATA,
    SIT,
    STAND,
)
from robot.control.stop_causes import StopLatch, how_to_go_on
from robot.geometry.messages import is_pose
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus, SafetyState
from robot.interfaces.tutorials.my_robot_interfaces.msg import SensorData
from robot.model.charge import ChargeLevel
from robot.model.modes import Mode

RATE = 20.0
JUMP = 1_000_000_000
"""ns; a clock that goes back by more has been set."""
ROUNDING = 1e-6
TILTING = 10
"""So many odometry messages in a row (0.2 s) must say so: an estimate that has just begun, on a robot that has just been put down, is no fall."""
SETTLING = 0.1
"""Seconds after a stop in which commands from before it may still arrive."""


class SafetyMonitor(Node):
    """Publishes safety/state (20 Hz, and at once when it changes); serves emergency_stop. Takes cmd_vel, odom, gait_status, battery_status,
    sensor_data.

    It stops the robot when it is asked to, by the service or by `emergency_stop` in sensor_data; when it tilts too far; when the gait
    controller or the odometry falls silent, once heard; when the gait has had no sensors for `sensor_timeout`; when a command on cmd_vel is
    no number or beyond the limits; and while the battery is critical. The last ends by itself, at 3 points more of charge. The
    others end only by emergency_stop with data false, and only when their cause is gone, which it then says; a stop outlives a crash of this
    node.

    The stop itself is the robot controller's work, who obeys safety/state, and stops too when it is silent. A stopped robot does not
    step in place either: it is asked to stand. If it moves all the same, tilts, or has no charge left, it is sat down.
    """

    state = publishes(SAFETY_STATE)
    max_tilt = parameter(0.87, unit="rad", ge=0.1, le=3.2, description="Of the body's z axis from the vertical.")
    silence = parameter(0.5, unit="s", ge=0.1, le=10.0, description="For how long gait and odometry may be silent.")
    sensor_timeout = parameter(2.0, unit="s", ge=0.1, le=60.0, description="How long the gait may go without sensors.")
    max_forward = parameter(1.6, unit="m/s", ge=0.0, le=3.0, description="A faster command on cmd_vel stops the robot.")
    max_backward = parameter(0.5, unit="m/s", ge=0.0, le=3.0, description="The same, backward.")
    max_sideways = parameter(0.4, unit="m/s", ge=0.0, le=3.0, description="The same, to either side.")
    max_turn = parameter(1.5, unit="rad/s", ge=0.0, le=6.0, description="The same, turning either way.")
    braking_time = parameter(
        1.5, unit="s", ge=0.1, le=10.0, description="A stopped robot that still moves after so long is sat down."
    )
    still_speed = parameter(0.15, unit="m/s", ge=0.02, le=1.0, description="What counts as moving then.")

    def __init__(self) -> None:
        self._latch = StopLatch()

    def resume(self, state: tuple[tuple[str, str], ...]) -> None:
        self._latch = StopLatch(state)

    async def on_start(self) -> None:
        self._since = self.clock.now()
        self._quiet = {"gait_status": -1, "odom": -1}
        self._blind = self._stamped = 0
        self._tilted = 0
        self._sitting = self._asking = self._said = False
        self._publish()

    # -- inputs ----------------------------------------------------------------------------------------------------

    @SENSOR_DATA.on()
    def sensors(self, message: SensorData) -> None:
        self._judge("sensor_data", message.emergency_stop, "emergency stop in /sensor_data")

    @CMD_VEL.on()
    def command(self, message: Twist) -> None:
        vx, vy, wz = message.linear.x, message.linear.y, message.angular.z
        finite = isfinite(vx) and isfinite(vy) and isfinite(wz)
        within = (
            -self.max_backward - ROUNDING <= vx <= self.max_forward + ROUNDING
            and abs(vy) <= self.max_sideways + ROUNDING
            and abs(wz) <= self.max_turn + ROUNDING
        )
        text = f"velocity command beyond the limits: {vx:.2f} m/s, {vy:.2f} m/s, {wz:.2f} rad/s"
        self._judge("cmd_vel", not (finite and within), text if finite else "velocity command that is not a number")
        late = self._latch.stopped and self.clock.now() - self._since > SETTLING
        if late and (vx, vy, wz) != (0.0, 0.0, 0.0):
            self._sit("somebody drives the stopped robot")

    @ODOMETRY.on(qos=1)
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        self._quiet["odom"] = 0
        q, v = message.pose.pose.orientation, message.twist.twist.linear
        tilt = acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q.x * q.x + q.y * q.y))))
        self._tilted = self._tilted + 1 if tilt > self.max_tilt else 0
        tilted = self._tilted >= TILTING
        self._judge("tilt", tilted, f"the body tilts by {degrees(tilt):.0f} degrees")
        if tilted:
            self._sit("the robot tilts")
        elif (
            self._latch.stopped
            and self.clock.now() - self._since > self.braking_time
            and hypot(v.x, v.y) > self.still_speed
        ):
            self._sit("the stopped robot moves")

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._quiet["gait_status"] = 0
        self._blind = 0 if message.sensors_ok else max(self._blind, 1)
        if self._latch.stopped and message.goal == Mode.WALK and not self._asking:
            self._ask(STAND)

    @BATTERY_STATUS.on()
    def battery(self, message: BatteryStatus) -> None:
        text = f"battery critical ({message.percent:.0f} %)"
        critical = message.level == ChargeLevel.CRITICAL
        self._judge("battery", critical, text, latched=False)
        if critical and not message.charging:
            self._sit("the battery is critical")

    @every(hz=RATE)
    def watch(self) -> None:
        """Detect silence. It is counted in ticks: a loop that was blocked skips ticks, and has not received anything meanwhile either."""
        for topic, ticks in self._quiet.items():
            if ticks >= 0:  # who has never been heard is not missed
                self._quiet[topic] = ticks + 1
                self._judge(topic, ticks + 1 > self.silence * RATE, f"/{topic} is silent")
        if self._blind:
            self._blind += 1
        self._judge("sensors", self._blind > self.sensor_timeout * RATE, "the gait has no sensors")
        self._publish()

    @EMERGENCY_STOP.serve()
    async def emergency_stop(self, request: SetBool_Request) -> SetBool_Response:
        """True stops the robot; false clears the stop, which is refused with the reasons while a cause persists."""
        if request.data:
            self._judge("request", True, "emergency stop requested")
            self._judge("request", False, "")
            return SetBool.Response(success=True, message=f"Emergency stop: {'; '.join(self._latch.reasons)}")
        if not self._latch.stopped:
            return SetBool.Response(success=True, message="There is no emergency stop to clear")
        cleared = self._latch.clear()
        self._changed()
        if cleared:
            self.log.info("emergency stop cleared")
            return SetBool.Response(success=True, message="Emergency stop cleared")
        left = "; ".join(self._latch.present)
        return SetBool.Response(success=False, message=f"Emergency stop not cleared: {left}")

    # -- what comes of it ---------------------------------------------------------------------------------------------------

    def _judge(self, key: str, wrong: bool, text: str, *, latched: bool = True) -> None:
        if not wrong:
            if self._latch.end(key):
                self.log.info("stop ended", cause=key, left="; ".join(self._latch.reasons))
                self._changed()
            if self._latch.stopped and not self._latch.present and not self._said:
                self._said = True
                self.log.warning(f"nothing holds the stop any more: {how_to_go_on('give the robot a goal or a mode')}")
            return
        first = not self._latch.stopped
        if self._latch.begin(key, text, latched=latched):
            if first:
                self._since = self.clock.now()
                self._sitting = False
            self._said = False
            self.log.error("safety stop", why=text)
            self._changed()

    def _changed(self) -> None:
        self.checkpoint(self._latch.kept)
        self._publish()

    def _publish(self) -> None:
        """Publish with a stamp that grows strictly, also within one instant, so that receivers know which message is the newest."""
        latch, stamp = self._latch, self.clock.stamp()
        now = nanoseconds_of(stamp)
        if self._stamped - JUMP < now <= self._stamped:
            now = self._stamped + 1
        self._stamped = now
        stamp = stamp_of(now)
        self.state(SafetyState(stamp=stamp, stopped=latch.stopped, reasons=latch.reasons, present=latch.present))

    def _sit(self, why: str) -> None:
        """Ask the gait to sit, once for each stop."""
        if not self._sitting:
            self._sitting = True
            self.log.error("sitting down", why=why)
            self._ask(SIT)

    def _ask(self, posture: Service[Trigger_Request, Trigger_Response]) -> None:
        self._asking = True
        self.create_task(self._asked(posture))

    async def _asked(self, posture: Service[Trigger_Request, Trigger_Response]) -> None:
        try:
            await self.call(posture, Trigger.Request())
        except ActorError as error:  # a gait that is away drives no motors, and these sit down by themselves
            self.log.error("the gait does not answer", asked=posture.name, why=str(error))
        finally:
            self._asking = False
