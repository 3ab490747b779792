"""`python -m tests.tools.contract_mutants`: which changes of contracts it tries, and that the tables notice them and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tools.contract_mutants import KNOWN, LIMIT, TABLES, drawn, known, mutants_of
from tests.tools.mutants.mutate import Mutant
from tests.tools.mutants.trial import Workshop

ROOT = Path(__file__).parents[2]
SOURCE = """from __future__ import annotations
SPEED = Topic(Float32, "speed")
HALT = Service(Trigger, "halt")
OTHER = make("x")
"""


def test_a_contract_is_renamed_and_retyped_and_a_topic_also_gets_two_other_profiles() -> None:
    mutants = list(mutants_of("a.py", SOURCE))
    assert [(one.line, one.kind, one.after) for one in mutants] == [
        (2, "renamed", "'speed_2'"),
        (2, "retyped", "Clock"),
        (2, "re-profiled: deeper", "Topic(Float32, 'speed', _of(10).replace(depth=_of(10).depth + 1))"),
        (
            2,
            "re-profiled: reliability",
            "Topic(Float32, 'speed', _of(10).replace(reliability='best_effort' if _of(10).reliable else 'reliable'))",
        ),
        (3, "renamed", "'halt_2'"),
        (3, "retyped", "Empty"),
    ]
    assert "\nHALT = Service(Trigger, 'halt_2')\nOTHER = make(\"x\")\n" in mutants[4].source
    assert 'SPEED = Topic(Float32, "speed")' in mutants[4].source


def test_those_that_were_once_not_noticed_are_where_they_are_said_to_be() -> None:
    assert len(known(ROOT)) == len(KNOWN)
    for mutant in known(ROOT):
        assert mutant.source != (ROOT / mutant.path).read_text(encoding="utf-8")
        compile(mutant.source, mutant.path, "exec")


def test_the_draw_is_the_same_for_the_same_seed() -> None:
    names = [str(mutant) for mutant in drawn(ROOT, 30, 1)]
    assert names == [str(mutant) for mutant in drawn(ROOT, 30, 1)]
    assert len(set(names)) == 30
    assert names != [str(mutant) for mutant in drawn(ROOT, 30, 2)]
    assert len(drawn(ROOT, 10_000, 1)) > 250  # every contract of the robot and of the tutorials, in two to four ways


@pytest.mark.slow(reason="a tool of the nightly run")
def test_changed_contracts_are_killed_and_a_change_of_nothing_survives(tmp_path: Path) -> None:
    workshop = Workshop(ROOT, tmp_path, ("actors", "robot", "cli", "tests"))
    (nothing, *_) = drawn(ROOT, 1, 1)
    source = nothing.source.replace(nothing.after, nothing.before)
    assert workshop.try_out(Mutant(nothing.path, 1, "nothing", "", "", source), TABLES, LIMIT) == "survived"
    for mutant in [*known(ROOT)[::6], *drawn(ROOT, 3, 7)]:
        assert workshop.try_out(mutant, TABLES, LIMIT) == "killed", mutant
