"""Texts that look like something else to YAML come back as they were, through every writer and reader of parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tools.texts import ODD, changed, texts


@pytest.mark.parametrize("seed", [1, 2])
def test_a_text_stays_one_on_every_way(tmp_path: Path, seed: int) -> None:
    assert [(text, ways) for text in texts(len(ODD) + 80, seed) if (ways := changed(text, tmp_path))] == []
