"""The robot controller, a twist multiplexer: the one publisher of /cmd_vel, and the switch that lets commands through."""

from __future__ import annotations

from types import MappingProxyType

from actors import ExitReason, Node, every, parameter, publishes
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Twist, TwistStamped, Vector3
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool, SetBool_Request, SetBool_Response
from actors.time import nanoseconds_of
from robot.contracts import (
    AUTONOMY_CMD,
    AUTONOMY_CMD_STAMPED,
    CMD_VEL,
    DRIVE_STATUS,
    ENABLE,
    JOY_CMD,
    SAFETY_STATE,
    SCAN,
    TELEOP_CMD,
    TELEOP_CMD_STAMPED,
    VOICE,
)
from robot.control.twist_mux import Decision, Source, TwistMux, VelocityLimits, Verdict
from robot.geometry.planar import ZERO_TWIST, Twist2
from robot.interfaces.robactor_msgs.msg import DriveStatus, SafetyState
from robot.model.footprint import Footprint
from robot.model.robot import SPOT, RobotModel
from robot.navigation.guard import Guard
from robot.nodes.voice import interpret

RATE = 50.0
"""Looks per second at what has timed out. Commands wait for none of them: they are passed on as they come."""
TUTORIAL_LIMITS = MappingProxyType({"max_forward": 1.0, "max_backward": 1.0, "max_sideways": 1.0, "max_turn": 1.0})
"""Parameters for the tutorials' 1.0 m/s and 1.0 rad/s in every direction."""
JUMP = 1_000_000_000
"""A stamp of /safety/state that is older than the last one by more than this, ns, is of a clock that has been set back."""
GUARDED = (Source.TELEOP, Source.JOYSTICK, Source.VOICE)
"""The guarded sources: persons, who may not look."""
SEEN = 0.5
"""Seconds for which a scan tells what is there: five of them."""
SLOWED = "slowed down: something stands in the way"
SILENT = "the safety monitor is silent"


