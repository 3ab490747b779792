"""The planted systems of `tests.planted`: every bug is found, and no healthy twin is blamed."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path

import pytest

from actors import Supervisor
from actors.testing.explore import body_of, scenario_of
from actors.testing.explore import main as explore
from actors.testing.fault_values import OF_NETWORK
from actors.testing.faults import ALL, NETWORK
from actors.testing.simulation.isolated import Isolated
from actors.testing.simulation.search import search
from actors.testing.simulation.trial import Scenario, Trial
from tests.planted import exotic
from tests.planted.__main__ import SECONDS, explored, main
from tests.planted.cases import CASES, Case

NAMES = [case.name for case in CASES]
LONG = pytest.mark.slow(reason="many trials are needed until it is found")
OFTEN_TRIED = {"half_done", "lost_wakeup", "starved", "storm", "too_few", "ring", "watchdog"}


def cases(*chosen: Case) -> list[object]:
    return [pytest.param(case, id=case.name, marks=[LONG] if case.name in OFTEN_TRIED else []) for case in chosen]


@pytest.mark.parametrize("case", cases(*(case for case in CASES if case.order)))
def test_a_bug_of_order_is_found_within_200_seeds_without_faults(case: Case) -> None:
    finding = explored(case.name, "tree", range(200), ())
    assert finding is not None
    assert finding.replay.shuffled, "plain order does not show it"
    assert not finding.replay.faults


@pytest.mark.parametrize("case", cases(*CASES))
def test_every_bug_is_found_within_200_seeds_with_faults(case: Case) -> None:
    finding = explored(case.name, "tree", range(200), ALL)
    assert finding is not None
    assert finding.replay.faults or case.order


@pytest.mark.parametrize(("name", "said"), [("split_brain", "both lead"), ("lost_reconnect", "and the worker as well")])
def test_a_bug_that_a_broken_network_shows_is_found_with_few_faults_of_it_and_replayed(name: str, said: str) -> None:
    finding = explored(name, "tree", range(200), NETWORK)
    assert finding is not None
    assert 1 <= len(finding.replay.faults) <= 2
    assert all(fault.kind in OF_NETWORK for fault in finding.replay.faults)
    make = importlib.import_module(f"tests.planted.{name}").tree
    again = scenario_of(make, SECONDS).play(Trial.parse(str(finding.replay)))
    assert said in str(again.error)


@pytest.mark.parametrize("name", NAMES)
def test_a_healthy_twin_is_left_in_peace(name: str) -> None:
    assert explored(name, "healthy", range(4), ALL) is None


@pytest.mark.slow(reason="every system, faults and healthy twins, 200 seeds each")
def test_the_table_of_all_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0, capsys.readouterr().out


def test_the_table_says_what_was_found_and_what_was_not(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["twice", "--seeds", "20", "--healthy", "2"]) == 0
    head, found, healthy = capsys.readouterr().out.splitlines()
    assert head.split()[:4] == ["system", "which", "faults", "seed"]
    assert found.split()[:3] == ["twice", "tree", "default"]
    assert "was made twice" in found
    assert healthy.split()[:4] == ["twice", "healthy", "default", "-"]
    assert main(["twice", "--seeds", "1", "--healthy", "0"]) == 1, "one seed is too few"


def test_a_tree_that_allows_too_few_restarts_is_found_by_two_crashes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        explore(["tests.planted.too_few:tree", "--faults", "crash", "--flight-record", str(tmp_path / "x.mcap")]) == 1
    )
    found = capsys.readouterr().out
    assert found.startswith("tests.planted.too_few:tree: SupervisorGaveUp with events in plain order and 2 faults")
    assert found.count("with this fault: ") == 2


@pytest.mark.parametrize("tree", [exotic.groups, exotic.climbers, exotic.tuned, exotic.hirers])
def test_unusual_parts_are_no_failures(tree: Callable[[], Supervisor]) -> None:
    scenario = Scenario(body_of(tree, 5.0), limit=305.0)
    assert search(Isolated(scenario), range(10), ALL) is None
