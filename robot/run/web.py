"""The web server of a run. What it is made of is the caller's: the robot knows nothing of browsers."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final, Protocol

from actors import Backoff, Child, Intensity, System
from cli.command import UsageError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from robot.run.options import Options

AGAIN: Final = Backoff(0.5, 30.0)
"""The pause before the server's process is started again, however often it fails: the STOP of the page must not stay away."""
ANY: Final = Intensity(100, within=60.0)
"""More restarts than `AGAIN` allows."""
HANG: Final = 30.0
"""Seconds for which its event loop may stand still: it steps aside for all others, and nobody depends on it."""


class ServeWeb(Protocol):
    """Starts a web server beside a system, by `apart`, which starts a node in a process of its own."""

    async def __call__(
        self,
        system: System,
        /,
        *,
        host: str,
        port: int | None,
        origins: tuple[str, ...],
        security: str | None,
        apart: Callable[[Child], Awaitable[object]],
        bags: str | None,
    ) -> None: ...


async def start(system: System, options: Options, serve: ServeWeb | None) -> None:
    """Start the server that the options ask for, if any. A robot goes on without one; raises `UsageError` if it was asked for."""
    web = options.web
    if web is None or serve is None:
        return
    try:
        await serve(
            system, host=web.host, port=web.port, origins=web.origins, security=options.security, bags=web.bags,
            apart=partial(_start_apart, system),
        )  # fmt: skip
    except Exception as error:
        if web.wanted:
            raise UsageError(f"--web: {error}") from None
        system.log.warning("no web page", because=str(error))


async def _start_apart(system: System, server: Child) -> None:
    """Start the server in a process of its own, which leaves the processors to the robot: what clients send is never read in the loop that walks."""
    from actors import Child, Supervisor, temporary
    from robot.nodes.process_care import ProcessCare

    assert system.supervisor is not None
    care = Child(ProcessCare, name="web_process", args=("web", None))
    await system.supervisor.start_child(
        Supervisor(
            "web",
            restart=temporary,
            intensity=ANY,
            children=[Supervisor("page", process=True, hang=HANG, backoff=AGAIN, children=[care, server])],
        )
    )
