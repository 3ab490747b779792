"""The signals of one loop: who hears them, who has them afterwards, and what ends a program that nobody can stop."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from actors import Child, Node, Supervisor, background, run
from actors.running import signals
from actors.running.signals import ending_signals, exit_on_sigterm, listen

NUMBERS = [(signal.SIGINT, KeyboardInterrupt, 130), (signal.SIGTERM, SystemExit, 143), (signal.SIGHUP, SystemExit, 129)]


@pytest.fixture(autouse=True)
def _signals_as_they_were(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    before = [signal.getsignal(number) for number, _, _ in NUMBERS]
    monkeypatch.setattr(signals, "ONE_SIGNAL_SECONDS", 0.02)  # less than `turns` take
    yield
    assert [signal.getsignal(number) for number, _, _ in NUMBERS] == before


def raise_soon(number: signal.Signals) -> None:
    asyncio.get_running_loop().call_soon(signal.raise_signal, number)


async def turns(count: int = 3) -> None:
    """Let a signal that was raised come through the loop's pipe."""
    for _ in range(count):
        await asyncio.sleep(0.01)


def test_every_listener_hears_every_signal_until_it_leaves() -> None:
    heard: list[str] = []

    async def main() -> None:
        loop = asyncio.get_running_loop()
        first = listen(loop, lambda number: not heard.append(f"first {number.name}"))
        second = listen(loop, lambda number: not heard.append(f"second {number.name}"))
        raise_soon(signal.SIGTERM)
        await turns()
        first()
        first()  # twice is fine
        raise_soon(signal.SIGINT)
        await turns()
        second()

    asyncio.run(main())
    assert heard == ["first SIGTERM", "second SIGTERM", "second SIGINT"]


def test_when_the_last_one_has_left_the_program_has_its_own_handlers_back_and_may_listen_again() -> None:
    heard: list[str] = []

    def mine(number: int, frame: object) -> None:
        heard.append("mine")

    async def main() -> None:
        for _ in range(2):
            leave = listen(asyncio.get_running_loop(), lambda number: not heard.append("theirs"))
            raise_soon(signal.SIGTERM)
            await turns()
            leave()
            signal.raise_signal(signal.SIGTERM)

    before = signal.signal(signal.SIGTERM, mine)
    try:
        asyncio.run(main())
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == ["theirs", "mine"] * 2


@pytest.mark.parametrize(("number", "error", "code"), NUMBERS)
def test_a_signal_that_nobody_can_do_anything_about_ends_the_program(
    number: signal.Signals, error: type[BaseException], code: int
) -> None:
    heard: list[int] = []

    async def main() -> None:
        listen(asyncio.get_running_loop(), lambda number: bool(heard.append(number)))
        listen(asyncio.get_running_loop(), lambda number: bool(heard.append(number)))
        raise_soon(number)
        await asyncio.sleep(3600.0)

    with pytest.raises(error) as ended:
        asyncio.run(main())
    assert heard == [number, number], "all of them were asked first"
    assert not isinstance(ended.value, SystemExit) or ended.value.code == code


def test_the_third_one_does_not_even_unwind_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    raised: list[tuple[int, object]] = []
    answers = [True, True, False]

    async def main() -> None:
        listen(asyncio.get_running_loop(), lambda number: answers.pop(0))
        with monkeypatch.context() as patch:
            for _ in range(2):
                signal.raise_signal(signal.SIGTERM)
                await turns()
            really = signal.raise_signal
            patch.setattr(signal, "raise_signal", lambda number: raised.append((number, signal.getsignal(number))))
            really(signal.SIGTERM)
            await turns()

    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(SystemExit):
        asyncio.run(main())
    signal.signal(signal.SIGTERM, before)
    assert raised == [(signal.SIGTERM, signal.SIG_DFL)]


