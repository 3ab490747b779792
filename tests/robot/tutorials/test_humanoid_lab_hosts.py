"""The three-node lab on three hosts: it keeps its promises when the network is whole again, and every planted breach of one is found."""

from __future__ import annotations

import pytest

from actors.testing import Lab, scenario
from actors.testing.faults import NETWORK, draw
from actors.testing.simulation.trial import Outcome, Trial
from actors.transport.simulated.endpoints import Outlet, Subscription
from actors.transport.simulated.link import Stream
from actors.transport.simulated.queries import Question
from robot.tutorials.humanoid_lab import MOTOR_COMMANDS
from tests.robot.tutorials.lab_on_hosts import SCENARIO, Ledger, keeps_its_promises, main, start_lab


async def test_on_three_hosts_the_lab_drives_and_its_calls_and_goals_are_answered(lab: Lab) -> None:
    ledger = Ledger()
    await start_lab(lab, ledger)
    desk = await lab.start("desk")
    commands = desk.probe(MOTOR_COMMANDS)
    await lab.advance(20.0)
    assert len(commands) == 9
    assert ledger.ended["answered"] >= 60
    assert ledger.ended["reached"] >= 5
    assert ledger.ended["GoalCanceled"] >= 2
    assert set(ledger.ended) == {"answered", "reached", "GoalCanceled"}


async def test_a_call_and_a_goal_without_limit_of_time_end_when_their_server_is_cut_off(lab: Lab) -> None:
    ledger = Ledger()
    await start_lab(lab, ledger)
    await lab.advance(5.0)
    lab.cut("planner", "sensor")
    lab.cut("planner", "motor")
    await lab.advance(4.0)
    assert ledger.ended["NotRunning"] + ledger.ended.get("GoalAborted", 0) >= 1
    assert ledger.ended["GoalAborted"] == 1
    lab.heal("planner", "sensor")
    lab.heal("planner", "motor")
    before = ledger.ended["reached"]
    await lab.advance(6.0)
    assert ledger.ended["reached"] >= before + 1


@pytest.mark.slow(reason="many seeds")
@scenario(seeds=12, faults=NETWORK)
async def test_whatever_happens_to_the_network_the_lab_keeps_its_promises_when_it_is_whole(lab: Lab) -> None:
    await keeps_its_promises(lab)


@pytest.mark.slow(reason="five hundred seeds")
@scenario(seeds=500, faults=NETWORK)
async def test_five_hundred_networks_that_break(lab: Lab) -> None:
    await keeps_its_promises(lab)


def test_a_seed_has_the_same_course_every_time() -> None:
    profile = SCENARIO.play(Trial(0, shuffled=False)).profile
    trial = Trial(5, faults=draw(NETWORK, 5, profile))
    first, second = SCENARIO.play(trial), SCENARIO.play(trial)
    assert trial.faults
    assert (first.error, first.timeline, first.profile) == (second.error, second.timeline, second.profile)


def test_a_host_that_is_killed_while_a_node_cleans_up_is_no_failure() -> None:
    outcome = SCENARIO.play(Trial.parse("568 host-crash:motor#2952+0.125"))
    assert outcome.error is None


def test_the_command_counts_seeds_and_replays_a_trial(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--seeds", "2"]) == 0
    assert "2 seeds in" in capsys.readouterr().out
    assert main(["--replay", "1 cut:sensor=motor#3000+4"]) == 0
    assert "this trial passes" in capsys.readouterr().out


def first_failure(seeds: range) -> Outcome | None:
    profile = SCENARIO.play(Trial(0, shuffled=False)).profile
    outcomes = (SCENARIO.play(Trial(seed, faults=draw(NETWORK, seed, profile))) for seed in seeds)
    return next((outcome for outcome in outcomes if outcome.error is not None), None)


def test_a_transport_whose_questions_to_a_lost_process_stay_open_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Question, "lose", lambda question, stream: None)
    found = first_failure(range(20))
    assert found is not None
    assert "still open at t=" in str(found.error)


def test_a_transport_that_keeps_nothing_for_those_who_come_back_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Outlet, "join", join_without_history)
    found = first_failure(range(20))
    assert found is not None
    assert "takes the mode for" in str(found.error)


def join_without_history(outlet: Outlet, stream: Stream, subscription: Subscription) -> None:
    wanted, subscription.history = subscription.history, 0
    JOIN(outlet, stream, subscription)
    subscription.history = wanted


JOIN = Outlet.join
