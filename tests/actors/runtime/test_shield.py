"""What is seen through to its end, whoever is canceled meanwhile."""

from __future__ import annotations

import asyncio
import sys

import anyio
import pytest

from actors.shield import see_through, shield

pytestmark = pytest.mark.virtual


def end_after(seconds: float) -> asyncio.Future[None]:
    loop = asyncio.get_running_loop()
    end: asyncio.Future[None] = loop.create_future()
    loop.call_later(seconds, end.set_result, None)
    return end


async def test_who_is_canceled_again_and_again_waits_all_the_same_and_hears_the_first_of_them() -> None:
    task = asyncio.create_task(see_through(end_after(1.0)))
    for word in ("first", "second", "third"):
        await asyncio.sleep(0.1)
        task.cancel(word)
    begun = asyncio.get_running_loop().time()
    with pytest.raises(asyncio.CancelledError, match="first"):
        await task
    assert asyncio.get_running_loop().time() - begun == pytest.approx(0.7)


async def test_a_canceled_scope_does_not_shorten_it() -> None:
    loop = asyncio.get_running_loop()
    with anyio.move_on_after(0.1) as scope:
        await see_through(end_after(1.0))
        assert loop.time() == 1.0
        await asyncio.sleep(0)
        raise AssertionError("the scope was canceled long ago")
    assert scope.cancelled_caught


async def test_an_end_that_has_come_is_not_waited_for_and_what_it_raises_is_its_own() -> None:
    end: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    end.set_exception(OSError("not mine"))
    await see_through(end)
    assert str(end.exception()) == "not mine"


async def test_without_anyio_there_is_no_scope_to_be_shielded_from(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "anyio")
    with shield() as nothing:
        await asyncio.sleep(0)
    assert nothing is None
    assert "anyio" not in sys.modules, "its import would hold up the loop"
