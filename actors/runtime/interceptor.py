"""The one seam for all who stand between nodes and their world: journals, replay, faults, service introspection, spans, taps."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any

from actors.graph.interceptor import TopicInterceptor

if TYPE_CHECKING:
    from actors.actions.client import SentGoals
    from actors.actions.server import ActionServer, ServedGoals
    from actors.graph.servers import ActionEntry
    from actors.interfaces.message import Req, Resp
    from actors.runtime.timers import NodeTimer, Ticked
    from actors.services.client import Client
    from actors.services.peers import Caller, Submit
    from actors.services.server import Handle, Server, Take
    from actors.supervision.peers import Life


class Interceptor(TopicInterceptor):
    """Stands between nodes and their world. This one lets everything pass; a derived class overrides what it watches, changes or plays.

    Each method is called when an endpoint, timer or life is made, with the function by which something is to pass. It returns the function
    that is called instead: the same one, or one of its own that may call it. So what nobody intercepts costs nothing. The first of several
    interceptors is the nearest to the node.
    """

    def life(self, path: tuple[str, ...], make: Callable[[], Life], /) -> Life:
        """Return the next life of the node at `path` for its supervisor. `make()` makes it. Raises what `make` raises."""
        return make()

    def creating_task(self, node: Caller, work: Coroutine[Any, Any, Any], name: str) -> Coroutine[Any, Any, Any]:
        """Return the coroutine that a new task of a node runs instead of `work`."""
        return work

    def entering(self, node: Caller, what: str, enter: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function by which other code sets the ``parameters`` of a node, or makes it ``crash``."""
        return enter

    def invoking(self, node: Caller, label: str, handler: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function to call instead of a handler of the node, of messages, requests or the ticks of `every`. `label` names it in
        reports; it takes and returns what the handler does."""
        return handler

    def calling(self, client: Client[Req, Resp], submit: Submit) -> Submit:
        """Return the function that sends the requests of a client to the server."""
        return submit

    def taking(self, server: Server, take: Take) -> Take:
        """Return the function that takes in the requests to a server."""
        return take

    def handling(self, server: Server, handle: Handle) -> Handle:
        """Return the coroutine function that handles a request to a declared service. It runs in the task of the handler."""
        return handle

    @property
    def of_servers(self) -> bool:
        """Whether servers are to ask this one: whether it overrides one of the two methods before."""
        kind = type(self)
        return kind.taking is not Interceptor.taking or kind.handling is not Interceptor.handling

    def sending_goals(self, node: Caller, entry: ActionEntry, ways: SentGoals) -> SentGoals:
        """Return the functions that send the goals of a node, and their cancellations, to the server."""
        return ways

    def serving_goals(self, server: ActionServer, ways: ServedGoals) -> ServedGoals:
        """Return the functions that take in, run and end the goals of a server."""
        return ways

    def ticking(self, timer: NodeTimer, tick: Ticked) -> Ticked:
        """Return the function that takes the ticks of a timer."""
        return tick

    def drawing(self, node: Caller, draw: Callable[[], bytes]) -> Callable[[], bytes]:
        """Return the function that draws the ids of the goals of a node."""
        return draw
