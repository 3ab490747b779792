"""What a robot may have besides its legs, each a device with a driver of its own; a node takes one and publishes what it measures.

A node calls `advance` before it reads or commands a device. Nothing may block: all is called from one thread, an event loop's. Devices of one
simulated robot are those of `robot.sim.devices`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats
from robot.hardware.lens import HEIGHT, WIDTH
from robot.model.robot import SPOT, RobotModel

if TYPE_CHECKING:
    from robot.hardware.arm import ArmDevice
    from robot.hardware.battery import PackState
    from robot.hardware.body import Hardware, Sweep
    from robot.model.battery import PackDesign


class Device(Protocol):
    """One device of one robot."""

    def advance(self, until: float) -> None:
        """Take in what has happened up to `until`, the caller's present, s; by default nothing is to be done."""
        return


class BatteryDevice(Protocol):
    """The gauge of a battery pack."""

    @property
    def design(self) -> PackDesign:
        """How the pack is built."""
        ...

    @property
    def state(self) -> PackState:
        """What the gauge reported last."""
        ...

    @property
    def serial_number(self) -> str:
        """Of the pack; empty where it has none to report."""
        return ""

    def step(self, dt: float, power_w: float, charging: bool = False) -> PackState:
        """What the gauge reports now, `dt` seconds after the last time; in between the robot took `power_w` W, and hung on its charger or not.

        A gauge measures, and needs none of the three; a simulated pack is emptied by them.
        """
        ...

    @property
    def kept(self) -> tuple[float, ...]:
        """What the device of a restarted process needs to go on; by default nothing."""
        return ()

    def restore(self, kept: tuple[float, ...]) -> None:
        """Go on from what another life has `kept`; by default nothing is to be done."""
        return


class ChargerDevice(Device, Protocol):
    """The contacts of a charging station."""

    @property
    def connected(self) -> bool:
        """Whether they are closed."""
        ...


class LidarDevice(Device, Protocol):
    """A planar LiDAR with `robot.hardware.beams.BEAMS` beams over the whole circle."""

    @property
    def fixed(self) -> bool:
        """Whether it is fixed to the body and turns: its revolutions take time, and are corrected for the body's motion.

        If not, it hangs in a gimbal that keeps it level, and takes all beams at once.
        """
        ...

    @property
    def bias(self) -> float:
        """By how much all ranges are too long, as far as is known, m."""
        return 0.0

    def scan(self) -> Sweep | None:
        """The newest whole revolution; `None` before the first. The first call sets a LiDAR that turns going."""
        ...


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture: both arrays flat and read-only, as image messages take them without a copy."""

    rgb: NDArray[np.uint8]
    """HEIGHT x WIDTH x 3 bytes."""
    depth: NDArray[np.uint8]
    """HEIGHT x WIDTH little-endian uint16: depth along the optical axis, mm; 0 is none."""

    def pixels(self) -> NDArray[np.uint8]:
        """The colours, shape (HEIGHT, WIDTH, 3)."""
        return self.rgb.reshape(HEIGHT, WIDTH, 3)

    def millimetres(self) -> NDArray[np.uint16]:
        """The depths, shape (HEIGHT, WIDTH)."""
        return self.depth.view("<u2").reshape(HEIGHT, WIDTH)


class CameraDevice(Device, Protocol):
    """A camera that measures depth as well, with the lens of `robot.hardware.lens`."""

    def look(self) -> Frame:
        """The newest picture."""
        ...


class DepthDevice(Device, Protocol):
    """The depth cameras that are fixed to the trunk (`robot.hardware.depth`)."""

    @property
    def latency(self) -> float:
        """For so long a picture is held back, s, to be as late as a camera's are; 0 by default, as real ones are late by themselves."""
        return 0.0

    def points(self) -> Floats | None:
        """The newest picture of all cameras as points in `base_link`, m, shape (n, 3), in an order that is always the same; NaN where there is no
        depth. `None` if there is no new one."""
        ...


@dataclass(frozen=True, slots=True)
class Equipment:
    """One robot: its legs and battery, and what else it has. A robot without a LiDAR walks by velocity commands, and does not navigate."""

    hardware: Hardware
    battery: BatteryDevice
    charger: ChargerDevice | None = None
    lidar: LidarDevice | None = None
    camera: CameraDevice | None = None
    depth: DepthDevice | None = None
    arm: ArmDevice | None = None
    model: RobotModel = SPOT
    """The figures of its body."""
