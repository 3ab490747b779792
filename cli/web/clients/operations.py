"""What a client may ask for by the word `op` of a JSON request, in both protocols."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from cli.web.clients.errors import BadRequest
from cli.web.clients.fields import text

Op = Callable[[dict[str, Any]], Awaitable[None] | None]
"""Does what a request asks for; what it returns is awaited before the next request."""


async def perform(ops: Mapping[str, Op], request: dict[str, Any]) -> None:
    """Do what a request asks for. Raises `BadRequest` for an unknown `op`, and what the operation raises."""
    op = ops.get(text(request, "op"))
    if op is None:
        raise BadRequest(f"there is no op {request['op']!r:.60}")
    waited = op(request)
    if waited is not None:
        await waited
