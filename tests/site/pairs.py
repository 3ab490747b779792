"""The twenty programs for `rclpy`, which the site shows beside ours."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILE = ROOT / "tests" / "interop" / "programs" / "twenty_theirs.py"
PAGE = "docs/howto/port-from-rclpy.md"


def theirs() -> dict[int, str]:
    """Each program by its number."""
    _, *parts = re.split(r"^# -- (\d+)\. .*\n", FILE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {int(number): code.strip() + "\n" for number, code in zip(parts[::2], parts[1::2], strict=True)}


def side_by_side(page: str) -> str:
    """The page with the program for `rclpy` before each of ours."""
    programs = theirs()
    return re.sub(
        r"^## (\d+)\. .*\n", lambda line: f"{line[0]}\n```py\n{programs[int(line[1])]}```\n", page, flags=re.MULTILINE
    )
