"""Testing: several hosts, checks of a tree, flight records."""

import pytest

from actors import Child, Node, Supervisor, Topic, check_tree, every, publishes
from actors.bag import Channel, Entry, FlightRecord, FlightRecorder, Source, Trace
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_msgs.msg import String
from actors.testing import Conditions, Lab, Rig
from actors.typing import LinkView

CHARGE = Topic(BatteryState, "charge")
ALARM = Topic(String, "alarm")


class Guard(Node):
    """Raises alarm once a second while the charge is low."""

    alarm = publishes(ALARM)

    async def on_start(self) -> None:
        self.low = False

    @CHARGE.on()
    def charge(self, message: BatteryState) -> None:
        self.low = message.percentage < 0.2

    @every(hz=1)
    def cry(self) -> None:
        if self.low:
            self.alarm(String(data="battery low"))

# -- several hosts

async def test_an_alarm_is_away_while_the_link_is_cut_and_comes_back(lab: Lab) -> None:
    await lab.start("house", Guard)
    desk = await lab.start("desk")
    alarms = desk.probe(ALARM)
    await lab.advance(1.0)
    desk.publish(CHARGE, BatteryState(percentage=0.1))
    await lab.advance(5.5)
    assert len(alarms) == 5
    link: LinkView = desk.system.snapshot().links[0]
    assert link.host == "house" and link.received_bytes > 0

    lab.cut("house", "desk")
    await lab.advance(10.0)
    assert len(alarms) == 5

    lab.heal("house", "desk")
    await lab.advance(3.1)
    assert len(alarms) >= 7

RADIO = Conditions(delay=0.02, loss=0.1, bandwidth=125_000.0)


@pytest.mark.virtual
async def test_over_the_radio_alarms_are_late_and_none_is_missing() -> None:
    lab = Lab(conditions=RADIO)
    await lab.start("house", Guard)
    desk = await lab.start("desk")
    alarms = desk.probe(ALARM)
    await lab.advance(1.0)
    desk.publish(CHARGE, BatteryState(percentage=0.1))
    await lab.advance(10.0)
    assert len(alarms) in (9, 10) and all(time % 1.0 >= RADIO.delay for time in alarms.times)
    await lab.close()

# -- look at a tree before it runs

class Siren(Node):
    """Sounds when it hears of an alarm."""

    @Topic(String, "alrm").on()
    def sound(self, message: String) -> None:
        self.log.info("siren", why=message.data)


(finding,) = check_tree(Supervisor("home", Guard, Siren), external=["/charge"])
assert str(finding) == (
    "warning: home/siren: it takes /alrm, which nobody publishes; publish it, remap it, or name it as external; did you mean '/alarm'?"
)

# -- flight records

async def test_an_observer_sees_all_of_it(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(seconds=10.0))
    trace = rig.observe(Trace())
    await rig.start(Guard, seed=1)
    rig.publish(CHARGE, BatteryState(percentage=0.1))
    await rig.advance(60.0)
    assert trace.messages == 61
    assert len(trace.hexdigest()) == 64  # the same for the same seed, in every process
    record = recorder.freeze()  # record.write("guard.mcap") makes the file; recorder.dump("guard.mcap") does both
    assert len(record.entries) == 11

def alarms_in(record: FlightRecord) -> list[tuple[float, str]]:
    found: list[tuple[float, str]] = []
    for entry in record.entries:
        source: Source = entry.source
        channel: Channel = source.channel
        if channel.type is String:
            found.append((entry.at, source.node))
    return found


async def test_the_record_says_who_cried_and_when(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(seconds=2.5))
    await rig.start(Guard)
    rig.publish(CHARGE, BatteryState(percentage=0.1))
    await rig.advance(10.25)
    assert alarms_in(recorder.freeze()) == [(8.0, "/guard"), (9.0, "/guard"), (10.0, "/guard")]
    newest: Entry = recorder.freeze().entries[-1]
    assert newest.message == String(data="battery low")
