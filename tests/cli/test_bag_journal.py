"""`bag record --replay NODE --restart`: the journal of a node of a running robot, begun from another terminal, and its replay."""

from __future__ import annotations

import signal
from pathlib import Path

from actors import Child
from actors.replay import Journal, journals_in, load
from tests.actors.replay.story import OTHERS, Hero
from tests.actors.replay.test_subtree import TEAM, Doubler, Source, Summer
from tests.cli.conftest import Command, Start, SystemOf
from tests.facts import lacks
from tests.warm import Process

ABSENT = (
    "no journal of /hero is kept. A journal begins with a life of its node: with --restart the node is restarted now"
)


async def walking(start: Start) -> Process:
    """A robot that runs in another process."""
    process = await start("run", "--backend", "kinematic")
    while b"robot running" not in (line := await process.stderr.readline()):
        assert line
    return process


async def test_a_journal_of_a_running_robot_is_begun_from_another_terminal_and_replayed_in_a_third(
    start: Start, robot: Command, tmp_path: Path
) -> None:
    bag = tmp_path / "walk"
    walk = await walking(start)
    words = ("bag", "record", "--replay", "navigation", "--restart", "-o", str(bag))
    recording = await start(*words)
    assert await recording.stderr.readline() == b"/navigation is restarted, and its journal begins\n"
    assert (await recording.stderr.readline()).startswith(b"Recording into")
    part = await robot("topic", "echo", "--once", "/navigation/_journal", "std_msgs/msg/UInt8MultiArray")
    assert part.code == 0, part.err
    for _ in range(2):  # what is published now has been heard by the recorder, which began before
        heard = await robot("topic", "echo", "--once", "--qos-durability", "volatile", "/navigation/_journal")
        assert heard.code == 0, heard.err
    recording.send_signal(signal.SIGINT)
    assert await recording.wait() == 0
    refused = await robot("bag", "record", "--replay", "motors", "--restart", "-o", str(tmp_path / "none"))
    assert refused.code == 1
    assert "KinematicBody is the robot's hardware" in refused.err
    await walk.close()
    replayed = await robot("bag", "replay", str(bag), "--node", "navigation")
    assert replayed.code == 0, replayed.out + replayed.err
    assert replayed.out.startswith("/navigation: equal; ")


async def test_what_keeps_a_journal_from_being_recorded_is_told_with_the_remedy(
    command: Command, robot: Command, system_of: SystemOf, tmp_path: Path
) -> None:
    path = str(tmp_path / "walk")
    async with system_of(OTHERS, Child(Hero)):
        refused = await command("bag", "record", "--replay", "hero", "-o", path)
        assert (refused.code, refused.out) == (1, "")
        assert (
            "the program of /hero keeps no journals, and begins none: start it with `run --replay hero`" in refused.err
        )
        later = await robot("bag", "record", "--replay", "ghost", "-o", path, "--duration", "0")
        assert later.code == 0
        assert "/ghost is not there; its journal is recorded if its program keeps one" in later.err
    assert journals_in(path) == set()


async def test_a_node_is_not_restarted_unless_that_is_asked_for_nor_if_its_journal_is_kept(
    command: Command, robot: Command, system_of: SystemOf, tmp_path: Path
) -> None:
    journal = Journal(on_request=True, folder=tmp_path / "journals")
    async with system_of(OTHERS, Child(Hero), observers=(journal,)) as system:
        refused = await command("bag", "record", "--replay", "hero", "-o", str(tmp_path / "none"))
        assert (refused.code, system.node(Hero).incarnation) == (1, 1)
        assert ABSENT in refused.err
        ghost = await command("bag", "record", "--replay", "heroe", "--restart", "-o", str(tmp_path / "none"))
        assert ghost.code == 1
        assert "did you mean '/hero'?" in ghost.err
        for number in range(2):
            words = ("--replay", "/hero", "--restart", "--duration", "1", "-o", str(tmp_path / f"walk{number}"))
            done = await robot("bag", "record", *words)
            assert done.code == 0, done.err
            assert system.node(Hero).incarnation == 2
    assert load(tmp_path / "journals" / "hero.journal").start.incarnation == 2


async def test_the_journal_of_a_subtree_is_recorded_from_another_terminal_and_replayed(
    command: Command, robot: Command, system_of: SystemOf, tmp_path: Path
) -> None:
    async with system_of(Child(Source), TEAM, observers=(Journal(on_request=True),)) as system:
        refused = await command("bag", "record", "--replay", "--subtree", "system/team", "-o", str(tmp_path / "none"))
        assert refused.code == 1
        assert (
            "no journal of system/team is kept. A journal begins with a life of its node: with --restart" in refused.err
        )
        words = ("--replay", "--subtree", "system/team", "--restart", "--duration", "2", "-o", str(tmp_path / "walk"))
        done = await robot("bag", "record", *words)
        assert done.code == 0, done.err
        assert "system/team is restarted, and its journal begins" in done.err
        assert [system.node(one).incarnation for one in (Doubler, Summer)] == [2, 2]
    replayed = await command("bag", "replay", str(tmp_path / "walk"), "--subtree", "system/team")
    assert replayed.code == 0, replayed.out + replayed.err
    assert replayed.out.startswith("system/team: equal; ")


async def test_of_a_subtree_that_is_not_there_the_journal_is_waited_for(
    command: Command, robot: Command, system_of: SystemOf, tmp_path: Path
) -> None:
    path = str(tmp_path / "walk")
    async with system_of(OTHERS):
        later = await robot("bag", "record", "--subtree", "system/team", "-o", path, "--duration", "0")
        assert later.code == 0
        assert "system/team is not there; its journal is recorded if its program keeps one" in later.err
        never = await command("bag", "record", "--subtree", "system/team", "--restart", "-o", str(tmp_path / "none"))
        assert never.code == 1
        assert "start it with `run --replay system/team`" in never.err
    unsaid = await command("bag", "record", "--replay", "-o", str(tmp_path / "none"))
    assert unsaid.code == 1
    assert lacks(unsaid.err, "--replay node --subtree PATH") == []
