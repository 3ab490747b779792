"""The modules that a program on the real clock imports before its tree starts.

`import actors` is light: numpy, structlog and the parts that few programs need are imported at their first use. In a node that ticks a
hundred times a second, that first use would block the event loop for about 150 ms, so a system on the real clock imports them before its
tree starts. An import that stays lazy takes less than 5 ms, or happens only before the start or after the end of a tree.
"""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import Final

_MODULES: Final = (
    "actors.interfaces.arrays",  # numpy: numeric sequences
    "actors.interfaces.cdr",
    "actors.interfaces.derived",  # what ROS 2 gives every action
    "actors.interfaces.rcl_interfaces.msg",  # /rosout, /parameter_events
    "actors.inbox.load",  # the first measured handler
    "actors.parameters.messages",  # the parameter services
    "actors.runtime.sim_time",  # use_sim_time, set while it runs
    "anyio.to_process",  # offload()
    "anyio.to_thread",
)


def preload(*, structlog: bool = True) -> None:
    """Import these modules, and structlog if `structlog`. Calling it again costs next to nothing."""
    for name in _MODULES:
        import_module(name)
    with suppress(ModuleNotFoundError):  # a private module of anyio, which may move
        import_module("anyio._backends._asyncio")
    if structlog:
        import_module("structlog")
