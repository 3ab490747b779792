"""The web server of a run. What it is made of is the caller's: the robot knows nothing of browsers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from robot.run.errands import UsageError

if TYPE_CHECKING:
    from actors import System
    from robot.run.options import Options

__all__ = ["ServeWeb", "start"]


class ServeWeb(Protocol):
    """Starts a web server beside a system."""

    async def __call__(
        self,
        system: System,
        /,
        *,
        host: str,
        port: int | None,
        origins: tuple[str, ...],
        security: str | None,
        bags: str | None,
    ) -> None: ...


async def start(system: System, options: Options, serve: ServeWeb | None) -> None:
    """Start the server that the options ask for, if any. A robot goes on without one; raises `UsageError` if it was asked for."""
    web = options.web
    if web is None or serve is None:
        return
    try:
        await serve(system, host=web.host, port=web.port, origins=web.origins, security=options.security, bags=web.bags)
    except Exception as error:
        if web.wanted:
            raise UsageError(f"--web: {error}") from None
        system.log.warning("no web page", because=str(error))
