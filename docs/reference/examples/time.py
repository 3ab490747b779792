"""Time: instants of several clocks, timers, rates, jumps of the clock, `/clock`."""

from actors import Child, Node, background
from actors.typing import Clock, Rate, Timer
from actors.interfaces.builtin_interfaces.msg import Time as Stamp
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.nodes import CLOCK, ClockPublisher
from actors.testing import Rig
from actors.time import ClockChange, ClockType, Duration, JumpHandle, JumpThreshold, SecNanosec, Time, TimeJump, nanoseconds_of, stamp_of

# -- instants and spans

start = Time(seconds=7, clock_type=ClockType.ROS_TIME)
assert (start + Duration(seconds=0.5)) - start == Duration(nanoseconds=500_000_000)
assert Time.from_msg(start.to_msg()) == start
stamp: SecNanosec = stamp_of(7_500_000_000)
assert stamp == Stamp(sec=7, nanosec=500_000_000) and nanoseconds_of(stamp) == 7_500_000_000
try:
    print(start - Time(seconds=7, clock_type=ClockType.STEADY_TIME))
except TypeError as error:
    print(error)

# -- timers and rates at run time, and jumps of the clock

class Blinker(Node):
    """Blinks by a timer of its own, counts in a loop, and notes when its clock jumps."""

    async def on_start(self) -> None:
        self.blinks = self.rounds = 0
        self.jumps: list[TimeJump] = []
        self.timer: Timer = self.create_timer(0.5, self.blink)
        back = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1))
        self.handle: JumpHandle = self.on_jump(back, post=self.jumps.append)

    def blink(self) -> None:
        self.blinks += 1

    @background
    async def count(self) -> None:
        rate: Rate = self.create_rate(4)
        while True:
            await rate.sleep()
            self.rounds += 1


async def test_a_timer_is_stopped_and_started_again(rig: Rig) -> None:
    await rig.start(Blinker)
    blinker = rig.node(Blinker)
    clock: Clock = blinker.clock
    await rig.advance(2.1)
    assert (blinker.blinks, blinker.rounds) == (4, 8) and round(clock.now(), 1) == 2.1
    blinker.timer.cancel()
    await rig.advance(1.0)
    blinker.timer.reset()
    await rig.advance(0.6)
    assert blinker.blinks == 5 and not blinker.timer.canceled


async def test_a_jump_back_is_told_with_its_size_and_its_cause(rig: Rig) -> None:
    await rig.start(Child(Blinker, parameters={"use_sim_time": True}))
    blinker = rig.node(Blinker)
    for seconds in (10, 4):
        rig.publish(CLOCK, ClockMessage(clock=Stamp(sec=seconds)))
        await rig.quiet()
    (jump,) = [one for one in blinker.jumps if not one.source_changed]
    assert jump.delta == Duration(seconds=-6) and jump.clock_change is ClockChange.ROS_TIME_NO_CHANGE
    blinker.handle.remove()

async def test_the_clock_is_told_as_often_as_asked(rig: Rig) -> None:
    await rig.start(Child(ClockPublisher, args=(10.0,)))
    told = rig.probe(CLOCK)
    await rig.advance(1.05)
    assert len(told) == 10 and told.newest.clock == Stamp(sec=1)
