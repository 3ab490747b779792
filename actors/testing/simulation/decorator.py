"""`@scenario`: a test that runs under hundreds of seeds, each with another legal order of events and other faults.

::

    @scenario(seeds=200, faults=[Lose(CMD_VEL), Crash(Planner)])
    async def test_the_robot_always_stops_in_the_end(rig: Rig) -> None:
        await rig.start(tree())
        ...

A failing seed is reduced to the fewest faults that fail in the same way. It is run once more with a flight recorder, and reported with the
line that replays it.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Awaitable, Callable, Sequence

import pytest

from actors.testing.fault_values import names_nothing
from actors.testing.faults import Possible
from actors.testing.flight_records import save_flight
from actors.testing.simulation.invariants import PATIENCE, Invariant
from actors.testing.simulation.search import Finding, search
from actors.testing.simulation.trial import Scenario, Trial

SEEDS = 200


def scenario(
    *,
    seeds: int = SEEDS,
    faults: Sequence[Possible] = (),
    invariants: Sequence[Invariant] = (),
    patience: float = PATIENCE,
) -> Callable[[Callable[..., Awaitable[None]]], Callable[..., None]]:
    """Run an async test on virtual time with a fresh `rig`, or a fresh `lab`, once in plain order without faults and then once for each of `seeds` seeds.

    `faults` lists the possible faults (see `actors.testing.faults`; ``ALL`` means all). `invariants` are called with the system whenever
    nothing can run without time passing. A handler or a canceled goal that makes no progress for `patience` seconds fails the test. Other
    fixtures are created once and shared by all seeds. ``pytest --scenario-seeds N`` overrides `seeds`, and ``--scenario-replay TRIAL`` runs
    one trial.
    """
    if seeds < 1:
        raise ValueError(f"@scenario(seeds={seeds}): at least one")

    def decorate(test: Callable[..., Awaitable[None]]) -> Callable[..., None]:
        signature = inspect.signature(test)
        stages = [name for name in ("rig", "lab") if name in signature.parameters]
        if len(stages) != 1 or not inspect.iscoroutinefunction(test):
            raise TypeError(
                f"@scenario is for `async def` tests with the argument `rig` or `lab`, and {test.__qualname__} is not one"
            )
        (name_of_stage,) = stages

        @functools.wraps(test)
        def run(request: pytest.FixtureRequest, **fixtures: object) -> None:
            if "request" in signature.parameters:
                fixtures["request"] = request

            async def body(stage: object) -> None:
                await test(**{name_of_stage: stage}, **fixtures)

            played = Scenario(body, tuple(invariants), patience, on_hosts=name_of_stage == "lab")
            replay, number = (request.config.getoption(name) for name in ("--scenario-replay", "--scenario-seeds"))
            if number is not None and number < 1:
                pytest.fail(f"--scenario-seeds {number}: at least one", pytrace=False)
            if replay is not None:
                _again(played, _read(replay))
            else:
                try:
                    finding = search(played, range(number or seeds), faults)
                except ValueError as error:
                    raise pytest.fail.Exception(f"@scenario(faults=...): {error}", pytrace=False) from None
                if finding is not None:
                    raise _explained(finding, played, request)

        others = [
            parameter for name, parameter in signature.parameters.items() if name not in (name_of_stage, "request")
        ]
        first = inspect.Parameter("request", inspect.Parameter.KEYWORD_ONLY)
        # pytest reads this attribute to find the fixtures; type checkers do not know it.
        run.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[*(other.replace(kind=inspect.Parameter.KEYWORD_ONLY) for other in others), first],
            return_annotation=None,
        )
        return run

    return decorate


def _read(replay: str) -> Trial:
    try:
        return Trial.parse(replay)
    except ValueError as error:
        pytest.fail(f"--scenario-replay: {error}", pytrace=False)


def _again(played: Scenario, trial: Trial) -> None:
    outcome = played.play(trial)
    strange = names_nothing(trial.faults, [outcome.profile])
    if strange and (strange := names_nothing(trial.faults, [played.run(0, shuffled=False).profile, outcome.profile])):
        pytest.fail(f"--scenario-replay: {strange}", pytrace=False)
    if outcome.error is not None:
        outcome.error.add_note(outcome.timeline)
        raise outcome.error


def _explained(finding: Finding, played: Scenario, request: pytest.FixtureRequest) -> BaseException:
    """Build the error for a finding: the failure of the reduced trial, with notes that explain it."""
    error = finding.outcome.error
    assert error is not None
    test = request.node.nodeid
    error.add_note(f"scenario: {finding.describe()}")
    error.add_note(f"replay:   python -m pytest '{test}' --scenario-replay '{finding.replay}'")
    flight = save_flight(finding.record(played), request.config, request.getfixturevalue("tmp_path_factory"), test)
    error.add_note(f"flight record: {flight}")
    error.add_note(finding.outcome.timeline)
    return error
