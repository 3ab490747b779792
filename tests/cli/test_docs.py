"""docs/cli.md says what the commands do."""

from __future__ import annotations

import pytest

from tests.cli_docs import PAGE, SCENES, codes, masked, part, transcript, verbs


def test_the_page_lists_every_verb_and_every_exit_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    remedy = "run python -m tests.cli_docs"
    assert part(page, "verbs") == verbs(), remedy
    assert part(page, "exit codes") == codes(), remedy


def test_the_transcript_has_every_command_of_the_tutorials() -> None:
    shown = part(PAGE.read_text(encoding="utf-8"), "transcript").splitlines()
    for scene in SCENES:
        for command in scene.commands:
            assert f"$ robactor {command.line}" in shown


@pytest.mark.realtime
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.title)
def test_the_transcript_is_what_the_commands_print(scene: object) -> None:
    page = part(PAGE.read_text(encoding="utf-8"), "transcript")
    (shown,) = [f"### {each}" for each in page.split("### ")[1:] if each.startswith(f"{scene.title}\n")]  # type: ignore[attr-defined]
    assert masked(shown.strip()) == masked(transcript([scene]).strip())  # type: ignore[list-item]
