"""Quality of service: profiles, policies, matching, events, overrides."""

import warnings

from actors import Node, QoS, Topic, qos
from actors.interfaces.std_msgs.msg import Int32
from actors.qos import (
    BEST_AVAILABLE, BEST_AVAILABLE_DURATION, SYSTEM_DEFAULT, Changes, Compatibility, Durability, History, IncompatibleQoS,
    IncompatibleType, InvalidQoS, Liveliness, LivelinessChanged, LivelinessLost, Matched, MessageLost, Overriding, Policy,
    PublisherEvent, PublisherStatus, QoSWarning, Reliability, SubscriptionEvent, SubscriptionStatus, compatible, resolve_publisher,
    resolve_service, resolve_subscription,
)
from actors.testing import Rig

# -- the profiles

assert qos.DEFAULT == qos.COMMANDS == qos.SERVICES == QoS(depth=10)  # reliable, volatile, the last ten
assert qos.SENSOR_DATA.reliability is Reliability.BEST_EFFORT and qos.SENSOR_DATA.depth == 5
assert qos.SENSOR_STREAM == qos.SENSOR_DATA.replace(depth=10)
assert qos.STATE == qos.MAP == qos.LATCHED == QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)  # late subscriptions get it, too
assert qos.CLOCK == QoS(depth=1, reliability=Reliability.BEST_EFFORT)
assert qos.LOGS == qos.CLOCK.replace(depth=20)

assert qos.PARAMETERS.depth == qos.PARAMETER_EVENTS.depth == 1000
assert qos.ROSOUT.lifespan == 10.0  # seconds: a late reader of the log gets the last ten
assert qos.ACTION_STATUS == qos.STATE and qos.ACTION_FEEDBACK == qos.TRANSITION_EVENT == qos.DEFAULT
assert qos.UNKNOWN.history is History.UNKNOWN  # of an endpoint in another program that does not tell its policies

assert qos.profile("sensor_data") == qos.SENSOR_DATA and "sensor_data" in qos.profile_names()
assert qos.of(3) == QoS(depth=3) and qos.of(qos.STATE) is qos.STATE
assert Reliability.from_key("BEST_EFFORT") is Reliability.BEST_EFFORT

everything = QoS(history=History.KEEP_ALL, limit=50)
assert QoS(history=History.KEEP_ALL).limit == qos.KEEP_ALL_LIMIT == 1000 and everything.limit == 50

try:
    QoS(depth=-1)
except InvalidQoS as error:
    print(error)

with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    QoS(depth=0)
assert all(one.category is QoSWarning for one in told)

# -- do these two match?

fine: Compatibility = compatible(offered=QoS(depth=10), requested=qos.SENSOR_DATA)
assert fine
bad = compatible(offered=qos.SENSOR_DATA, requested=qos.STATE)
assert not bad and bad.policies == ("reliability", "durability") and bad.event_policy == "DURABILITY"
print(bad.reason)
assert not compatible(QoS(depth=1, liveliness=Liveliness.AUTOMATIC), QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC))

assert resolve_subscription(BEST_AVAILABLE, offered=[qos.SENSOR_DATA]).reliability is Reliability.BEST_EFFORT
assert resolve_publisher(BEST_AVAILABLE).durability is Durability.TRANSIENT_LOCAL
assert BEST_AVAILABLE.deadline == BEST_AVAILABLE_DURATION
assert resolve_service(SYSTEM_DEFAULT).reliability is Reliability.RELIABLE

# -- what endpoints tell

BEAT = Topic(Int32, "beat", QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=1.0))


class Listener(Node):
    @BEAT.on()
    async def beat(self, message: Int32) -> None:
        await self.clock.sleep(2.5)  # so slow that messages are lost


async def test_the_totals_of_both_ends_and_what_has_changed(rig: Rig) -> None:
    await rig.start(Listener)
    subscription = rig.node(Listener).subscription(BEAT)
    before: SubscriptionStatus = subscription.status
    heart = rig.me.publisher(BEAT)
    for number in range(4):
        heart(Int32(data=number))
        await rig.quiet()
    await rig.advance(1.5)  # and then nothing for longer than the lease

    told: list[PublisherEvent] = list(heart.status.since(PublisherStatus(matched=0, matched_total=0)))
    assert told == [Matched(1, 1, 1, 1), LivelinessLost(1, 1)]
    heard: list[SubscriptionEvent] = list(subscription.status.since(before))
    assert LivelinessChanged(0, 0, 1, 1) in heard and MessageLost(2, 2) in heard


async def test_ends_that_do_not_fit_are_told_at_both(rig: Rig) -> None:
    await rig.start(Listener)
    weak = rig.me.publisher(Topic(Int32, "beat", qos.SENSOR_DATA))
    (told,) = weak.status.since(PublisherStatus(matched=0, matched_total=0))
    assert isinstance(told, IncompatibleQoS) and told.last_policy_kind == "LIVELINESS"
    assert not isinstance(told, IncompatibleType)  # which is told where two programs use another type for one topic

# -- from outside, by parameters

SCAN = Topic(Int32, "scan", qos.SENSOR_DATA.overridable("depth", "reliability"))
overriding = SCAN.qos.overriding
assert isinstance(overriding, Overriding)
parameters = overriding.parameters("/scan", "subscription", SCAN.qos)
assert parameters["depth"] == ("qos_overrides./scan.subscription.depth", 5)

quieter: Changes = {"depth": 1, "reliability": Reliability.RELIABLE}
assert SCAN.qos.replace(**quieter).depth == 1
assert all(issubclass(kind, Policy) for kind in (Reliability, Durability, History, Liveliness))
