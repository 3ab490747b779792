"""The motor node: the last to stop, and the last to act when everything above it has failed.

It owns the body's drives. While targets keep coming it passes them on; 50 ms after the last one, whatever has become of the gait
controller or its supervisor, it sits the robot down by itself. When it is stopped it does the same, and only then ends.

It follows the newest life of who commands it, on whatever machine that is: what an older life sends, however late, is refused. Targets that are no
numbers, or that no drive can follow, are none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors import ExitReason, Node, every, publishes
from actors.supervision import Stopped
from robot.contracts import BATTERY_STATUS, BODY_DRIVE, MOTOR_POWER, MOTOR_TARGETS
from robot.control.safe_stop import SafeStop
from robot.hardware import body as hardware
from robot.hardware.real_time import RealTime
from robot.interfaces.robactor_msgs.msg import BatteryStatus, BodyDrive, MotorPower
from robot.interfaces.robactor_msgs.msg import MotorTargets as MotorTargetsMessage
from robot.link.fence import Fence
from robot.model.actuators import SILENCE
from robot.model.kinematics import feet
from robot.model.modes import Mode
from robot.model.robot import SPOT, RobotModel

if TYPE_CHECKING:
    from robot.hardware.body import Hardware
    from robot.hardware.devices import ChargerDevice

RATE = 200.0
PERIOD = 1.0 / RATE
LONGEST = 0.02
"""Seconds for which one step of a safe stop may count: what is later than that is held up, and its robot goes on from where it is."""
SAFE_STOP_SECONDS = 3.4
"""How long a stop of the node may take to sit the robot down."""
STEPPING_SIT_SECONDS = 2.4
"""The same for a body that steps by itself and sits at its own pace."""
FOLDED, RESTING = 0.005, 0.5
"""A body sits when its feet are no farther below the hips than this above the sitting pose, m, and no joint is faster, rad/s."""
LOOKS = 10
"""Steps of a stop from one look to the next whether such a body sits."""


MOST = 1e4
"""What no target reaches, rad, rad/s, N m, N m/rad or N m s/rad."""


class Motors(Node):
    """Drives the 12 joints of `body`, and reads the contacts of the charger, if there is one.

    Takes motor_targets (or body_drive) and battery_status; publishes motor_power at 10 Hz."""

    power = publishes(MOTOR_POWER)

    def __init__(self, body: Hardware, charger: ChargerDevice | None = None, model: RobotModel = SPOT) -> None:
        self._body, self._charger, self._model = body, charger, model
        self._stepping = body if isinstance(body, hardware.SteppingHardware) else None
        self._safe: SafeStop | None = None
        self._fence = Fence()
        self._heard = self._drove = 0.0
        self._energy = 0.0
        self._counted = 0

    def resume(self, state: int) -> None:
        self._fence = Fence(state)

    async def on_start(self) -> None:
        # The robot lies in its sitting pose: silence before the first target is no reason for a safe stop.
        self._heard = -1.0
        self._real_time = RealTime()
        self._drove = self.clock.now()

    @every(hz=RATE)
    def drive(self) -> None:
        """Advance the body, count the energy, and sit down when the targets stop."""
        now = self.clock.now()
        self._body.advance(now)
        self._energy += self._body.power
        self._counted += 1
        if self._heard >= 0.0 and now - self._heard > SILENCE:
            self._sit_down(PERIOD if self._safe is None else min(now - self._drove, LONGEST))
        self._drove = now

    @every(hz=10)
    def measure(self) -> None:
        """Report the mean electrical power since the last report."""
        mean = self._energy / self._counted if self._counted else 0.0
        self._energy, self._counted = 0.0, 0
        drives = self._body.actuators()
        if (warning := self._real_time.look()) is not None:
            self.log.warning(warning[0], **warning[1])
        self.power(
            MotorPower(
                stamp=self.clock.stamp(),
                mean=mean,
                charger=self._charger is not None and self._charger.connected,
                refused=self._fence.refused,
                supplied=drives.supplied,
                temperature=drives.temperature,
                torque_left=drives.left,
                real_time_factor=self._real_time.factor,
            )
        )

    @BATTERY_STATUS.on()
    def supply(self, message: BatteryStatus) -> None:
        """What the battery gives the drives; without a battery that says so, its nominal voltage."""
        self._body.supply(message.supply)

    @MOTOR_TARGETS.on()
    def follow(self, message: MotorTargetsMessage) -> None:
        targets = hardware.MotorTargets(message.position, message.velocity, message.effort, message.kp, message.kd)
        if not (self._can_be(targets) and self._admits(message.fence)):
            return
        self._listen()
        self._body.command(targets)

    @BODY_DRIVE.on()
    def follow_drive(self, message: BodyDrive) -> None:
        if self._stepping is None or not (self._can_be_driven(message) and self._admits(message.fence)):
            return
        self._listen()
        self._stepping.drive(message.vx, message.vy, message.wz, message.height, message.mode)

    async def on_stop(self, reason: ExitReason) -> None:
        """Brake and sit, then let go. After a failure of this node itself its next life, or the drives, take over."""
        if not isinstance(reason, Stopped):
            return
        self.log.info("stopping: braking and sitting down")
        self._safe = self._safe or SafeStop(self._model)
        seconds = SAFE_STOP_SECONDS if self._stepping is None else STEPPING_SIT_SECONDS
        begun = self.clock.now()
        tick = 0
        while self.clock.now() - begun < seconds:
            tick += 1
            await self.clock.sleep_until(begun + tick / RATE)
            self._body.advance(self.clock.now())
            self._sit_down(PERIOD)
            if self._safe.done if self._stepping is None else tick % LOOKS == 0 and self._folded():
                return

    def _can_be(self, targets: hardware.MotorTargets) -> bool:
        """Whether drives can follow these targets; what they cannot follow counts as silence, and is reported once."""
        parts = (targets.position, targets.velocity, targets.effort, targets.kp, targets.kd)
        if (
            all(abs(part).max() < MOST for part in parts) and targets.kp.min() >= 0.0 and targets.kd.min() >= 0.0
        ):  # false for NaN, too
            return True
        self.log.error("motor targets that are no numbers, or that no drive can follow: dropped", once=True)
        return False

    def _can_be_driven(self, message: BodyDrive) -> bool:
        values = (message.vx, message.vy, message.wz, message.height)
        if all(-MOST < value < MOST for value in values) and message.mode in tuple(Mode):
            return True
        self.log.error("a velocity or a mode that no body can follow: dropped", once=True, mode=message.mode[:20])
        return False

    def _admits(self, token: int) -> bool:
        """Whether a command with this token counts; the first one that does not is reported, all are counted."""
        newest = self._fence.newest
        if not self._fence.admits(token, self.clock.now()):
            self.log.warning(
                "commands of an older life are refused", once=True, token=f"{token:x}", newest=f"{newest:x}"
            )
            return False
        if token < newest:
            self.log.warning(
                "the newest life is silent: an older one is followed", token=f"{token:x}", newest=f"{newest:x}"
            )
        if token != newest:
            self.checkpoint(token)  # the next life of this node has to know it before the first command comes
        return True

    def _listen(self) -> None:
        now = self.clock.now()
        self._body.advance(now)
        self._heard = now
        if self._safe is not None:
            self.log.info("targets again: the safe stop is over")
            self._safe = None

    def _sit_down(self, dt: float) -> None:
        if self._safe is None:
            self._safe = SafeStop(self._model)
            self.log.warning(
                "no motor targets: sitting down", silence=round(self.clock.now() - max(self._heard, 0.0), 3)
            )
        if self._stepping is not None:
            self._stepping.drive(0.0, 0.0, 0.0, self._model.sit_height, Mode.SIT)
        else:
            self._body.command(self._safe.step(dt, self._body.joints(), self._body.imu()))

    def _folded(self) -> bool:
        """Whether the joints say that the robot sits."""
        joints = self._body.joints()
        deep = -feet(joints.position, self._model)[:, 2].min()
        return bool(deep < self._model.sit_height + FOLDED and abs(joints.velocity).max() < RESTING)
