"""`tests.figures maps` on maps small enough to be worked by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.figures import maps
from tests.figures.__main__ import main
from tests.figures.map_questions import Question, read_map, read_questions
from tests.figures.maps import evaluate

MAP = """type octile
height 3
width 5
map
.....
.@@T.
..GSW
"""
HEAD = "version 1\n"


def write(folder: Path, *rows: str, name: str = "small.map", text: str = MAP) -> Path:
    path = folder / name
    path.write_text(text, encoding="ascii")
    (folder / f"{name}.scen").write_text(HEAD + "".join(f"{row}\n" for row in rows), encoding="ascii")
    return path


def row(start: tuple[int, int], goal: tuple[int, int], length: float) -> str:
    """A line of a scenario; cells as (x, y)."""
    return f"0\tsmall.map\t5\t3\t{start[0]}\t{start[1]}\t{goal[0]}\t{goal[1]}\t{length}"


def test_floor_swamp_and_ground_are_passable_and_nothing_else(tmp_path: Path) -> None:
    free = read_map(write(tmp_path))
    assert free.tolist() == [[True] * 5, [True, False, False, False, True], [True, True, True, True, False]]


@pytest.mark.parametrize(
    "text", ["", "height 3\nwidth 5\n", MAP.replace(".@@T.", ".@@T"), MAP.replace("height 3", "height 4")]
)
def test_a_file_that_holds_other_rows_than_it_promises_is_refused_by_name(tmp_path: Path, text: str) -> None:
    path = write(tmp_path, text=text)
    with pytest.raises(
        ValueError, match=r"is not a Moving AI map: it promises .* cells and holds other rows"
    ) as refused:
        read_map(path)
    assert str(path) in str(refused.value)


def test_a_scenario_is_read_with_x_as_column(tmp_path: Path) -> None:
    path = write(tmp_path, row((0, 2), (4, 0), 6.0))
    assert list(read_questions(path.with_name("small.map.scen"))) == [Question((2, 0), (0, 4), 6.0)]


def test_a_row_that_lacks_a_column_is_refused_with_its_line(tmp_path: Path) -> None:
    path = write(tmp_path, row((0, 2), (4, 0), 6.0), "0 small.map 5 3 0 0")
    with pytest.raises(ValueError, match=r"small\.map\.scen:3 has 6 columns; a scenario row has 9"):
        list(read_questions(path.with_name("small.map.scen")))


@pytest.mark.parametrize(("cost", "agrees"), [(100.0, True), (100.0149, True), (100.0151, False), (99.9849, False)])
def test_a_length_agrees_to_the_rounding_of_the_files(cost: float, agrees: bool) -> None:
    assert Question((0, 0), (1, 1), 100.0).agrees(cost) is agrees


def test_every_row_is_held_against_its_length(tmp_path: Path) -> None:
    # Round the wall, without cutting its corner: two up, three along the row above, one more to the corner.
    path = write(
        tmp_path, row((0, 2), (4, 0), 6.0), row((0, 0), (0, 0), 0.0), row((1, 2), (3, 2), 2.5), row((0, 0), (4, 2), 9.0)
    )
    report = evaluate(path)
    assert (report.map, report.width, report.height) == ("small.map", 5, 3)
    assert (report.rows, report.exact) == (4, 2)
    wrong_length, blocked = report.wrong
    assert wrong_length.endswith("length=2.5): 2.000000")
    assert "no path can end at cell (2, 4): it is blocked" in blocked
    assert report.any_angle == pytest.approx(1.0)  # two straight ones and one of a single cell


def test_a_row_without_a_way_is_exact_when_we_find_none_and_wrong_when_we_find_one(tmp_path: Path) -> None:
    walled = MAP.replace(".@@T.", "@@@T@")
    apart = evaluate(
        write(tmp_path, row((0, 0), (0, 2), 0.0), row((0, 0), (4, 0), 4.0), name="walled.map", text=walled)
    )
    assert (apart.exact, apart.rows, apart.wrong) == (2, 2, ())
    joined = evaluate(write(tmp_path, row((0, 0), (0, 2), 0.0), row((0, 0), (0, 0), 0.0)))
    assert (joined.exact, joined.rows) == (1, 2)


def test_open_floor_is_crossed_straight_and_shorter_than_in_octile_steps(tmp_path: Path) -> None:
    text = "type octile\nheight 3\nwidth 6\nmap\n" + "......\n" * 3
    report = evaluate(write(tmp_path, row((0, 0), (5, 2), 3 + 2 * 2**0.5), text=text))
    assert report.exact == 1
    assert report.any_angle == pytest.approx(29**0.5 / (3 + 2 * 2**0.5))


def test_a_limit_spreads_over_all_rows(tmp_path: Path) -> None:
    path = write(tmp_path, *(row((0, 0), (x, 0), float(x)) for x in (0, 1, 2, 3, 4, 4)), row((0, 0), (4, 0), 4.0))
    assert evaluate(path, 3).rows == 3
    assert evaluate(path, 30).rows == 7


def test_the_report_is_a_line_for_each_map_and_the_exit_code_tells_whether_all_is_exact(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, row((0, 2), (4, 0), 6.0))
    assert main(["maps", str(tmp_path)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[1].split()[:7] == ["small.map", "5", "x", "3", "1", "/", "1"]
    assert said[2].startswith("1 / 1 rows exact in ")
    write(tmp_path, row((0, 2), (4, 0), 7.0), name="wrong.map")
    assert main(["maps", str(tmp_path)]) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[3] == "  not exact: Question(start=(2, 0), goal=(0, 4), length=7.0): 6.000000"
    assert main(["maps", str(tmp_path / "small.map"), "--json"]) == 0
    (only,) = json.loads(capsys.readouterr().out)["maps"]
    assert (only["rows"], only["exact"], only["wrong"]) == (1, 1, [])


def test_a_map_without_questions_is_nothing_to_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "alone.map").write_text(MAP, encoding="ascii")
    assert main(["maps", str(tmp_path)]) == 2
    assert "holds no .map file with a .map.scen beside it" in capsys.readouterr().err


def test_a_path_of_turning_cells_is_given_cell_by_cell() -> None:
    cells = list(maps._each_cell([(0, 0), (2, 2), (2, 5), (0, 5)]))
    assert cells == [(0, 0), (1, 1), (2, 2), (2, 3), (2, 4), (2, 5), (1, 5), (0, 5)]
    assert np.abs(np.diff(np.array(cells), axis=0)).max() == 1
