"""In a Rig, children on other machines run on simulated ones, which can be cut off and crashed."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import (
    Child,
    DeclarationError,
    DynamicSupervisor,
    ExitReason,
    Intensity,
    Node,
    StartFailed,
    Supervisor,
    Topic,
    every,
    publishes,
)
from actors.checks import create
from actors.errors import NotStarted, ProcessDied
from actors.hosts import HostLost
from actors.hosts.messages import Hello
from actors.hosts.simulated import SimulatedHosts
from actors.interfaces.std_msgs.msg import UInt64
from actors.logs import LogRecord
from actors.runtime.placement import Placement
from actors.testing import Rig
from actors.transport.simulated.network import Network
from tests.actors.hosts.kit import placement
from tests.actors.supervision.kit import virtual

SAID = Topic(UInt64, "said")


class Talker(Node):
    """Counts, and leaves its count to its next life."""

    out = publishes(SAID)

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    def resume(self, state: Any) -> None:
        self.count = state

    @every(hz=10)
    def tick(self) -> None:
        self.count += 1
        self.checkpoint(self.count)
        self.out(UInt64(data=self.fencing_token))
        if self.count == 3:
            self.log.info("has counted to three")

    async def on_stop(self, reason: ExitReason) -> None:
        self.log.info("stopping", why=str(reason))


class Late(Node):
    """Does not end when it is asked to."""

    async def on_stop(self, reason: ExitReason) -> None:
        await asyncio.sleep(1000.0)


class Hearer(Node):
    async def on_start(self) -> None:
        self.heard: list[tuple[float, int]] = []

    @SAID.on()
    def hear(self, message: UInt64) -> None:
        self.heard.append((self.clock.now(), message.data))


def tree(*hosts: str, **options: Any) -> Supervisor:
    away = Child(Talker, hosts=hosts, **options)
    return Supervisor("top", intensity=Intensity(10, within=100.0), children=[Child(Hearer), away])


def heard(rig: Rig) -> list[tuple[float, int]]:
    return rig.node(Hearer).heard


def token(number: int, incarnation: int) -> int:
    """That of this life in the first run of a tree."""
    return Placement(1, number).token(incarnation)


def lines(rig: Rig, event: str) -> list[LogRecord]:
    return [line for line in rig.logs if line.event == event]


async def test_a_child_runs_on_the_first_of_its_machines_and_is_heard_as_if_it_were_here(rig: Rig) -> None:
    await rig.start(tree("base", "spare"))
    await rig.advance(1.0)

    assert {token for _, token in heard(rig)} == {token(1, 1)}
    assert rig.state("talker").state == "running"
    assert [line.node for line in lines(rig, "has counted to three")] == ["/talker"]
    assert abs(lines(rig, "has counted to three")[0].time - 0.35) < 0.15  # in the time of this machine


async def test_a_machine_that_is_lost_is_a_child_that_died_and_the_spare_acts_within_the_lease_and_a_second(
    rig: Rig,
) -> None:
    await rig.start(tree("base", "spare"))
    await rig.advance(1.0)

    rig.hosts.cut("base")
    cut = rig.now
    with rig.expect_failure(HostLost, node="talker", match="host base is lost: its lease of 3 s was not renewed"):
        await rig.until(lambda: placement(heard(rig)[-1][1]) == 2, within=4.0)

    assert rig.now - cut <= 4.0
    assert rig.incarnation("talker") == 2
    await rig.advance(1.0)
    assert heard(rig)[-1][1] == token(2, 2)


async def test_what_a_life_left_is_known_on_the_next_machine(rig: Rig) -> None:
    await rig.start(tree("base", "spare"))
    await rig.advance(2.0)
    with rig.expect_failure(HostLost):
        rig.hosts.crash("base")
        await rig.until(lambda: placement(heard(rig)[-1][1]) == 2)
    await rig.advance(1.0)

    assert rig.system.nodes["top", "talker"].restart_count == 1
    assert lines(rig, "has counted to three")[1:] == []


async def test_a_child_of_one_machine_waits_until_it_returns(rig: Rig) -> None:
    await rig.start(tree("base"))
    await rig.advance(1.0)
    with rig.expect_failure(HostLost):
        rig.hosts.crash("base")
        await rig.advance(20.0)
    silent = heard(rig)[-1][0]

    rig.hosts.reboot("base")
    await rig.advance(2.0)

    assert silent < 2.0
    assert heard(rig)[-1] == (pytest.approx(rig.now, abs=0.2), token(2, 2))
    waiting = lines(rig, "waiting for a host")
    assert [line.fields for line in waiting] == [{"child": "top/talker", "hosts": ["base"]}]
    assert len(lines(rig, "a host cannot be reached")) == 1


async def test_a_machine_that_is_cut_off_for_less_than_a_lease_is_not_lost(rig: Rig) -> None:
    await rig.start(tree("base", "spare"))
    await rig.advance(1.0)
    rig.hosts.cut("base")
    await rig.advance(1.5)
    rig.hosts.heal("base")
    await rig.advance(5.0)

    assert heard(rig)[-1][1] == token(1, 1)
    assert rig.incarnation("talker") == 1


async def test_the_old_life_has_ended_before_the_new_one_begins(rig: Rig) -> None:
    await rig.start(tree("base", "spare"))
    await rig.advance(1.0)
    before = [line for line in rig.logs if line.event == "a host is connected"]
    rig.hosts.cut("base")
    with rig.expect_failure(HostLost):
        await rig.advance(10.0)
        rig.hosts.heal("base")
        await rig.advance(5.0)

    tokens = [token for _, token in heard(rig)]
    assert tokens == sorted(tokens)
    assert placement(tokens[-1]) == 2
    assert len(lines(rig, "a host is connected")) == len(before) + 1


async def test_a_process_that_is_killed_there_is_restarted_there(rig: Rig) -> None:
    await rig.start(tree("base", "spare"))
    await rig.advance(1.0)
    with rig.expect_failure(ProcessDied, node="talker"):
        rig.kill_process("talker")
        await rig.advance(1.0)

    assert heard(rig)[-1][1] == token(2, 2)
    assert lines(rig, "a host is lost") == []


async def test_a_node_that_fails_there_fails_here_with_its_own_error(rig: Rig) -> None:
    await rig.start(tree("base"))
    await rig.advance(1.0)
    with rig.expect_failure(OSError, node="talker", match="no more disk"):
        rig.crash("talker", OSError("no more disk"))
        await rig.advance(1.0)

    (ended,) = [report for report in rig.reports if report.context == "child_terminated"]
    assert "OSError: no more disk" in str(ended.reason)


async def test_a_tree_that_is_stopped_stops_what_it_has_elsewhere_in_order(rig: Rig) -> None:
    await rig.start(tree("base"))
    await rig.advance(0.5)

    await rig.stop()

    assert [line.fields["why"] for line in lines(rig, "stopping")] == ["it stopped: the test is over"]


async def test_a_child_that_waits_for_its_machine_can_be_stopped_and_killed(rig: Rig) -> None:
    for stop in (5.0, "kill"):
        other = Rig()
        network = Network(1)
        for name in ("here", "base"):
            network.add_host(name)
        hosts = create(SimulatedHosts, network, "here", ("base",))
        hosts.crash("base")
        start = asyncio.create_task(
            other.start(tree("base", stop=stop), transport=network.transport("here"), hosts=hosts)
        )
        await asyncio.sleep(10.0)
        start.cancel()
        with pytest.raises(asyncio.CancelledError):
            await start
        assert not [task for task in asyncio.all_tasks() if "talker" in task.get_name()]


async def test_a_life_that_does_not_stop_in_time_is_terminated_and_killed_there(rig: Rig) -> None:
    whole = Supervisor("top", children=[Child(Late, host="base", stop=0.5)])
    await rig.start(whole)
    top = rig.system.supervisor
    assert top is not None
    begun = rig.now
    await top.terminate_child("late")
    took = rig.now - begun
    await top.restart_child("late")
    await rig.advance(1.0)

    assert took == pytest.approx(0.5, abs=0.05)  # the simulated process is terminated, and ends without a clean-up then

    assert rig.state("late").state == "running"
    assert rig.incarnation("late") == 2


async def test_one_that_is_given_up_while_it_cannot_be_reached_runs_once_at_a_time(rig: Rig) -> None:
    """It is killed and forgotten here at once, but the next life waits for the end of the lease."""
    await rig.start(tree("base", "spare", stop="kill"))
    await rig.advance(1.0)
    rig.hosts.cut("base")
    await rig.advance(0.1)
    cut = rig.now
    top = rig.system.supervisor
    assert top is not None
    await top.terminate_child("talker")
    given_up = rig.now
    restart = asyncio.create_task(top.restart_child("talker"))
    await rig.until(lambda: placement(heard(rig)[-1][1]) == 2, within=6.0)
    await restart

    assert given_up - cut < 1.1
    assert 2.5 < rig.now - cut < 4.0


async def test_hosts_that_are_not_known_are_named(rig: Rig) -> None:
    network = Network(1)
    for name in ("here", "base"):
        network.add_host(name)
    hosts = create(SimulatedHosts, network, "here", ("base",))
    rig.expect_failure()

    with pytest.raises(StartFailed) as failed:
        await rig.start(tree("bass"), transport=network.transport("here"), hosts=hosts)

    assert "run(hosts=...) does not say where 'bass' is; did you mean 'base'?" in str(failed.value.__cause__)


async def test_without_hosts_a_child_of_another_machine_does_not_start(rig: Rig) -> None:
    network = Network(1)
    network.add_host("here")
    rig.expect_failure()

    with pytest.raises(StartFailed) as failed:
        await rig.start(tree("base"), transport=network.transport("here"))

    assert isinstance(failed.value.__cause__, DeclarationError)
    assert "say where its hosts are: run(tree, hosts=..., transport=...)" in str(failed.value.__cause__)


async def test_a_rig_has_no_machines_unless_its_tree_names_some(rig: Rig) -> None:
    await rig.start(Hearer)

    with pytest.raises(NotStarted, match="no tree that names hosts"):
        _ = rig.hosts


async def test_the_machines_of_a_subtree_and_of_a_template_are_simulated_too(rig: Rig) -> None:
    spawner = DynamicSupervisor("talkers", Child(Talker, host="far"))
    whole = Supervisor("top", children=[Supervisor("inner", children=[spawner]), Child(Hearer)])

    await rig.start(whole)

    assert rig.hosts.names == ("far",)


@virtual
async def test_a_simulated_wire_that_was_closed_carries_nothing_more() -> None:
    network = Network(1)
    for name in ("here", "base"):
        network.add_host(name)
    hosts = create(SimulatedHosts, network, "here", ("base",))
    got: list[object] = []
    wire = await hosts.dial("base", got.append, lambda: got.append("lost"))
    wire.close()
    wire.close()
    wire.send(Hello(3.0))
    await asyncio.sleep(1.0)

    assert got == ["lost"]
    assert wire.unsent == 0
