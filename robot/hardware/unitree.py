"""A Unitree Go2 as `Hardware`: its legs and its battery. `robot.hardware.unitree_link` finds it on a network."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import pairwise
from typing import Final

import numpy as np

from robot.hardware.battery import PackState, SupplyStatus
from robot.hardware.body import (
    ActuatorState,
    BodySilent,
    Capabilities,
    Hardware,
    ImuSample,
    JointSample,
    MotorTargets,
    Sample,
)
from robot.hardware.devices import BatteryDevice
from robot.hardware.overdue import merged
from robot.hardware.unitree_wire import JOINTS, FootContacts, command_of, damping, sample_of
from robot.interfaces.unitree.unitree_go.msg import LowCmd, LowState
from robot.model.battery import PackDesign
from robot.model.bodies import GO2

SILENT: Final = 0.2
"""Seconds without a state after which the robot counts as lost."""
UNCOMMANDED: Final = 0.1
"""Seconds without targets after which the drives only brake."""
TURN: Final = 0.02
"""What one step of a caller counts of a silence at most, s: a caller that was held up has heard nothing in between."""
PERIOD: Final = 0.005
"""Between two commands to brake, s."""
KEPT: Final = 100
"""States that wait: those of 0.2 s."""


class Go2(Hardware):
    """The legs of one Go2. Without `send` its motors are never commanded.

    Its drives only brake from the start to the first targets, when no targets have come for 0.1 s, and from the moment when it is lost: no state
    for 0.2 s, or somebody else (`others` counts them) commands it too. Once lost it stays so, and whatever reads raises `BodySilent`.
    """

    def __init__(
        self, first: LowState, send: Callable[[LowCmd], object] | None = None, others: Callable[[], int] = lambda: 0
    ) -> None:
        self._send, self._others = send, others
        self._time = self._sampled = self._braked = 0.0
        self._commanded = -1.0
        self._silent, self._hz = 0.0, 0.0
        self._feet, self._feels = FootContacts(), any(first.foot_force)
        self._arrived: deque[LowState] = deque(maxlen=KEPT)
        self._gathered: list[Sample] = []
        """Since the last sample was due."""
        self._waiting: deque[Sample] = deque(maxlen=40)
        self.lost = ""
        """Why it is lost; empty while it is not."""
        self.state = self.arrived = first
        """The newest that has been taken in, and that has arrived."""
        self.told: LowCmd | None = None
        """The newest command."""
        self.received = self.sent = 0
        """States and commands so far."""
        newest = sample_of(first, 0.0, self._feet)
        if newest is None:
            raise BodySilent("the Go2 sends states that hold no numbers")
        self._newest = newest

    def take(self, state: LowState) -> None:
        """A state has arrived."""
        self.received += 1
        self.arrived = state
        self._arrived.append(state)

    @property
    def time(self) -> float:
        return self._time

    @property
    def capabilities(self) -> Capabilities:
        """One whose feet read nothing at all at first, as in its maker's simulator, does not feel the ground: it walks by schedule."""
        return Capabilities(contacts=self._feels)

    def advance(self, until: float) -> None:
        self._silent += min(max(until - self._time, 0.0), TURN)
        self._time = until
        if self._arrived:
            self._measure(until)
        if not self.lost and self._silent > SILENT:
            self.lost = f"the Go2 has not been heard for {SILENT} s: its drives brake"
        if not self.lost and self._send is not None and self._others():
            self.lost = "another program has begun to command the Go2 (it writes rt/lowcmd): its drives brake"
        if (self.lost or until - self._commanded > UNCOMMANDED) and until - self._braked >= PERIOD:
            self.brake()

    def _measure(self, until: float) -> None:
        """Take in the states since the last time, which came evenly between."""
        states, since = list(self._arrived), max(self._newest.time, until - KEPT * 0.002)
        self._arrived.clear()
        times = since + (until - since) * np.arange(1, len(states) + 1) / len(states)
        fresh = [
            one for state, at in zip(states, times.tolist(), strict=True) if (one := sample_of(state, at, self._feet))
        ]
        if not fresh:
            return
        self.state, self._newest, self._silent = states[-1], fresh[-1], 0.0
        if self._hz <= 0.0:
            return
        self._gathered += fresh
        whole = min(int((until - self._sampled) * self._hz + 1e-6), len(self._gathered))
        if whole > 0:
            bounds = np.linspace(0, len(self._gathered), whole + 1).astype(int).tolist()
            self._waiting += [merged(self._gathered[a:b]) for a, b in pairwise(bounds)]
            self._gathered, self._sampled = [], max(self._sampled + whole / self._hz, until - 1.0 / self._hz)

    def command(self, targets: MotorTargets) -> None:
        if not self.lost:
            self._commanded = self._time
            self._put(command_of(targets, GO2))

    def brake(self) -> None:
        """Have all drives only brake."""
        self._braked = self._time
        self._put(damping())

    def _put(self, command: LowCmd) -> None:
        if self._send is not None:
            self.sent, self.told = self.sent + 1, command
            self._send(command)

    def actuators(self) -> ActuatorState:
        heat = np.array([motor.temperature for motor in self.state.motor_state[:12]], dtype=np.float64)[JOINTS]
        return ActuatorState(supplied=True, temperature=heat, left=1.0)

    def sample(self, hz: float) -> None:
        self._hz, self._sampled = hz, self._time
        self._gathered.clear()
        self._waiting.clear()

    def next_sample(self) -> Sample | None:
        self._check()
        return self._waiting.popleft() if self._waiting else None

    def imu(self) -> ImuSample:
        self._check()
        return self._newest.imu

    def joints(self) -> JointSample:
        self._check()
        return self._newest.joints

    def _check(self) -> None:
        if self.lost:
            raise BodySilent(self.lost)


PACK: Final = PackDesign(series_cells=8, energy_wh=236.8)


class Go2Battery(BatteryDevice):
    """What the battery of the same robot reports. One that reports nothing, as in a simulator, counts as full."""

    @property
    def design(self) -> PackDesign:
        return PACK

    def __init__(self, robot: Go2) -> None:
        self._robot = robot

    @property
    def state(self) -> PackState:
        pack, design = self._robot.state.bms_state, self.design
        volts = sum(pack.cell_vol) / 1e3
        there = volts > 0.0
        soc = min(pack.soc / 100.0, 1.0) if there else 1.0
        status = SupplyStatus.CHARGING if pack.current > 0 else SupplyStatus.DISCHARGING
        return PackState(
            voltage=volts if there else design.nominal_voltage,
            current=pack.current / 1e3,
            charge=soc * design.design_capacity,
            capacity=design.design_capacity,
            temperature=float(max(pack.bq_ntc)) if there else 25.0,
            soc=soc,
            status=status if there else SupplyStatus.UNKNOWN,
            supplied=True,
            cells=design.series_cells,
        )

    def step(self, dt: float, power_w: float, charging: bool = False) -> PackState:
        return self.state
