"""The words by which the page lists, records and fetches bags. An extension of the Foxglove protocol."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

from cli.web.clients.conversion import write_json
from cli.web.clients.errors import Refused
from cli.web.clients.fields import entries, number, optional_number, text
from cli.web.foxglove.frames import asset_failure, asset_frame

if TYPE_CHECKING:
    from cli.web.clients.client import Client, Session
    from cli.web.clients.operations import Op
    from cli.web.recordings.bags import Bags


def bag_ops(bags: Bags, client: Client, session: Session) -> dict[str, Op]:
    """What a client may ask for, by word. Each request has an `id`; the answer is `robactor.done` with it, and with a value or why not.

    A piece of a file comes as the frame of an asset.
    """

    async def listed(request: dict[str, Any]) -> Any:
        return await bags.report()

    async def record(request: dict[str, Any]) -> Any:
        topics = None if request.get("topics") is None else entries(request, "topics", str)
        return await bags.record(text(request, "name", ""), topics)

    async def stop(request: dict[str, Any]) -> Any:
        await bags.stop()

    async def read(request: dict[str, Any]) -> None:
        id, offset = number(request, "id"), int(optional_number(request, "offset"))
        try:
            client.answer(asset_frame(id, await bags.read(text(request, "name"), text(request, "file"), offset)))
        except Refused as error:
            client.answer(asset_failure(id, str(error)))

    async def answered(work: Callable[[dict[str, Any]], Awaitable[Any]], request: dict[str, Any]) -> None:
        value, why = None, None
        try:
            value = await work(request)
        except Refused as error:
            why = str(error)
        client.answer(write_json({"op": "robactor.done", "id": request.get("id"), "error": why, "value": value}))

    def later(work: Callable[[dict[str, Any]], Awaitable[Any]]) -> Op:
        return lambda request: client.spawn(answered(work, request), session)

    return {
        "robactor.bags": later(listed),
        "robactor.recordBag": later(record),
        "robactor.stopRecording": later(stop),
        "robactor.readBag": lambda request: client.spawn(read(request), session),
    }
