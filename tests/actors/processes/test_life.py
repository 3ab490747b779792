"""`ProcessLife`, with a process that does nothing but note what is asked of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, cast

import pytest

from actors import Skip, Stop
from actors.errors import ProcessDied
from actors.processes.life import LAST_SECONDS, TERMINATION_SECONDS, UNMET_STOP_SECONDS, ProcessLife
from actors.processes.messages import Event, Order, Over, Ready, Request, StopAsked
from actors.supervision import Failed, Stopped
from tests.actors.supervision.kit import settle, virtual


class Noted:
    """A process that ends when the test lets it. `asked` has what was asked of it, with the time."""

    def __init__(self) -> None:
        self.ended: asyncio.Future[Exception] = asyncio.get_running_loop().create_future()
        self.asked: list[tuple[float, object]] = []
        self.id = 7

    def _note(self, what: object) -> None:
        self.asked.append((round(asyncio.get_running_loop().time(), 6), what))

    def send(self, request: Request) -> None:
        self._note(request)

    def watch(self) -> None:
        self._note("watch")

    def unwatch(self) -> None:
        self._note("unwatch")

    def terminate(self) -> None:
        self._note("terminate")

    def kill(self) -> None:
        self._note("kill")
        if not self.ended.done():
            self.ended.set_result(ProcessDied(7, "killed"))


class Stage:
    """A life under test, with its process and its parent."""

    def __init__(self) -> None:
        self.process = Noted()
        self.take: Callable[[Event], None] = lambda event: None
        self.doomed = False
        self.unmet: Exception | None = None
        self.started = 0
        self.life = ProcessLife(cast("Any", self), self._launch)
        self.task = asyncio.create_task(self.life.run(self._begun))

    async def _launch(self, order: Order, take: Callable[[Event], None]) -> Any:
        self.take = take
        return self.process

    def _begun(self) -> None:
        self.started += 1

    def order(self) -> Any:
        return None

    def begin(self, process: object) -> None: ...

    def end(self) -> None: ...

    async def known(self) -> None:
        if self.unmet is not None:
            raise self.unmet

    def killed(self) -> bool:
        return self.doomed

    async def ready(self) -> None:
        await settle()
        self.take(Ready())
        await settle()
        assert self.started == 1

    async def ends(self, error: BaseException | None = None) -> None:
        """The process tells how its child has ended, and exits."""
        self.take(Over(Stopped("enough") if error is None else Failed(error)))
        self.process.ended.set_result(ProcessDied(7, "exit code 0"))


@virtual
async def test_a_stop_that_takes_too_long_is_followed_by_SIGTERM_and_that_by_SIGKILL() -> None:
    stage = Stage()
    await stage.ready()
    stage.life.stop("enough")
    await asyncio.sleep(5.0)
    stage.doomed = True
    stage.task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await stage.task
    assert stage.process.asked[:4] == [(0, "watch"), (0, "unwatch"), (0, StopAsked("enough")), (5, "terminate")]
    assert stage.process.asked[4] == (5 + TERMINATION_SECONDS, "kill")


@virtual
async def test_a_process_that_ends_by_SIGTERM_is_not_killed() -> None:
    stage = Stage()
    await stage.ready()
    stage.life.stop("enough")
    stage.doomed = True
    stage.task.cancel()
    await settle()
    await stage.ends()
    with pytest.raises(asyncio.CancelledError):
        await stage.task
    await asyncio.sleep(10.0)
    assert "kill" not in [what for _, what in stage.process.asked]


@virtual
async def test_a_kill_without_a_stop_is_SIGKILL_at_once() -> None:
    stage = Stage()
    await stage.ready()
    stage.doomed = True
    stage.task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await stage.task
    assert [what for _, what in stage.process.asked] == ["watch", "kill", "unwatch"]


@virtual
@pytest.mark.parametrize("stops", [True, False])
async def test_a_process_that_is_not_reached_is_stopped_and_its_start_has_failed(stops: bool) -> None:
    stage = Stage()
    stage.unmet = OSError("nobody is there")
    await settle()
    stage.take(Ready())
    await settle()
    if stops:
        await stage.ends()
    with pytest.raises(OSError, match="nobody is there"):
        await stage.task
    assert stage.started == 0
    assert stage.process.asked[0] == (0, StopAsked("nobody is there"))
    assert ((UNMET_STOP_SECONDS, "kill") in stage.process.asked) is not stops


@virtual
async def test_a_process_whose_child_has_ended_has_a_second_to_exit() -> None:
    stage = Stage()
    await stage.ready()
    stage.take(Over(Failed(OSError("broken"))))
    with pytest.raises(OSError, match="broken"):
        await stage.task
    assert stage.process.asked[-1] == (LAST_SECONDS, "kill")


@virtual
async def test_the_end_of_the_child_is_repeated() -> None:
    for over, error in (
        (Over(Stopped("by itself")), Stop),
        (Over(Stopped("not today"), declined=True), Skip),
        (Over(Stopped("gave up", OSError("cause"))), OSError),
        (Over(Failed(ValueError("odd"))), ValueError),
    ):
        stage = Stage()
        await settle()
        stage.take(over)
        stage.process.ended.set_result(ProcessDied(7, "exit code 0"))
        with pytest.raises(error):
            await stage.task
        assert stage.started == 0


@virtual
async def test_a_process_that_ends_without_a_word_has_died() -> None:
    stage = Stage()
    await stage.ready()
    stage.process.ended.set_result(ProcessDied(7, "exit code 3"))
    with pytest.raises(ProcessDied, match="exit code 3"):
        await stage.task
