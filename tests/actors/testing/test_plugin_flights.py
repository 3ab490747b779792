"""The flight records of failed tests: where they are found, and when there are none."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader

from tests.actors.testing.test_plugin import suite

FAILING = """
    from actors import Topic, publishes
    from actors.interfaces.std_msgs.msg import String

    class Talker(Node):
        out = publishes(Topic(String, "chatter"))

        @every(hz=10)
        def talk(self):
            self.out(String(data="hello"))

    @pytest.mark.parametrize("word", ["a/b"])
    async def test_it_talks(rig, word):
        await rig.start(Talker, seed=5)
        await rig.advance(1.0)
        assert word == "never"
"""
NAME = "test_a_failing_test_leaves_a_record_that_its_report_names.py"


def record_in(outcome: pytest.RunResult) -> Path:
    """The path under the headline of the report."""
    lines = outcome.outlines
    headline = next(number for number, line in enumerate(lines) if "- flight record -" in line)
    return Path(lines[headline + 1])


def content(path: Path) -> tuple[dict[str, int], dict[str, str]]:
    """How many messages a file has on each topic, and what it says of itself."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        topics: dict[str, int] = {}
        for _, channel, _ in reader.iter_messages():
            topics[channel.topic] = topics.get(channel.topic, 0) + 1
        return topics, next(one.metadata for one in reader.iter_metadata())


def test_a_failing_test_leaves_a_record_that_its_report_names(pytester: pytest.Pytester) -> None:
    outcome = suite(pytester, FAILING, "--basetemp=temporary")
    outcome.assert_outcomes(failed=1)
    path = record_in(outcome)
    test = f"{NAME}::test_it_talks[a/b]"
    assert path == pytester.path / "temporary" / "flight-records" / f"{NAME}-test_it_talks-a-b.mcap"
    topics, facts = content(path)
    assert topics == {"/chatter": 10, "/rosout": 1, "/supervisor_events": 1}
    assert (facts["seed"], facts["test"]) == ("5", test)


def test_the_command_line_chooses_the_folder(pytester: pytest.Pytester) -> None:
    outcome = suite(pytester, FAILING, "--flight-records", "made/for/it", "-o", "flight_records=not_this")
    assert record_in(outcome).parent == pytester.path / "made" / "for" / "it"
    assert not (pytester.path / "not_this").exists()


def test_the_ini_file_chooses_the_folder(pytester: pytest.Pytester) -> None:
    outcome = suite(pytester, FAILING, "-o", "flight_records=flights")
    assert record_in(outcome).parent == pytester.path / "flights"


def test_a_leak_is_recorded_with_the_end_of_the_system(pytester: pytest.Pytester) -> None:
    body = """
        async def test_leaky(rig):
            await rig.start(Node)
            rig.kept = asyncio.create_task(asyncio.sleep(1e6), name="forgotten")
    """
    outcome = suite(pytester, body, "--flight-records", "flights")
    outcome.assert_outcomes(passed=1, errors=1)
    assert content(record_in(outcome))[0]["/supervisor_events"] == 1


def test_there_is_no_record_of_what_passes_or_has_no_system(pytester: pytest.Pytester) -> None:
    body = """
        async def test_passes(rig):
            await rig.start(Node)

        async def test_fails_before_it_starts(rig):
            raise AssertionError("early")

        def test_without_a_rig():
            raise AssertionError("plain")
    """
    outcome = suite(pytester, body, "--flight-records", "flights")
    outcome.assert_outcomes(passed=1, failed=2)
    outcome.stdout.no_fnmatch_line("*flight record*")
    assert not (pytester.path / "flights").exists()


def test_a_record_that_cannot_be_written_does_not_hide_the_failure(pytester: pytest.Pytester) -> None:
    (pytester.path / "flights").write_text("a file, not a folder")
    outcome = suite(pytester, FAILING, "--flight-records", "flights")
    outcome.assert_outcomes(failed=1)
    outcome.stdout.fnmatch_lines(["*- flight record -*", "could not be written: *flights*"])
