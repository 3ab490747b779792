"""Diagnostics: a task that wraps another, and scans that must not be too old."""


from actors import Node, Service, Topic
from actors.diagnostics import DIAGNOSTICS, Status, Task, TimeStampStatus, Updater
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.testing import Rig

ADD = Service(AddTwoInts, "add")


def named(task: Task, unit: str) -> Task:
    """The task, with the number of the unit that it is about."""

    def fill(status: Status) -> None:
        task(status)
        status.add("unit", unit)

    return fill


class Lidar(Node):
    async def on_start(self) -> None:
        self.age = TimeStampStatus(self.clock, low=0.0, high=0.5)
        self.updater = Updater(self)
        self.updater.add("age", named(self.age, "L-7"))

    @Topic(LaserScan, "scan").on()
    def scan(self, message: LaserScan) -> None:
        self.age.tick(message.header.stamp)


async def test_an_old_scan_is_an_error(rig: Rig) -> None:
    await rig.start(Lidar)
    seen = rig.probe(DIAGNOSTICS)
    await rig.advance(10.25)
    rig.publish(Topic(LaserScan, "scan"), LaserScan())  # of the time 0
    await rig.advance(1.0)
    (status,) = seen.newest.status
    assert status.level == status.ERROR and ("unit", "L-7") in [(one.key, one.value) for one in status.values]
