"""The diagrams of the documents: their source in Mermaid's language, and the pictures in docs/diagrams that the site shows of them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.site.markdown import blocks

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "diagrams"
THEMES = {"light": "neutral", "dark": "dark"}
"""Mermaid's themes for the two colours of the site."""


class Diagram(NamedTuple):
    """One diagram. The name of its picture is made of its text, so a picture is never out of date: it is there or not."""

    source: str

    def picture(self, colour: str) -> Path:
        """The file with its picture for a light or a dark page."""
        return FOLDER / f"{hashlib.sha256(self.source.encode()).hexdigest()[:12]}-{colour}.svg"


def diagrams() -> Iterator[Diagram]:
    """All diagrams of the documents."""
    for path in sorted((ROOT / "docs").rglob("*.md")):
        for language, code in blocks(path.read_text(encoding="utf-8")):
            if language == "mermaid":
                yield Diagram(code)
