"""The wait of a node for the servers of services and actions."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.time.deadlines import check_timeout

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.contracts.contracts import Action, Service
    from actors.runtime.machinery import Machinery

__all__ = ["wait_for"]


async def wait_for(
    life: Machinery, contracts: Iterable[Service[Any, Any] | Action[Any, Any, Any]], timeout: float | None
) -> None:
    """Wait until each of these is served, `timeout` seconds at most in all. Raises what `Node.wait_for` raises."""
    from actors.contracts.contracts import Service

    if timeout is not None:
        check_timeout(f"{life.fqn}.wait_for", timeout)
    end = None if timeout is None else life.runtime.loop.time() + timeout
    graph = life.runtime.graph
    for contract in contracts:
        name = life.identity.service(contract.name)
        entry = graph.service(name) if isinstance(contract, Service) else graph.action(name)
        try:
            async with asyncio.timeout_at(end):
                await entry.available()
        except TimeoutError:
            assert timeout is not None
            raise entry.unavailable(timeout) from None
