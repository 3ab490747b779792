"""The documents and the transcript beside this file say what the commands do."""

from __future__ import annotations

import pytest

from tests.tools.cli_docs import DOCTOR, DOCTORS, PAGE, SCENES, TRANSCRIPT, codes, masked, part, transcript, verbs


def test_the_page_lists_every_verb_and_every_exit_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    remedy = "run python -m tests.tools.cli_docs"
    assert part(page, "verbs") == verbs(), remedy
    assert part(page, "exit codes") == codes(), remedy


def test_the_transcript_has_every_command_of_the_tutorials() -> None:
    shown = TRANSCRIPT.read_text(encoding="utf-8").splitlines()
    for scene in SCENES:
        for command in scene.commands:
            assert f"$ robactor {command.line}" in shown


@pytest.mark.realtime
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.title)
def test_the_transcript_is_what_the_commands_print(scene: object) -> None:
    page = TRANSCRIPT.read_text(encoding="utf-8")
    (shown,) = [f"### {each}" for each in page.split("### ")[1:] if each.startswith(f"{scene.title}\n")]  # type: ignore[attr-defined]
    assert masked(shown.strip()) == masked(transcript([scene]).strip())  # type: ignore[list-item]


@pytest.mark.realtime
def test_the_doctor_says_what_the_page_shows() -> None:
    page = part(DOCTORS.read_text(encoding="utf-8"), "doctor")
    assert masked(page.strip()) == masked(transcript([DOCTOR]).strip())