class RobotController(Node):
    """Passes on the commands of the source that drives: teleop before joystick before voice before autonomy, each for `timeout` seconds.

    Takes teleop/cmd_vel, joy/cmd_vel, voice_command, autonomy/cmd_vel, teleop/cmd_vel_stamped, autonomy/cmd_vel_stamped, safety/state,
    lidar/scan; publishes cmd_vel, drive_status; serves robot/enable.

    An accepted command is published at once, in the handler that hears it. When the last one has timed out, when the robot is disabled and
    when the safety monitor stops it, one zero goes out in the same way, and under a stop 50 more every second, so that nobody who
    publishes beside this node is obeyed. Whether it is enabled outlives a crash of the node.

    With `guard` a person who drives is slowed down, and stopped short of what the LiDAR sees; drive_status says so. Autonomy looks for itself.

    With `safety_timeout` above 0 the robot stands still as long as no safety monitor has been heard for that time, from the start on.
    """

    cmd = publishes(CMD_VEL)
    status = publishes(DRIVE_STATUS)
    enabled = parameter(False, description="Whether commands are let through; /robot/enable sets it too.")
    timeout = parameter(0.5, unit="s", ge=0.05, le=5.0, read_only=True, description="How long a command is valid.")
    max_forward = parameter(1.6, unit="m/s", ge=0.0, le=3.0, read_only=True, description="Commands are clipped to it.")
    max_backward = parameter(0.5, unit="m/s", ge=0.0, le=3.0, read_only=True, description="The same, backward.")
    max_sideways = parameter(0.4, unit="m/s", ge=0.0, le=3.0, read_only=True, description="The same, to either side.")
    max_turn = parameter(1.5, unit="rad/s", ge=0.0, le=6.0, read_only=True, description="The same, turning either way.")
    safety_timeout = parameter(
        0.0,
        unit="s",
        ge=0.0,
        le=5.0,
        read_only=True,
        description="Stop when /safety/state is silent so long; 0: never.",
    )

    guard = parameter(
        True,
        description="Slow teleop, joystick and voice down, and stop short of what the LiDAR sees; false: drive on into it.",
    )

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._model = model
        self._kept: bool | None = None
        self._starting = True

    def resume(self, state: bool) -> None:
        self._kept = state

    async def on_start(self) -> None:
        limits = VelocityLimits(self.max_forward, self.max_backward, self.max_sideways, self.max_turn)
        if self._kept is not None:
            self.set_parameter("enabled", self._kept)
        self._mux = TwistMux(limits, timeout=self.timeout, enabled=self.enabled)
        self._sent = ZERO_TWIST
        self._guard, self._slowed = Guard(Footprint.of(self._model)), ""
        self._shown: tuple[bool, str, str] | None = None
        self._ticks = self._unheard = 0
        self._alone = False
        self._safety_stamp = 0
        if self.safety_timeout > 0.0:
            self._mux.stop(SILENT)
        self._starting = False
        self._show()

    async def on_stop(self, reason: ExitReason) -> None:
        """Whatever ends this node, the last word to the legs is a zero."""
        self._mux.stop("the robot controller ends")
        if self._sent != ZERO_TWIST:
            self._drive()

    # -- commands -----------------------------------------------------------------------------------------------------------

    @TELEOP_CMD.on()
    def teleop(self, message: Twist) -> None:
        self._offer(Source.TELEOP, message)

    @TELEOP_CMD_STAMPED.on()
    def teleop_stamped(self, message: TwistStamped) -> None:
        self._offer(Source.TELEOP, message.twist)

    @JOY_CMD.on()
    def joystick(self, message: Twist) -> None:
        self._offer(Source.JOYSTICK, message)

    @AUTONOMY_CMD.on()
    def autonomy(self, message: Twist) -> None:
        self._offer(Source.AUTONOMY, message)

    @AUTONOMY_CMD_STAMPED.on()
    def autonomy_stamped(self, message: TwistStamped) -> None:
        self._offer(Source.AUTONOMY, message.twist)

    @VOICE.on()
    def voice(self, message: String) -> None:
        """One spoken command; the tutorial's words are answered in the tutorial's words."""
        if not self.enabled:
            self.log.warning("Robot disabled, ignoring command")
            return
        spoken = message.data.strip().lower()
        velocity = interpret(spoken)
        if velocity is None:
            self.log.warning(f"Unknown command: {spoken}")
            return
        verdict = self._mux.offer(Source.VOICE, velocity, self.clock.now())
        if verdict is Verdict.ACCEPTED:
            self.log.info(f"Executing: {spoken}")
            self._drive()
        else:
            why = self._mux.stopped or f"{self._mux.decide(self.clock.now()).reason} drives"
            self.log.warning(f"Command ignored: {spoken}", why=why)

    def _offer(self, source: Source, message: Twist) -> None:
        velocity = Twist2(message.linear.x, message.linear.y, message.angular.z)
        verdict = self._mux.offer(source, velocity, self.clock.now())
        if verdict is Verdict.ACCEPTED:
            self._drive()
        elif verdict is Verdict.NOT_A_NUMBER:
            dropped = self._mux.dropped[source]
            self.log.warning("velocity command is not a number: dropped", source=source.name.lower(), dropped=dropped)

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        """What is seen now holds for the command in force, too."""
        now = self.clock.now()
        self._guard.see(now, message.ranges.astype(float))
        decision = self._mux.decide(now)
        if decision.source in GUARDED and decision.velocity != ZERO_TWIST:
            self._drive()

    # -- what stops it ------------------------------------------------------------------------------------------------------

    @ENABLE.serve()
    async def enable(self, request: SetBool_Request) -> SetBool_Response:
        """Let commands through, or none: then the zero is out before the answer is."""
        result = self.set_parameter("enabled", request.data)
        if not result.successful:
            return SetBool.Response(success=False, message=result.reason)
        text = "Robot enabled successfully" if request.data else "Robot disabled, stopping motors"
        return SetBool.Response(success=True, message=text)

    @enabled.changed
    def _switched(self, enabled: bool) -> None:
        if self._starting:  # what the last life left, taken over without a word
            return
        self.checkpoint(enabled)
        if enabled:
            self._mux.enable()
            self.log.info("\N{LARGE GREEN CIRCLE} Robot ENABLED")
            self._show()
        else:
            self._mux.disable()
            self.log.info("\N{LARGE RED CIRCLE} Robot DISABLED")
            self._drive()

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        if self._is_old(message.stamp):
            return  # overtaken by a newer one, or said again by something that hangs: nobody has looked at the robot since
        self._unheard, self._alone = 0, False
        if message.stopped:
            self._stop("; ".join(message.reasons))
        elif self._mux.stopped is not None:
            self._mux.clear()
            self._show()

    def _is_old(self, stamp: Time) -> bool:
        said, newest = nanoseconds_of(stamp), self._safety_stamp
        if newest - JUMP < said <= newest and said > 0:
            return True
        self._safety_stamp = said
        return False

    @every(hz=RATE)
    def watch(self) -> None:
        """Notice what has timed out, and insist on a stop."""
        # Silence is counted in ticks: a loop that was held up has skipped them, and has not heard the monitor either.
        self._unheard += 1
        if self.safety_timeout > 0.0 and self._unheard > self.safety_timeout * RATE:
            if not self._alone:
                self._alone = True
                self.log.warning(f"{SILENT}: standing still until it is heard", topic=SAFETY_STATE.name)
            self._stop(SILENT)
        if self._mux.stopped is not None or (
            self._sent != ZERO_TWIST and self._mux.decide(self.clock.now()).source is None
        ):
            self._drive()
        self._ticks += 1
        if self._ticks % RATE == 0:
            self._shown = None
        self._show()

    def _stop(self, reason: str) -> None:
        if self._mux.stopped != reason:
            self._mux.clear()
            self._mux.stop(reason)
            self._drive()

    # -- what comes of it ---------------------------------------------------------------------------------------------------

    def _drive(self) -> None:
        """Tell the legs what is decided now."""
        self._sent = velocity = self._guarded(self._mux.decide(self.clock.now()))
        self.cmd(Twist(linear=Vector3(x=velocity.vx, y=velocity.vy), angular=Vector3(z=velocity.wz)))
        self._show()

    def _guarded(self, decision: Decision) -> Twist2:
        """The velocity of a decision, as far as what is seen allows a person to drive."""
        before, self._slowed = self._slowed, ""
        if not self.guard or decision.source not in GUARDED or self._guard.age(self.clock.now()) > SEEN:
            return decision.velocity
        velocity, room = self._guard.limit(decision.velocity)
        if velocity != decision.velocity:
            self._slowed = SLOWED
            if not before:
                self.log.warning(f"{SLOWED}; set {self.fqn} guard false to drive on", room=round(room, 2))
        return velocity

    def _show(self) -> None:
        """Publish who drives, if that has changed."""
        decision = self._mux.decide(self.clock.now())
        source = decision.source.name.lower() if decision.source is not None else ""
        reason = f"{decision.reason}, {self._slowed}" if source and self._slowed else decision.reason
        shown = (self._mux.enabled, source, reason)
        if shown == self._shown:
            return
        self._shown = shown
        self.status(
            DriveStatus(
                stamp=self.clock.stamp(),
                enabled=self._mux.enabled,
                source=source,
                reason=reason,
                dropped=sum(self._mux.dropped.values()),
            )
        )
