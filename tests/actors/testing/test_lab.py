"""`Lab`: several hosts on the virtual clock, joined by a network that a test can break and mend."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, Topic, background, every, publishes, qos
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String
from actors.testing import Lab, Leak, UnexpectedFailure
from tests.stage import ADD, total, two
from tests.suites import run_pytest

COUNT = Topic(Int32, "count", 100)
MODE = Topic(String, "mode", qos.LATCHED)


class Counter(Node):
    """Counts ten times a second."""

    count = publishes(COUNT)

    async def on_start(self) -> None:
        self.so_far = 0

    @every(hz=10)
    def tick(self) -> None:
        self.so_far += 1
        self.count(Int32(data=self.so_far))


class Adder(Node):
    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)


class Speaker(Node):
    mode = publishes(MODE)

    async def on_start(self) -> None:
        self.mode(String(data="manual"))


async def test_what_a_node_on_one_host_publishes_is_recorded_on_another(lab: Lab) -> None:
    await lab.start("robot", Counter)
    desk = await lab.start("desk")
    counts = desk.probe(COUNT)
    await lab.advance(2.0)
    assert [message.data for message in counts] == list(range(1, 20)), "the twentieth is on its way"


async def test_a_service_of_another_host_is_called_and_is_away_while_the_link_is_cut(lab: Lab) -> None:
    await lab.start("robot", Adder)
    desk = await lab.start("desk")
    await lab.advance(0.1)
    assert await desk.call(ADD, two(1, 2)) == total(3)
    lab.cut("robot", "desk")
    await lab.advance(3.0)
    with pytest.raises(Exception, match="/add"):
        await desk.call(ADD, two(1, 2), timeout=1.0)
    lab.heal("robot", "desk")
    await lab.advance(0.1)
    assert await desk.call(ADD, two(3, 4)) == total(7)


async def test_a_link_cut_in_one_direction_stops_that_direction_at_once(lab: Lab) -> None:
    robot = await lab.start("robot", Counter)
    desk = await lab.start("desk")
    counts, modes = desk.probe(COUNT), robot.probe(MODE)
    await lab.advance(1.0)
    seen = len(counts)
    lab.cut("robot", "desk", one_way=True)
    desk.publish(MODE, String(data="auto"))
    await lab.advance(1.0)
    assert len(counts) <= seen + 1
    assert [message.data for message in modes] == ["auto"]


async def test_what_is_latched_arrives_after_a_long_cut(lab: Lab) -> None:
    await lab.start("robot", Speaker)
    desk = await lab.start("desk")
    lab.cut("robot", "desk")
    modes = desk.probe(MODE)
    await lab.advance(10.0)
    assert not modes
    lab.heal("robot", "desk")
    await lab.advance(0.2)
    assert [message.data for message in modes] == ["manual"]


async def test_an_impaired_link_is_late_until_it_is_healed(lab: Lab) -> None:
    await lab.start("robot", Counter)
    desk = await lab.start("desk")
    await lab.advance(0.5)
    lab.impair("robot", "desk", delay=0.25)
    counts = desk.probe(COUNT)
    await lab.advance(2.04)
    late = [time - message.data / 10.0 for time, message in zip(counts.times, counts, strict=True)]
    lab.heal("robot", "desk")
    await lab.advance(1.0)
    prompt = counts.times[-1] - counts.newest.data / 10.0
    assert late[-1] == pytest.approx(0.25, abs=0.01)
    assert prompt == pytest.approx(0.0, abs=0.01)


async def test_one_direction_of_a_link_can_be_impaired_alone(lab: Lab) -> None:
    robot = await lab.start("robot")
    desk = await lab.start("desk")
    there, back = desk.probe(COUNT), robot.probe(MODE)
    await lab.advance(0.5)
    lab.impair("robot", "desk", one_way=True, delay=0.5)
    robot.publish(COUNT, Int32(data=1))
    desk.publish(MODE, String(data="auto"))
    await lab.advance(0.1)
    assert (len(there), len(back)) == (0, 1)
    await lab.advance(0.5)
    assert len(there) == 1


async def test_a_host_that_crashes_is_silent_and_a_reboot_starts_its_tree_again(lab: Lab) -> None:
    before = await lab.start("robot", Counter)
    desk = await lab.start("desk")
    counts = desk.probe(COUNT)
    await lab.advance(1.0)
    lab.crash("robot")
    assert not lab.is_up("robot")
    await lab.advance(5.0)
    seen = len(counts)
    assert seen <= 10
    assert not before.system.running

    after = await lab.reboot("robot")
    await lab.advance(1.0)

    assert lab.is_up("robot")
    assert lab["robot"] is after is not before
    assert counts.newest.data in (9, 10), "it counts from the beginning"
    assert after.incarnation(Counter) == 1


async def test_to_reboot_a_host_that_is_up_changes_nothing_and_a_crash_may_come_twice(lab: Lab) -> None:
    robot = await lab.start("robot", Counter)
    assert await lab.reboot("robot") is robot
    lab.crash("robot")
    lab.crash("robot")
    await lab.advance(1.0)
    assert robot.system.killed


async def test_the_time_of_day_is_the_same_on_all_hosts_but_for_their_offsets(lab: Lab) -> None:
    await lab.start("robot", Counter, clock_offset=5.0)
    await lab.start("desk")
    await lab.advance(10.0)
    lab.crash("robot")
    lab.shift_clock("robot", 1.0)
    await lab.reboot("robot")
    await lab.advance(1.0)
    lab.shift_clock("desk", -2.0)
    clocks = {host: lab[host].system.clock.wall() for host in lab.hosts}
    assert clocks == pytest.approx({"robot": 17.0, "desk": 9.0})


async def test_clients_of_a_router_reach_nobody_while_it_is_gone(lab: Lab) -> None:
    await lab.start("desk", router=True)
    await lab.start("robot", Counter, mode="client")
    counts = lab["desk"].probe(COUNT)
    await lab.advance(1.0)
    lab.stop_router()
    await lab.advance(1.0)
    seen = len(counts)
    lab.start_router()
    await lab.advance(1.0)
    assert lab.has_router
    assert 0 < seen <= 11
    assert len(counts) >= seen + 8


async def test_recover_ends_everything_that_is_wrong(lab: Lab) -> None:
    await lab.start("desk", router=True)
    await lab.start("robot", Counter)
    await lab.start("base", Counter, mode="client")
    counts = lab["desk"].probe(COUNT)
    await lab.advance(1.0)
    lab.cut("robot", "desk")
    lab.impair("base", "desk", loss=0.9)
    lab.crash("base")
    lab.stop_router()
    await lab.advance(5.0)
    await lab.recover()
    seen = len(counts)
    await lab.advance(1.05)
    assert len(counts) >= seen + 18
    await lab.recover()
    assert lab.recovered_at == pytest.approx(6.0), "the first time counts"


async def test_until_waits_for_a_condition_and_says_what_was_logged_when_it_does_not_come(lab: Lab) -> None:
    await lab.start("robot", Counter)
    desk = await lab.start("desk")
    counts = desk.probe(COUNT)
    await lab.until(lambda: len(counts) == 3, within=1.0)
    lab["robot"].me.log.warning("look at me")
    with pytest.raises(AssertionError, match=r"not true within 0.5 s(.|\n)*look at me.* host=robot"):
        await lab.until(lambda: False, within=0.5)


class Faulty(Node):
    @background
    async def fail(self) -> None:
        await self.clock.sleep(1.0)
        raise OSError("bus error")


async def test_a_node_that_fails_on_any_host_fails_the_test(lab: Lab) -> None:
    await lab.start("desk")
    await lab.start("robot", Faulty)
    with pytest.raises(UnexpectedFailure, match="bus error"):
        await lab.advance(1.5)
    lab["robot"].expect_failure(OSError)
    await lab.advance(2.0)


@pytest.mark.virtual
async def test_what_one_host_has_left_over_fails_the_test_at_its_end() -> None:
    lab = Lab()
    await lab.start("robot", Counter)
    await lab.start("desk")
    stray = asyncio.create_task(asyncio.sleep(1e6), name="stray")
    with pytest.raises(Leak, match="task stray"):
        await lab.close()
    stray.cancel()


@pytest.mark.virtual
async def test_a_reboot_that_fails_is_raised_at_the_end() -> None:
    starts: list[int] = []

    class Once(Node):
        async def on_start(self) -> None:
            starts.append(1)
            if len(starts) > 1:
                raise OSError("no bus any more")

    lab = Lab()
    await lab.start("robot", Child(Once, restart="temporary"))
    lab.crash("robot")
    await lab.quiet()
    lab.reboot_soon("robot")
    with pytest.raises(Exception, match="no bus any more"):
        await lab.close()


async def test_an_unknown_host_is_named_with_the_one_that_was_meant(lab: Lab) -> None:
    await lab.start("robot")
    with pytest.raises(LookupError, match=r"there is no host 'robto'.*'robot'"):
        lab["robto"]
    with pytest.raises(ValueError, match="there is a host 'robot' already"):
        await lab.start("robot")


async def test_without_virtual_time_there_is_no_lab() -> None:
    with pytest.raises(RuntimeError, match="a Lab needs the virtual clock: use the `lab` fixture"):
        Lab()


def test_the_report_of_a_failed_test_shows_the_log_of_all_hosts(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        from actors import Node

        async def test_two_hosts(lab):
            await lab.start("robot", Node)
            desk = await lab.start("desk")
            desk.me.log.info("here I am")
            assert False, "as is meant"
        """
    )
    result = run_pytest(pytester)
    result.assert_outcomes(failed=1)
    result.stdout.re_match_lines([".* lab -+", "lab: seed=0 .*log lines:"])
    result.stdout.fnmatch_lines(["*here I am* host=desk"])
