"""Calls of services by Foxglove clients."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors import ActorError, Service
from actors.interfaces import InterfaceError, encode
from cli.web.clients.conversion import to_json
from cli.web.clients.errors import BadRequest, Refused
from cli.web.foxglove.frames import ServiceRequest, response_frame

if TYPE_CHECKING:
    from cli.web.graph.catalog import ServedService
    from cli.web.hub import Hub

PATIENCE = 30.0
"""Seconds for an answer: a person waits for it."""


async def call(hub: Hub, service: ServedService, request: ServiceRequest) -> bytes:
    """The frame with the response, in the encoding of the request. Raises `Refused`."""
    message = await _decoded(service.type.Request, request, hub)
    contract: Service[Any, Any] = Service(service.type, service.name)
    try:
        response = await hub.node.call(contract, message, timeout=PATIENCE)
        payload = to_json(response) if request.encoding == "json" else encode(response)
    except (ActorError, InterfaceError) as error:
        raise Refused(f"{service.name}: {error}") from None
    return response_frame(request.service, request.call, request.encoding, payload)


async def _decoded(kind: Any, request: ServiceRequest, hub: Hub) -> Any:
    if request.encoding == "json":
        data = await hub.conversions.object(request.payload)
        return await hub.conversions.message(kind, data, hub.system.clock.stamp())
    if request.encoding != "cdr":
        raise Refused(f"encoding {request.encoding!r:.40}: requests come in cdr or json")
    try:
        return await hub.conversions.cdr(kind, request.payload)
    except InterfaceError as error:
        raise BadRequest(str(error)) from None
