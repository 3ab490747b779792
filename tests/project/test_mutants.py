"""The mutation command: every mistake is one small change, and its trial tells tests that notice from tests that do not."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from tests.tools.mutants.__main__ import ROOT, drawn, killed_share, score
from tests.tools.mutants.mutate import Mutant, mutants_of
from tests.tools.mutants.trial import SUBJECTS, Workshop

SOURCE = '''"""A docstring, left alone: True."""
from typing import TYPE_CHECKING, Protocol
if TYPE_CHECKING:
    X = 1
__all__ = ["clamp"]
State: TypeAlias = Literal["empty", "full"]
LIMIT: float = 1.0
class Shape(Protocol):
    def size(self) -> int: return 1
class Pen:
    def __init__(self) -> None:
        self.ink = None
    def __repr__(self) -> str:
        return "pen" if self.ink else "é"
    def fill(self, ink: "list[int]", low: int, high: int) -> "int | None":
        """Fill it: 1."""
        self.ink = ink
        assert low < 5, "left alone"
        if low <= high and not ink:
            return low + 2
        for drop in reversed(ink):
            if drop == 3:
                continue
            self.count += 1
            ink.append(f"left {1 + 1} alone")
        while low is None:
            raise ValueError("a message, left alone")
        return min(low, high)
    async def write(self, pause: "object") -> None:
        await pause
        print("a message", await pause)
        return
'''


def changes(line: str) -> set[tuple[str, str]]:
    """The mutants of the sample at this line: kind and line after."""
    return {(mutant.kind, mutant.after) for mutant in mutants_of("pen.py", SOURCE) if mutant.before == line}


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (
            "if low <= high and not ink:",
            {
                ("condition negated", "if (not (low <= high and (not ink))):"),
                ("comparison", "if (low < high) and not ink:"),
                ("and/or", "if (low <= high or not ink):"),
                ("operand removed", "if (low <= high):"),
                ("operand removed", "if (not ink):"),
                ("not removed", "if low <= high and ink:"),
            },
        ),
        (
            "return low + 2",
            {
                ("return value", "return None"),
                ("arithmetic", "return (low - 2)"),
                ("constant", "return low + 3"),
                ("constant", "return low + 1"),
            },
        ),
        ("for drop in reversed(ink):", {("loop skipped", "for drop in ():"), ("call", "for drop in ink:")}),
        (
            "if drop == 3:",
            {("comparison", "if (drop != 3):"), ("constant", "if drop == 4:"), ("constant", "if drop == 2:")},
        ),
        ("continue", {("break/continue", "break")}),
        (
            "self.count += 1",
            {
                ("statement removed", "pass"),
                ("arithmetic", "self.count -= 1"),
                ("constant", "self.count += 2"),
                ("constant", "self.count += 0"),
            },
        ),
        (
            'ink.append(f"left {1 + 1} alone")',
            {("statement removed", "pass"), ("call", 'ink.appendleft(f"left {1 + 1} alone")')},
        ),
        ("while low is None:", {("comparison", "while (low is not None):")}),
        ('raise ValueError("a message, left alone")', {("statement removed", "pass")}),
        ("return min(low, high)", {("return value", "return None"), ("call", "return max(low, high)")}),
        ("self.ink = ink", {("statement removed", "pass")}),
        ("await pause", {("statement removed", "pass")}),
        (
            'print("a message", await pause)',
            {("statement removed", "pass"), ("await removed", 'print("a message", pause)')},
        ),
        ("return", {("return removed", "pass")}),
        ("LIMIT: float = 1.0", {("constant", "LIMIT: float = 2.0")}),
    ],
)
def test_a_line_has_these_mutants(line: str, wanted: set[tuple[str, str]]) -> None:
    assert changes(line) == wanted


def test_what_no_behavior_depends_on_is_left_alone() -> None:
    lines = {mutant.before for mutant in mutants_of("pen.py", SOURCE)}
    for text in ("docstring", "X = 1", "__all__", "State", "size", "self.ink = None", '"pen"', "Fill it", "assert"):
        assert not any(text in line for line in lines), text


def test_all_mutants_of_a_file_are_python_and_all_different() -> None:
    path = ROOT / "actors" / "services" / "server.py"
    source = path.read_text(encoding="utf-8")
    mutants = mutants_of(path.name, source)
    texts = [mutant.source for mutant in mutants]
    assert len(texts) > 50
    assert len(set(texts)) == len(texts)
    assert source not in texts
    for mutant in mutants:
        compile(mutant.source, str(mutant), "exec")


def test_the_files_and_tests_of_every_subject_exist() -> None:
    for subject in SUBJECTS.values():
        for pattern in (*subject.files, *(test for test in subject.tests if test.startswith("tests/"))):
            assert list(ROOT.glob(pattern)), pattern


def test_the_draw_is_the_same_for_the_same_seed() -> None:
    first, again, other = (drawn(ROOT, ["services"], 10, seed) for seed in (1, 1, 2))
    assert first == again != other
    assert len(first) == 10


@pytest.mark.slow(reason="the tests of a project, three times")
def test_a_mutant_that_is_noticed_is_killed_and_one_that_is_not_survives(tmp_path: Path) -> None:
    project = tmp_path / "project"
    (project / "shop").mkdir(parents=True)
    (project / "tests").mkdir()
    (project / "pyproject.toml").write_text("")
    (project / "shop" / "__init__.py").write_text("")
    source = (
        "def price(n):\n    while n < 0:\n        n += 1\n    if n > 10:\n        return n * 9\n    return n * 10\n"
    )
    (project / "shop" / "till.py").write_text(source)
    (project / "tests" / "test_till.py").write_text(
        "from shop.till import price\ndef test_price():\n    assert price(1) == 10\n    assert price(20) == 180\n    price(-1)\n"
    )
    mutants = {mutant.after: mutant for mutant in mutants_of("shop/till.py", source)}
    (tmp_path / "copy").mkdir()
    workshop = Workshop(project, tmp_path / "copy", ("shop", "tests"))
    tests = ("tests/test_*.py",)

    assert workshop.baseline(tests) > 0.0
    assert workshop.try_out(mutants["return (n / 9)"], tests, 60.0) == "killed"
    assert workshop.try_out(mutants["if (n >= 10):"], tests, 60.0) == "survived"
    assert workshop.try_out(mutants["n -= 1"], tests, 3.0) == "timed out"
    assert workshop.baseline(tests) > 0.0, "the copy is as it was"


def test_tests_that_fail_without_mutants_are_said_so(tmp_path: Path) -> None:
    project = tmp_path / "project"
    (project / "tests").mkdir(parents=True)
    (project / "pyproject.toml").write_text("")
    (project / "tests" / "test_it.py").write_text("def test_it():\n    assert 'this' == 'that'\n")
    (tmp_path / "copy").mkdir()
    workshop = Workshop(project, tmp_path / "copy", ("tests",))
    with pytest.raises(RuntimeError, match=r"pytest exited with 1:[\s\S]*assert 'this' == 'that'"):
        workshop.baseline(("tests",))


def test_the_score_counts_what_took_too_long_as_killed() -> None:
    counts = Counter({"killed": 6, "timed out": 1, "survived": 1})
    assert killed_share(counts) == 87.5
    assert {"7", "8", "87.5"} <= set(score(counts).split())
    assert killed_share(Counter()) == 100.0


def test_a_mutant_tells_its_place_and_its_change() -> None:
    mutant = Mutant("shop/till.py", 4, "comparison", "if n > 10:", "if n >= 10:", "")
    assert str(mutant) == "shop/till.py:4  comparison:  if n > 10:  ->  if n >= 10:"
