"""What `tests.figures slip` counts and prints."""

from __future__ import annotations

import pytest

from tests.figures import slip
from tests.figures.__main__ import main


def outcome(*, fallen: bool, sat: bool, tilt: float) -> dict[str, object]:
    return {"fallen": fallen, "sat": sat, "tilt": tilt, "walked": 1.0}


def test_a_row_counts_the_seeds_of_one_floor() -> None:
    met = {
        (1, 7): outcome(fallen=False, sat=True, tilt=3.0),
        (1, 8): outcome(fallen=True, sat=False, tilt=70.0),
        (2, 7): outcome(fallen=False, sat=False, tilt=1.0),
    }
    first, second = slip.rows(met)
    assert (first["trials"], first["falls"], first["sat"], first["tilt"], first["fallen"]) == (2, 1, 1, 70.0, [8])
    assert (second["trials"], second["falls"], second["sat"]) == (1, 0, 0)
    assert (first["name"], first["speed"]) == (slip.FLOORS[1].name, slip.FLOORS[1].speed)


def test_a_floor_that_is_none_is_refused_with_the_names_of_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["slip", "--only", "mud"]) == 2
    assert "no floor is called so; there are: friction 0.2, friction 0.8, ice of 0.1" in capsys.readouterr().err
