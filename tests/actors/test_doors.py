"""A small number of the inputs of `python -m tests.hostile doors`."""

from __future__ import annotations

from pathlib import Path

from tests.hostile.doors import attack, doors, findings


def test_hostile_bytes_are_refused_wherever_bytes_from_outside_are_read(tmp_path: Path) -> None:
    wrong: dict[str, list[str]] = {}
    for name, door in doors(tmp_path).items():
        outcome = attack(door, 150, 11)
        assert outcome.refused > 0, name
        wrong |= {name: found} if (found := findings(outcome)) else {}
    assert wrong == {}
