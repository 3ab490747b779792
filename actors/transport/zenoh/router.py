"""A router: the meeting point of several machines, which carries what their processes cannot exchange directly."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from actors.transport.security import Security
from actors.transport.worker import Worker
from actors.transport.zenoh.config import router_settings, write_config
from actors.transport.zenoh.library import cannot_listen, import_zenoh


@asynccontextmanager
async def router(
    listen: tuple[str, ...], connect: tuple[str, ...] = (), security: Security | None = None
) -> AsyncGenerator[str]:
    """Run a router at the endpoints `listen`, joined with those at `connect`, while the block runs. Yields its identity.

    It lets in and passes on what `security` allows. Raises `WireUnavailable` if it cannot listen at one of them.
    """
    library = import_zenoh()
    config = write_config("", router_settings(listen, connect, security))
    worker = Worker("zenoh-router")
    try:
        try:
            session = await worker.result(lambda: library.open(config))
        except library.ZError as error:
            raise cannot_listen(listen, error) from error
        try:
            yield str(session.zid())
        finally:
            await worker.result(session.close)
    finally:
        worker.close()
