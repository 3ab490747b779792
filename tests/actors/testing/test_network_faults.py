"""Faults of a network: how they are written and drawn, what each does, and that a failing run is shrunk to the one that it takes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from actors import Node, Service, Supervisor, Topic, every, publishes
from actors.errors import CallCycle, ServiceFailed
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.running.target import find
from actors.testing import Lab, scenario
from actors.testing.explore import main as explore
from actors.testing.explore import scenario_of
from actors.testing.fault_values import names_nothing, not_come
from actors.testing.faults import NETWORK, Cut, Fault, HostCrash, HostPause, LinkLoss, Profile, RouterStop, draw, parse
from actors.testing.simulation.search import search
from actors.testing.simulation.trial import Outcome, Scenario, Trial

COUNT = Topic(Int32, "count", 100)
ONE_HOST = Profile(hosts={"robot": True, "desk": False}, seconds=10.0, faulty_seconds=10.0)
THREE = Profile(hosts={"robot": True, "base": True, "arm": True, "desk": False}, seconds=20.0, faulty_seconds=10.0)


class Counter(Node):
    count = publishes(COUNT)

    async def on_start(self) -> None:
        self.so_far = 0

    @every(hz=10)
    def tick(self) -> None:
        self.so_far += 1
        self.count(Int32(data=self.so_far))


class Listener(Node):
    """Fails when it has heard nothing for 3 s, once it has heard anything."""

    async def on_start(self) -> None:
        self.heard_at: float | None = None

    @COUNT.on()
    def hear(self, message: Int32) -> None:
        self.heard_at = self.clock.now()

    @every(hz=1)
    def look(self) -> None:
        assert self.heard_at is None or self.clock.now() - self.heard_at < 3.0, "the counter is silent"


def two_hosts() -> dict[str, type[Node]]:
    return {"robot": Counter, "base": Listener}


# -- values -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cut:robot=desk#4200+3", "from 4.2 s after the start nothing passes between robot and desk, for 3 s"),
        ("cut:robot>desk#0+0.5", "from 0 s after the start nothing passes from robot to desk, for 0.5 s"),
        (
            "link-loss:robot=desk#0+10*0.3",
            "from 0 s after the start 30% of the messages between robot and desk are lost, for 10 s",
        ),
        (
            "link-delay:robot>desk#0+1*0.25",
            "from 0 s after the start messages from robot to desk are up to 0.25 s late, for 1 s",
        ),
        ("host-crash:robot#1000+2", "from 1 s after the start the host robot is without power, for 2 s"),
        ("host-pause:robot#1000+2", "from 1 s after the start the processes of robot stand still, for 2 s"),
        ("router-stop:router#1000+2", "from 1 s after the start there is no router, for 2 s"),
        ("clock-offset:robot#1000-2", "from 1 s after the start the time of day of robot is -2 s ahead"),
    ],
)
def test_a_fault_of_the_network_is_read_back_and_said_in_words(text: str, words: str) -> None:
    (fault,) = parse(text)
    assert str(fault) == text
    assert fault.in_words() == words


def test_hosts_without_a_tree_are_spared_and_faults_come_before_the_recovery() -> None:
    drawn = [fault for seed in range(300) for fault in draw(NETWORK, seed, THREE)]
    assert {fault.kind for fault in drawn} == {
        "cut", "link-loss", "link-delay", "link-duplicate", "link-reorder", "host-crash", "host-pause", "clock-offset",
    }  # fmt: skip
    assert all("desk" not in fault.target for fault in drawn)
    assert all(0 <= fault.nth <= 10_000 for fault in drawn)
    assert any(">" in fault.target for fault in drawn)
    assert any("=" in fault.target for fault in drawn)
    assert parse(" ".join(map(str, drawn))) == tuple(drawn)


def test_faults_are_drawn_for_the_hosts_that_are_named() -> None:
    drawn = [fault for seed in range(100) for fault in draw([Cut("arm"), HostCrash("a*")], seed, THREE)]
    assert drawn
    assert all(fault.target == "arm" or fault.target.startswith(("arm=", "arm>")) for fault in drawn)


def test_where_there_is_no_second_host_no_such_host_and_no_router_there_is_nothing_to_break() -> None:
    possible = [Cut(), HostCrash("nobody"), HostPause("nobody"), RouterStop()]
    assert [draw([one], seed, ONE_HOST) for one in possible for seed in range(10)] == [()] * 40
    assert draw([Cut("nobody")], 1, THREE) == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("cut:robot=moon#1+1", "cut:robot=moon#1+1 names nothing in this system."),
        ("router-stop:router#1+1", "There is: nothing for a fault of this kind"),
        ("host-crash:robto#1+1", "Did you mean robot?"),
    ],
)
def test_a_fault_of_a_host_that_is_not_there_is_refused(text: str, said: str) -> None:
    assert said in names_nothing(parse(text), [THREE])
    assert names_nothing(parse("cut:desk>robot#1+1 host-crash:desk#1+1"), [THREE]) == ""


def test_a_fault_that_would_come_after_the_recovery_has_not_come_to_pass() -> None:
    (early, late) = parse("cut:robot=base#9000+1 cut:robot=base#11000+1")
    assert not_come(early, THREE) == ""
    assert "has not come to pass" in not_come(late, THREE)


# -- what they do -----------------------------------------------------------------------------------------------------------


def played(text: str, heard: list[tuple[float, int]], *, router: bool = False) -> Outcome:
    """What a desk hears of a counter in 10 s, with these faults."""

    async def body(lab: Lab) -> None:
        await lab.start("desk", router=router)
        await lab.start("robot", Counter, mode="client" if router else "peer")
        counts = lab["desk"].probe(COUNT)
        await lab.advance(10.0)
        heard[:] = [(time, message.data) for time, message in zip(counts.times, counts, strict=True)]

    return Scenario(body, on_hosts=True).play(Trial(0, shuffled=False, faults=parse(text)))


def between(heard: list[tuple[float, int]], start: float, end: float) -> list[int]:
    return [number for time, number in heard if start <= time < end]


@pytest.mark.parametrize("link", ["desk=robot", "robot=desk", "robot>desk"])
def test_during_a_cut_nothing_is_heard_and_afterwards_all_is_as_before(link: str) -> None:
    heard: list[tuple[float, int]] = []
    assert played(f"cut:{link}#2000+4", heard).error is None
    assert between(heard, 2.1, 6.0) == []
    assert between(heard, 7.0, 8.0) == list(range(70, 80)), (
        "what was sent during the cut is lost: it was longer than the lease"
    )


def test_of_two_cuts_that_overlap_the_link_stays_cut_until_both_have_ended() -> None:
    heard: list[tuple[float, int]] = []
    played("cut:desk=robot#2000+4 cut:robot>desk#3000+1", heard)
    assert between(heard, 2.1, 6.0) == []
    assert between(heard, 7.0, 8.0) != []


@pytest.mark.parametrize(
    ("text", "late"),
    [
        ("link-delay:robot>desk#2000+2*0.9", True),
        ("link-loss:robot>desk#2000+2*0.6", True),
        ("link-delay:desk>robot#2000+2*0.9", False),
    ],
)
def test_reliable_messages_of_a_bad_link_are_late_and_all_arrive_in_order(text: str, late: bool) -> None:
    heard: list[tuple[float, int]] = []
    played(text, heard)
    assert [number for _, number in heard] == list(range(1, 100))
    assert (max(time - number / 10.0 for time, number in heard) > 0.15) is late


def test_reliable_messages_arrive_once_and_in_order_on_a_link_that_doubles_and_reorders() -> None:
    heard: list[tuple[float, int]] = []
    played("link-duplicate:robot=desk#0+9*0.6 link-reorder:robot=desk#0+9*0.6", heard)
    assert [number for _, number in heard] == list(range(1, 100))


def test_a_host_that_crashes_starts_again_after_its_time() -> None:
    heard: list[tuple[float, int]] = []
    outcome = played("host-crash:robot#2000+3 host-crash:robot#3000+1", heard)
    assert outcome.error is None
    assert between(heard, 2.1, 5.0) == []
    assert between(heard, 6.0, 7.0) == list(range(10, 20)), "it counts from the beginning"


def test_processes_that_stand_still_do_nothing_and_go_on_where_they_were() -> None:
    heard: list[tuple[float, int]] = []
    assert played("host-pause:robot#2000+4 host-pause:robot#3000+1", heard).error is None
    assert between(heard, 2.1, 6.0) == []
    last = between(heard, 0.0, 2.1)[-1]
    assert between(heard, 7.0, 8.0) == list(range(last + 11, last + 21)), "it has counted no further meanwhile"


@pytest.mark.parametrize("text", ["cut:robot=desk#3000+4", "cut:robot=desk#1000+6"])
def test_a_link_that_is_cut_stays_so_when_its_end_goes_on(text: str) -> None:
    heard: list[tuple[float, int]] = []
    assert played(f"host-pause:robot#2000+2 {text}", heard).error is None
    assert between(heard, 2.1, 7.0) == []
    assert between(heard, 8.0, 9.0) != []


def test_a_host_that_crashes_while_it_stands_still_runs_after_its_reboot() -> None:
    heard: list[tuple[float, int]] = []
    assert played("host-pause:robot#2000+6 host-crash:robot#3000+1", heard).error is None
    assert between(heard, 2.1, 4.0) == []
    assert between(heard, 6.0, 7.0) == list(range(20, 30))


def test_who_stands_still_loses_nobody_until_it_goes_on_and_calls_work_again() -> None:
    took: list[float] = []

    async def body(lab: Lab) -> None:
        robot = await lab.start("robot", Answering)
        desk = await lab.start("desk")
        await lab.advance(1.0)
        links = lambda rig: rig.system.graph.links  # noqa: E731
        assert [link.host for link in links(robot)()] == ["desk"]
        await lab.advance(4.0)  # the robot stands still from 2 s to 6 s
        assert [link.host for link in links(robot)()] == ["desk"]
        assert links(desk)() == ()
        await lab.advance(1.5)
        begun = lab.now
        assert (await desk.call(FIRST, Trigger.Request())).success
        took.append(lab.now - begun)

    outcome = Scenario(body, on_hosts=True).play(Trial(0, faults=parse("host-pause:robot#2000+4")))
    assert outcome.error is None, outcome.error
    assert took[0] < 0.1


def test_a_router_that_ends_twice_at_a_time_is_back_when_both_times_are_over() -> None:
    heard: list[tuple[float, int]] = []
    played("router-stop:router#2000+3 router-stop:router#2500+0.5", heard, router=True)
    assert between(heard, 2.1, 5.0) == []
    assert between(heard, 6.0, 7.0) != []


def test_links_may_be_at_fault_while_the_router_is_away_and_stay_so_when_it_is_back() -> None:
    heard: list[tuple[float, int]] = []
    played("router-stop:router#2000+3 cut:robot=desk#2500+4", heard, router=True)
    assert between(heard, 2.1, 6.4) == []
    assert between(heard, 8.0, 9.0) != []


def test_a_clock_that_is_set_stays_so() -> None:
    clocks: list[float] = []

    async def body(lab: Lab) -> None:
        await lab.start("robot", Counter)
        await lab.advance(5.0)
        await lab.recover()
        clocks.append(lab["robot"].system.clock.wall())

    Scenario(body, on_hosts=True).play(Trial(0, faults=parse("clock-offset:robot#1000-3")))
    assert clocks == [pytest.approx(2.0)]


def test_after_recover_no_fault_goes_on_and_none_begins() -> None:
    heard: list[int] = []

    async def body(lab: Lab) -> None:
        await lab.start("robot", Counter)
        await lab.start("desk")
        counts = lab["desk"].probe(COUNT)
        await lab.advance(5.0)
        await lab.recover()
        seen = len(counts)
        await lab.advance(5.0)
        heard.append(len(counts) - seen)

    faults = parse("cut:robot=desk#4000+60 host-crash:robot#4500+0.5 host-crash:robot#6000+60 cut:robot=desk#7000+60")
    outcome = Scenario(body, on_hosts=True).play(Trial(0, shuffled=False, faults=faults))
    assert outcome.error is None
    assert outcome.profile.faulty_seconds == 5.0
    assert heard[0] >= 48


FIRST, SECOND = Service(Trigger, "first"), Service(Trigger, "second")


class Answering(Node):
    @FIRST.serve()
    async def answer(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


class Taking(Node):
    """Asks the one that asks it, and takes the error for an answer."""

    @FIRST.serve()
    async def answer(self, request: Trigger.Request) -> Trigger.Response:
        try:
            return await self.call(SECOND, Trigger.Request(), timeout=5.0)
        except (CallCycle, ServiceFailed) as error:
            return Trigger.Response(message=str(error))


class Asking(Node):
    @SECOND.serve()
    async def answer(self, request: Trigger.Request) -> Trigger.Response:
        try:
            return await self.call(FIRST, Trigger.Request(), timeout=5.0)
        except CallCycle as cycle:
            return Trigger.Response(message=str(cycle))


def test_a_cycle_of_calls_over_two_hosts_fails_the_run_though_a_handler_takes_the_error() -> None:
    async def body(lab: Lab) -> None:
        await lab.start("robot", Taking)
        await lab.start("desk", Asking)
        await lab.advance(1.0)
        await lab["robot"].call(FIRST, Trigger.Request())
        await lab.advance(1.0)

    outcome = Scenario(body, on_hosts=True).play(Trial(0, shuffled=False))
    assert isinstance(outcome.error, CallCycle), outcome.error


def test_faults_that_name_a_host_which_is_not_there_yet_do_nothing() -> None:
    heard: list[tuple[float, int]] = []
    outcome = played("cut:robot=moon#1000+1 host-crash:moon#1000+1", heard)
    assert outcome.error is None
    assert len(heard) == 99


# -- the search -------------------------------------------------------------------------------------------------------------


def test_a_node_that_does_not_stand_a_cut_is_found_with_one_fault_and_the_line_replays_it() -> None:
    made = scenario_of(two_hosts, 20.0)
    finding = search(made, range(200), NETWORK)
    assert finding is not None
    (fault,) = finding.replay.faults
    assert fault.kind in ("cut", "host-crash")
    again = made.play(Trial.parse(str(finding.replay)))
    assert again.error is not None
    assert "the counter is silent" in str(again.error)
    assert "host=base" in again.timeline


class Integrating(Node):
    """Takes each tick for the one after the last."""

    async def on_start(self) -> None:
        self.last: float | None = None

    @every(hz=10)
    def tick(self) -> None:
        now = self.clock.now()
        assert self.last is None or now - self.last < 1.0, "a step of more than a second"
        self.last = now


def test_a_node_that_stands_every_cut_but_no_pause_is_found() -> None:
    made = scenario_of(lambda: {"robot": Integrating, "base": Counter}, 20.0)
    assert search(made, range(12), [Cut()]) is None
    finding = search(made, range(60), NETWORK)
    assert finding is not None
    (fault,) = finding.replay.faults
    assert (fault.kind, fault.target) == ("host-pause", "robot")


@scenario(seeds=6, faults=[LinkLoss(most=0.9), Cut(up_to=1.0)])
async def test_a_scenario_with_a_lab_gets_faults_of_its_network(lab: Lab) -> None:
    await lab.start("robot", Counter)
    await lab.start("base", Counter)
    counts = lab["base"].probe(COUNT)
    await lab.advance(5.0)
    await lab.recover()
    seen = len(counts)
    await lab.advance(5.0)
    assert len(counts) - seen >= 95


def test_explore_takes_a_mapping_from_hosts_to_trees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = str(tmp_path / "x.mcap")
    here = "tests.actors.testing.test_network_faults"
    assert explore([f"{here}:two_hosts", "--seconds", "10", "--seeds", "3", "--faults", "none"]) == 0
    code = explore([f"{here}:two_hosts", "--seconds", "10", "--faults", "cut", "--flight-record", record])
    said = capsys.readouterr().out
    assert code == 1
    assert "with this fault: from " in said
    replay = said.partition("--replay ")[2].splitlines()[0].strip("'")
    assert explore([f"{here}:two_hosts", "--seconds", "10", "--replay", replay]) == 1


@pytest.mark.parametrize("make", [dict, lambda: {"robot": 3}])
def test_what_is_no_mapping_from_hosts_to_trees_is_refused(make: Callable[[], object]) -> None:
    finding = search(scenario_of(make, 1.0), range(1), ())
    assert finding is not None
    assert "what should make a tree made dict" in str(finding.outcome.error)


def test_one_tree_is_explored_on_one_host_without_a_network() -> None:
    made = scenario_of(lambda: Supervisor("one", children=[]), 1.0)
    assert not made.on_hosts
    assert made.play(Trial(0, faults=(Fault("cut", "a=b", 1, 1.0),))).error is None


@pytest.mark.parametrize(
    ("make", "on_hosts"),
    [(two_hosts, True), (lambda: Counter, False), (lambda: [][0], False), (lambda: {"robot": 3}, False)],
)
def test_whether_there_are_hosts_is_found_out_where_processes_cannot_be_copied_too(
    make: Callable[[], object], on_hosts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("multiprocessing.get_all_start_methods", lambda: ["spawn"])
    assert scenario_of(make, 1.0).on_hosts is on_hosts


def test_a_maker_that_ends_the_process_is_left_to_the_trials() -> None:
    assert not scenario_of(lambda: os._exit(1), 1.0).on_hosts


def test_a_mapping_is_found_by_its_name_and_a_scenario_takes_a_rig_or_a_lab() -> None:
    assert find("tests.actors.testing.test_network_faults:HOSTS")() is HOSTS

    async def both(rig: object, lab: object) -> None: ...

    with pytest.raises(TypeError, match=r"with the argument `rig` or `lab`, and .*both is not one"):
        scenario(seeds=1)(both)


HOSTS = two_hosts()
