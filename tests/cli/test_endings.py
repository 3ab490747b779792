"""How commands end: exit codes, errors that nobody foresaw, Ctrl-C, SIGTERM and closed pipes."""

from __future__ import annotations

import asyncio
import signal
import sys

import pytest

from cli.command import COMMANDS, Exit, found, run_command
from cli.verb import Group
from tests.cli.conftest import Command, Start, SystemOf
from tests.cli.stage import Talker


@pytest.mark.parametrize(
    ("number", "words", "code"),
    [
        (signal.SIGINT, (), 130),
        (signal.SIGINT, ("--ros2-exit-codes",), 2),
        (signal.SIGTERM, (), 143),
        (signal.SIGTERM, ("--ros2-exit-codes",), 15),
        (signal.SIGHUP, (), 129),
    ],
)
async def test_a_signal_ends_a_command_in_order_and_without_a_word(
    number: int, words: tuple[str, ...], code: int, system_of: SystemOf, start: Start
) -> None:
    async with system_of(Talker) as system:
        process = await start("topic", "echo", "/chatter", *words)
        async with asyncio.timeout(30):
            while b"hello" not in await process.stdout.readline():
                pass
        process.send_signal(number)
        process.send_signal(number)  # as `timeout` does
        async with asyncio.timeout(30):
            _, error = await process.communicate()
        assert (process.returncode, error) == (code, b"")
        async with asyncio.timeout(10):
            while list(system.graph.elsewhere()):
                await asyncio.sleep(0.01)


@pytest.mark.realtime
@pytest.mark.parametrize("verb", ["hz", "echo"])
async def test_ctrl_c_at_any_moment_leaves_no_traceback(
    verb: str, system_of: SystemOf, environment: dict[str, str]
) -> None:
    async with system_of(Talker):
        for delay in (0.03, 0.06, 0.1, 0.13, 0.16, 0.19, 0.22, 0.26, 0.3, 0.4, 0.6):
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "robot", "topic", verb, "/chatter", env=environment, stdout=-1, stderr=-1
            )
            await asyncio.sleep(delay)
            process.send_signal(signal.SIGINT)
            async with asyncio.timeout(10):
                _, error = await process.communicate()
            # A signal that comes while Python itself starts is Python's; from our first line on, no trace is left.
            assert b"in console" not in error and b"/cli/" not in error, (delay, error)
            if b"KeyboardInterrupt" not in error:
                assert (process.returncode in (130, -signal.SIGINT), error) == (True, b""), delay


async def test_a_reader_that_goes_ends_a_command_without_a_word(
    system_of: SystemOf, environment: dict[str, str]
) -> None:
    async with system_of(Talker):
        process = await asyncio.create_subprocess_shell(
            f"{sys.executable} -m robot topic echo /chatter | head -n 1", env=environment, stdout=-1, stderr=-1
        )
        async with asyncio.timeout(30):
            out, error = await process.communicate()
    assert (out, error) == (b"data: hello\n", b"")


async def test_an_error_that_nobody_foresaw_is_one_line(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: Group, argv: object) -> int:
        raise RuntimeError("two\nlines")

    monkeypatch.setattr(Group, "main", broken)
    failed = await command("daemon", "status")
    assert (failed.code, failed.out) == (1, "")
    assert failed.err == "RuntimeError: two lines (ROBACTOR_TRACEBACK=1 shows where)\n"
    monkeypatch.setenv("ROBACTOR_TRACEBACK", "1")
    with pytest.raises(RuntimeError, match="two"):
        run_command("daemon", ["status"])


async def test_a_group_without_a_verb_prints_its_help(command: Command) -> None:
    for group in ("node", "topic", "service", "action", "param", "lifecycle", "interface", "pkg", "component"):
        helped = await command(group)
        assert helped.code == 0
        assert helped.out.startswith(f"usage: robactor {group} ")


@pytest.mark.parametrize("name", [*COMMANDS, "map_saver_cli"])
async def test_the_help_of_every_verb_fits_into_60_columns(
    name: str, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    group = found(name)
    verbs = list(group.verbs) if isinstance(group, Group) else []
    for verb in ((), *((each,) for each in verbs)):
        helped = await command(name, *verb, "--help")
        assert helped.code == 0
        assert max(map(len, helped.out.splitlines())) <= 60, (name, *verb)


def test_our_exit_codes_are_those_of_ros_2_but_where_a_script_would_be_deceived() -> None:
    differ = {one.name for one in Exit if one.value[0] != one.value[1]}
    assert differ == {"REFUSED", "INTERRUPTED", "TERMINATED"}
    assert (Exit.REFUSED.value, Exit.INTERRUPTED.value, Exit.TERMINATED.value) == ((1, 0), (130, 2), (143, 15))


async def test_a_middleware_that_is_none_is_one_line(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_connextdds")
    for words in (("node", "list"), ("param", "list"), ("topic", "hz", "/x")):
        refused = await command(*words)
        assert (refused.code, refused.out) == (1, "")
        assert refused.err.startswith("RMW_IMPLEMENTATION is rmw_connextdds")
        assert refused.err.count("\n") == 1
