"""What must not be lost, over a link that loses: reliable brings it, and takes its time."""

from __future__ import annotations

from actors import Node, Topic, every, publishes, qos
from actors.interfaces.std_msgs.msg import Float64
from actors.testing import Lab, Probe

CRITICAL = Topic(Float64, "/critical_data", qos.COMMANDS)
TELEMETRY = Topic(Float64, "/telemetry", qos.SENSOR_DATA)
HZ = 20
SECONDS = 30


class Plant(Node):
    """Publishes the time on both topics, for as long as `SECONDS`."""

    critical = publishes(CRITICAL)
    telemetry = publishes(TELEMETRY)

    @every(hz=HZ)
    def tell(self) -> None:
        if self.clock.now() < SECONDS:
            self.critical(Float64(data=self.clock.now()))
            self.telemetry(Float64(data=self.clock.now()))


def ages(probe: Probe[Float64]) -> list[float]:
    """How old each message was when it came, s."""
    return [at - message.data for at, message in zip(probe.times, probe.messages, strict=True)]


async def test_critical_data_arrives_whole_over_a_link_that_loses_a_fifth_and_late_where_it_was_sent_again(
    lab: Lab,
) -> None:
    await lab.start("plant", Plant)
    desk = await lab.start("desk")
    critical, telemetry = desk.probe(CRITICAL), desk.probe(TELEMETRY)
    await lab.advance(1.0)
    lab.impair("plant", "desk", loss=0.2)
    await lab.advance(SECONDS)

    sent = [round(message.data * HZ) for message in critical]
    assert sent == list(range(sent[0], sent[0] + len(sent)))  # every one, in order
    assert sent[-1] == SECONDS * HZ - 1
    assert 0.7 * len(sent) < len(telemetry) < 0.9 * len(sent)
    assert max(ages(critical)) > 10 * max(ages(telemetry))  # what a message that is sent again costs


def test_the_profile_is_reliable_and_keeps_ten() -> None:
    assert repr(CRITICAL.qos) == "QoS(keep_last 10, reliable, volatile)"
