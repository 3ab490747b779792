"""Call cycles over several processes: each is found by the process in which it is closed, or by a question that follows it.

A request that reaches a node which waits, in the end, for a node of the request's own chain is refused at once. If the wait leads to another
process, that process is asked: it goes on from there, and so on. A process that finds a node of the chain at the end of its own waits fails the
call that closes the cycle. The request that arrives last in a cycle finds all others waiting, so every cycle is found.

Anybody can ask about any chain. So a process believes nothing but the waits of its own nodes: where a chain of others ends at one of these, it
asks on its own along what that node waits for. Its question has a secret number, which only the processes get to know that are waited for. If it
comes back, there is a cycle.
"""

from __future__ import annotations

import secrets
from typing import Any

from actors.errors import CallCycle
from actors.services.peers import Caller, OpenCall
from actors.transport.chains import chain_of, waits_of
from actors.transport.format.errors import WireFormatError
from actors.transport.format.extensions import Extension, Waiting, parse_extension, write_extension
from actors.transport.local_side import LocalSide


class Cycles:
    """The part of one system in finding them.

    Invariant: `_own` holds the secret numbers of the questions about calls that are open.
    """

    def __init__(self, side: LocalSide) -> None:
        self._side = side
        self._own: dict[OpenCall, int] = {}

    def identity(self, fqn: str) -> tuple[str, int]:
        """The session and the number of a node of this process."""
        return self._side.session, self._side.node(fqn).number

    def find(self, fqn: str) -> Caller | None:
        """A node of this process, if it is running."""
        return self._side.runtime.directory.find(fqn)

    def extension_of(self, caller: Caller) -> Extension | None:
        """What a request that `caller` is about to send says: which nodes wait for its answer; None if none does."""
        chain = chain_of(self, caller)
        return Extension(chain=chain) if chain else None

    def refusal(self, node: Caller, chain: tuple[Waiting, ...]) -> CallCycle | None:
        """The error for a request with this chain to `node`, if it closes a cycle; other processes are asked if they may know."""
        waits = waits_of(self, node, chain) if chain else None
        if waits is None:
            return None
        if waits.cycle:
            return CallCycle(waits.cycle)
        self._follow((*chain, *waits.nodes), waits.last.server)
        return None

    def suspect(self, caller: Caller, node: Caller) -> None:
        """`caller` is about to wait for `node`, which waits for another process: ask whether that waits for `caller`.

        Raises CallCycle if it is known here that it does.
        """
        refusal = self.refusal(node, chain_of(self, caller))
        if refusal is not None:
            caller.cycle_refused(refusal)
            raise refusal

    def _follow(self, chain: tuple[Waiting, ...], server: Any) -> None:
        session, number = server.identity
        question = Extension(
            chain=(*chain, Waiting(session=session, node_id=number, name=server.host)), reason=server.name
        )
        self._side.participant.tell(session, write_extension(question))

    def told(self, data: bytes) -> None:
        """A question of another process has arrived. What answers it are the questions that follow from it."""
        try:
            asked = parse_extension(data)
        except WireFormatError as error:
            self._side.unreadable.note("a question about a cycle of calls cannot be read", "", error)
            return
        if asked is not None and asked.chain:
            self._examine(asked.chain[:-1], asked.chain[-1], asked.reason)

    def _examine(self, chain: tuple[Waiting, ...], last: Waiting, name: str) -> None:
        """All of `chain` wait for the node `last`, which is to answer `name`."""
        fqn = self._side.named(last.node_id)
        node = None if fqn is None else self.find(fqn)
        known = self._side.runtime.graph.services.get(name)
        server: Any = None if known is None else known.local
        if node is None or (server is not None and server.concurrent):
            return
        waits = waits_of(self, node, chain)
        if waits is None:
            return
        if not waits.cycle:
            self._follow((*chain, *waits.nodes), waits.last.server)
        elif (chain[0].session, chain[0].node_id) == (self._side.session, self._own.get(waits.last)):
            waits.last.future.set_exception(CallCycle(waits.cycle))
        else:
            reached: Any = waits.last.server.node if waits.nodes else node
            self._verify(waits.last, reached)

    def _verify(self, call: OpenCall, node: Caller) -> None:
        """Others say that `node` waits for itself, by way of `call`: ask along what it waits for."""
        waits = waits_of(self, node, ())
        if waits is None:
            return
        number = self._own.get(call)
        if number is None:
            number = self._own[call] = secrets.randbits(64)
            call.future.add_done_callback(lambda _: self._own.pop(call))
        head = Waiting(session=self._side.session, node_id=number, name="")
        self._follow((head, *waits.nodes), waits.last.server)