def test_a_handler_that_python_does_not_know_is_not_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Such as one that a library in C has set."""
    put: list[object] = []

    async def main() -> None:
        with monkeypatch.context() as patch:
            patch.setattr(signal, "getsignal", lambda number: None)
            leave = listen(asyncio.get_running_loop(), lambda number: True)
            patch.setattr(signal, "signal", lambda number, handler: put.append(handler))
            leave()

    before = [signal.getsignal(number) for number, _, _ in NUMBERS]
    asyncio.run(main())
    for (number, _, _), handler in zip(NUMBERS, before, strict=True):
        signal.signal(number, handler)
    assert put == [signal.default_int_handler, signal.SIG_DFL, signal.SIG_DFL], (
        "what asyncio does when it lets go of them"
    )


# -- a block that goes on when its tree has ended -----------------------------------------------------------------------


class Job(Node):
    """Is done at once, and with it its tree."""

    @background
    async def work(self) -> None:
        self.stop("done")


TREE = Supervisor(
    "system", auto_shutdown="all_significant", children=[Child(Job, restart="transient", significant=True)]
)


@pytest.mark.parametrize(("number", "error", "code"), NUMBERS)
def test_a_block_that_goes_on_after_its_tree_is_interrupted(
    number: signal.Signals, error: type[BaseException], code: int
) -> None:
    codes: list[int] = []

    async def main() -> None:
        async with run(TREE, sinks=()) as system:
            await system.wait()
            raise_soon(number)
            try:
                await asyncio.sleep(3600.0)
            finally:
                codes.append(system.exit_code)

    with pytest.raises(error):
        asyncio.run(main())
    assert codes == [code]


@pytest.mark.parametrize(("number", "error", "code"), NUMBERS)
def test_one_that_swallows_that_too_is_ended_by_the_next_signal(
    number: signal.Signals, error: type[BaseException], code: int
) -> None:
    story: list[str] = []

    async def main() -> None:
        async with run(TREE, sinks=()) as system:
            await system.wait()
            raise_soon(number)
            try:
                await asyncio.sleep(3600.0)
            except asyncio.CancelledError:
                story.append("swallowed")
            await turns()
            raise_soon(number)
            await asyncio.sleep(3600.0)

    with pytest.raises(error):
        asyncio.run(main())
    assert story == ["swallowed"]


# -- a script whose loop runs in another thread --------------------------------------------------------------------------


def test_SIGTERM_ends_a_script_through_its_blocks_and_kills_again_once_it_has_left() -> None:
    handler = exit_on_sigterm()
    assert handler is not None, "nobody else has taken the signal"
    try:
        handler.arm()
        with pytest.raises(SystemExit) as ended:
            signal.raise_signal(signal.SIGTERM)
        assert ended.value.code == 143
        assert exit_on_sigterm() is None, "it is taken"
    finally:
        handler.leave()
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_a_SIGTERM_that_comes_before_there_is_a_block_to_end_waits_for_it() -> None:
    handler = exit_on_sigterm()
    assert handler is not None
    try:
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(SystemExit) as ended:
            handler.arm()
        assert ended.value.code == 143
    finally:
        handler.leave()


# -- a program that hangs, and one that nobody reads -----------------------------------------------------------------------


def test_a_loop_that_does_not_hear_the_first_is_ended_by_the_second(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[int] = []
    said: list[str] = []
    monkeypatch.setattr(os, "_exit", ended.append)
    monkeypatch.setattr(os, "write", lambda output, data: said.append(data.decode()))

    async def main() -> None:
        listen(asyncio.get_running_loop(), lambda number: True)
        for _ in range(3):
            signal.raise_signal(signal.SIGTERM)
            time.sleep(0.015)  # noqa: ASYNC251  # the loop hangs; three of these are more than one signal takes

    asyncio.run(main())
    assert set(ended) == {143}  # twice on a machine that sleeps longer
    assert "ended by SIGTERM: the event loop has not turned for 0.0 s, at " in said[0]
    assert said[0].endswith(f"{main.__qualname__}\n")


def test_SIGHUP_stays_ignored_and_with_it_the_end_of_the_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert ending_signals() == (signal.SIGINT, signal.SIGTERM)
        assert heard_when_the_reader_goes(monkeypatch) == []
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def heard_when_the_reader_goes(monkeypatch: pytest.MonkeyPatch, *, first: signal.Signals | None = None) -> list[int]:
    """What a listener hears when the output is a pipe whose other end is closed, perhaps after another signal."""
    heard: list[int] = []
    reading, writing = os.pipe()
    monkeypatch.setattr(signals, "OUTPUTS", (writing,))

    async def main() -> None:
        leave = listen(asyncio.get_running_loop(), lambda number: not heard.append(number))
        if first is not None:
            raise_soon(first)
            await turns()
        os.close(reading)
        await turns()
        os.write(writing, b"into the void")
        leave()

    asyncio.run(main())
    os.close(writing)
    return heard


def test_the_end_of_the_reader_is_heard_as_SIGPIPE_and_cuts_no_end_short(monkeypatch: pytest.MonkeyPatch) -> None:
    assert heard_when_the_reader_goes(monkeypatch) == [signal.SIGPIPE]
    assert heard_when_the_reader_goes(monkeypatch, first=signal.SIGINT) == [signal.SIGINT]


def test_a_pipe_that_is_read_here_or_still_read_is_no_reader_that_has_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[int] = []
    os.mkfifo(tmp_path / "fifo")
    both = os.open(tmp_path / "fifo", os.O_RDWR)
    monkeypatch.setattr(signals, "OUTPUTS", (both, 987_654))

    async def main() -> None:
        os.write(both, b"something")
        leave = listen(asyncio.get_running_loop(), lambda number: not heard.append(number))
        await turns()
        leave()
        again = listen(asyncio.get_running_loop(), lambda number: not heard.append(number))
        again()

    asyncio.run(main())
    os.close(both)
    assert heard == []


def test_a_script_is_not_cut_short_by_the_same_signal_and_keeps_handlers_that_it_has_set() -> None:
    handler = exit_on_sigterm()
    assert handler is not None
    mine: list[int] = []
    try:
        handler.arm()
        with pytest.raises(SystemExit):
            signal.raise_signal(signal.SIGHUP)
        signal.raise_signal(signal.SIGTERM)
        signal.signal(signal.SIGHUP, lambda number, frame: mine.append(number))
        handler.leave()
        signal.raise_signal(signal.SIGHUP)
        assert mine == [signal.SIGHUP]
    finally:
        handler.leave()
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
