"""What the five tutorials promise, and what shows each promise: the rows of `promises.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).parents[2]


@dataclass(frozen=True)
class Row:
    """One promise. It is shown by tests (node ids of pytest), by other rows, or has a reason why no test shows it."""

    id: str
    text: str
    source: str = ""
    tests: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()
    reason: str = ""

    @property
    def open(self) -> bool:
        """Whether nothing shows it."""
        return not (self.tests or self.rows or self.reason)


def read_rows() -> dict[str, Row]:
    """Every row by its id."""
    table: dict[str, dict[str, Any]] = tomllib.loads(
        Path(__file__).with_name("promises.toml").read_text(encoding="utf-8")
    )
    del table["tutorials"]
    return {
        name: Row(
            name,
            row["promise"],
            row.get("in", ""),
            tuple(row.get("tests", ())),
            tuple(row.get("shown_by", ())),
            row.get("reason", ""),
        )
        for name, row in table.items()
    }
