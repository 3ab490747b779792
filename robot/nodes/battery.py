"""The battery node: reads the pack's gauge, estimates charge and run time, and publishes both."""

from __future__ import annotations

from math import inf, nan

from actors import Node, every, parameter, publishes
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import BATTERY_STATE, BATTERY_STATUS, GET_BATTERY_STATUS, MOTOR_POWER
from robot.estimation.battery_gauge import BatteryGauge, UnknownRobot
from robot.estimation.battery_levels import LevelMonitor
from robot.estimation.battery_runtime import RuntimeEstimator
from robot.hardware.battery import PackState, SupplyStatus
from robot.hardware.devices import BatteryDevice
from robot.interfaces.robactor_msgs.msg import BatteryStatus, MotorPower
from robot.interfaces.tutorials.my_robot_interfaces.srv import (
    GetBatteryStatus,
    GetBatteryStatus_Request,
    GetBatteryStatus_Response,
)
from robot.model.charge import CRITICAL, ChargeLevel
from robot.model.power import electrical_power
from robot.model.robot import SPOT, RobotModel


class Battery(Node):
    """Reads the pack's gauge. Publishes battery_state and battery_status at 1 Hz; serves get_battery_status.

    An empty pack cuts the drives off until it is charged, and the robot sinks; its computers go on. The pack is the robot's hardware, so it is
    handed in and outlives this node. Parameters: robot_id.
    """

    state = publishes(BATTERY_STATE)
    judgement = publishes(BATTERY_STATUS)
    robot_id = parameter(
        "robot_01", read_only=True, description="Whose battery this is; requests for another robot are refused."
    )

    def __init__(self, pack: BatteryDevice, model: RobotModel = SPOT) -> None:
        self._pack, self._model = pack, model
        self._levels = LevelMonitor()
        self._runtime = RuntimeEstimator(pack.design)
        self._motors = 0.0
        self._charger = False
        self._cut_off = False
        self._stepped = 0.0

    def resume(self, state: tuple[tuple[ChargeLevel, float], tuple[float, ...], bool]) -> None:
        levels, pack, self._cut_off = state
        self._levels = LevelMonitor(levels)
        self._pack.restore(pack)  # only a process that was restarted has made it again

    async def on_start(self) -> None:
        self._gauge = BatteryGauge((self.robot_id,))
        self._stepped = self.clock.now()
        self._report()

    @MOTOR_POWER.on()
    def load(self, message: MotorPower) -> None:
        """Advance the pack by the energy that the motors took since the last message (10 Hz)."""
        if not 0.0 <= message.mean < inf:
            return
        self._motors, self._charger = message.mean, message.charger
        now = self.clock.now()
        dt, self._stepped = now - self._stepped, now
        power = electrical_power(self._motors, model=self._model)
        state = self._pack.step(dt, power, self._charger)
        self._runtime.update(dt, power)
        self._connect(state)
        before = self._levels.level
        level = self._levels.update(dt, state)
        if level is not before:
            say = self.log.warning if level is not ChargeLevel.GOOD else self.log.info
            say("battery level", level=level.value, percent=round(state.percent, 1), gauge="coulomb count")
            self._report()

    @every(hz=1)
    def report(self) -> None:
        self._report()

    @GET_BATTERY_STATUS.serve()
    async def status(self, request: GetBatteryStatus_Request) -> GetBatteryStatus_Response:
        """Answer with the tutorials' voltage gauge; for another robot's id no figures, and a `health_status` that says so."""
        self.log.info(f"Battery status requested for: {request.robot_id}")
        try:
            reading = self._gauge.read(request.robot_id, self._pack.state.gauge_voltage, is_charging=self._charging)
        except UnknownRobot as error:
            self.log.warning("battery of an unknown robot asked for", error=str(error))
            return GetBatteryStatus.Response(
                voltage=nan, percentage=nan, estimated_runtime_minutes=nan, health_status=str(error)
            )
        self.log.info(f"Response: {reading.voltage:.1f}V ({reading.percentage:.0f}%)")
        return GetBatteryStatus.Response(
            voltage=reading.voltage,
            percentage=reading.percentage,
            estimated_runtime_minutes=reading.estimated_runtime_minutes,
            health_status=reading.health_status,
            is_charging=reading.is_charging,
        )

    def _connect(self, state: PackState) -> None:
        """Cut the drives off when the pack does not carry its load any more. A voltage that recovers then does not bring them back: a charger does."""
        if not state.supplied and not self._cut_off:
            self._cut_off = True
            self.log.error("battery empty: the drives have no current", percent=round(state.percent, 1))
        elif self._cut_off and state.supplied and self._charger:
            self._cut_off = False
            self.log.info("charger: the drives have current again")
        else:
            return
        self._report()

    @property
    def _charging(self) -> bool:
        return self._pack.state.status in (SupplyStatus.CHARGING, SupplyStatus.FULL)

    def _report(self) -> None:
        self.checkpoint((self._levels.kept, self._pack.kept, self._cut_off))
        state = self._pack.state
        self.state(
            BatteryState(
                header=Header(stamp=self.clock.stamp(), frame_id="base_link"),
                voltage=state.voltage,
                temperature=state.temperature,
                current=state.current,
                charge=state.charge,
                capacity=state.capacity,
                design_capacity=self._pack.design.design_capacity,
                percentage=state.soc,
                power_supply_status=int(state.status),
                power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_GOOD,
                power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
                present=True,
                location="body",
                serial_number=self._pack.serial_number,
            )
        )
        self.judgement(
            BatteryStatus(
                stamp=self.clock.stamp(),
                level=self._levels.level.value,
                percent=state.percent,
                runtime=self._runtime.seconds(state),
                mean_load=self._runtime.load.watts,
                energy=self._runtime.energy_above(CRITICAL, state),
                charging=self._charging,
                supply=0.0 if self._cut_off else state.voltage / self._pack.design.nominal_voltage,
            )
        )
