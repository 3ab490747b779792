"""`Agent`: what runs on a machine that takes parts of trees elsewhere."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Final, Protocol

from actors.errors import ProcessDied
from actors.hosts.lease import ASKING, Holding
from actors.hosts.messages import (
    Hello,
    Launch,
    Launched,
    LeaseGrant,
    LeaseRequest,
    Leaving,
    ProcessEnded,
    ProcessEvent,
    ProcessRequest,
    Signaled,
    ToAgent,
    Watched,
    Wire,
)
from actors.logs import WARN
from actors.processes.life import Process
from actors.processes.messages import Event, Line, Opaque, Request, StopAsked
from actors.processes.pickling import pack

MOST_UNSENT: Final = 1_000_000
"""While so many bytes of a session wait to be sent, log lines are counted instead."""


class Running(Process, Protocol):
    """A process that an agent has launched. Requests may be packed."""

    def send(self, request: Request | Opaque, /) -> None: ...


Launcher = Callable[[Launch, Callable[[Event | Opaque], None]], Awaitable[Running]]
"""Launches a process of this machine; it calls the function with all that the process tells."""


class Agent:
    """Takes parts of any number of trees, each over a wire and for as long as its lease lasts. `say` gets a line about all that matters.

    `alarm` is called with the time of the loop by which the first of the leases must have been renewed, or what runs under it must have been
    killed, and with None while there is none.

    Invariant: `_sessions` has the sessions that are not over.
    """

    def __init__(
        self,
        launch: Launcher,
        say: Callable[[str], None] = lambda line: None,
        alarm: Callable[[float | None], None] = lambda at: None,
    ) -> None:
        self.launch = launch
        self.say = say
        self._alarm = alarm
        self._sessions: list[Session] = []

    def session(self, wire: Wire, owner: str) -> Session:
        """A tree of `owner` has opened a wire to this agent."""
        session = Session(self, wire, owner)
        self._sessions.append(session)
        return session

    def renewed(self) -> None:
        """A lease was granted, or a session is over."""
        self._alarm(min((session.until for session in self._sessions if session.until), default=None))

    def over(self, session: Session) -> None:
        """Nothing of this session runs any more."""
        self._sessions.remove(session)
        self.renewed()

    async def stop(self) -> None:
        """Stop everything in order, but no longer than the leases last. Returns when nothing runs any more."""
        for session in tuple(self._sessions):
            session.leave()
        while self._sessions:
            await asyncio.wait([session.ended for session in self._sessions])

    def kill(self) -> None:
        """Kill everything at once."""
        for session in tuple(self._sessions):
            session.step_down("the agent is killed")


class Session:
    """One tree that this agent works for.

    Invariants:

    - Nothing is launched before the first lease was granted, nor once the session ends (`_ending`), nor after `until`.
    - At `until` all processes are killed, unless the lease was renewed before. `_expiry` is the timer for that, from the first lease on.
    - A log line is either sent or counted in `_lost_lines`, and the count is sent with the next event that finds room.
    - `ended` is done when the session ends and none of its processes runs.
    """

    def __init__(self, agent: Agent, wire: Wire, owner: str) -> None:
        self._agent = agent
        self._wire = wire
        self._owner = owner
        self._loop = asyncio.get_running_loop()
        self._lease: Holding | None = None
        self._processes: dict[int, Running] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        """One for each process that runs, or is being launched."""
        self._asking: asyncio.TimerHandle | None = None
        self._expiry: asyncio.TimerHandle | None = None
        self._lost_lines = 0
        self._ending = False
        self._killed = False
        self.ended: asyncio.Future[None] = self._loop.create_future()
        agent.say(f"a tree of {owner} is connected")

    @property
    def until(self) -> float:
        """When the session is over unless its lease is renewed; 0 without a lease."""
        return 0.0 if self._lease is None else self._lease.until

    def take(self, message: ToAgent) -> None:
        """What the tree has sent."""
        if self._killed:
            return
        if isinstance(message, Hello):
            self._lease = lease = Holding(message.lease)
            self._ask(lease)
        elif isinstance(message, LeaseGrant):
            self._granted(message.number)
        elif isinstance(message, Launch):
            self._launch(message)
        elif (process := self._processes.get(message.number)) is not None:
            _pass_on(process, message)

    def lost(self) -> None:
        """The connection has ended, and with it the tree, or the way to it: stop everything in order, but no longer than the lease lasts."""
        if not self._ending:
            self._agent.say(f"the tree of {self._owner} is not connected any more")
            self._stop("the tree that it is a part of is gone")

    def leave(self) -> None:
        """The agent ends: stop everything in order, but no longer than the lease lasts, and tell so."""
        if not self._ending:
            self._wire.send(Leaving())
            self._stop("the agent of its machine ends")

    def step_down(self, why: str) -> None:
        """Kill everything at once."""
        self._killed = self._ending = True
        if self._tasks:
            self._agent.say(f"{why}: {len(self._tasks)} processes of {self._owner} are killed")
        for process in self._processes.values():
            process.kill()
        self._end_if_idle()

    # -- the lease ----------------------------------------------------------------------------------------------------------

    def _ask(self, lease: Holding) -> None:
        if self._asking is not None:
            self._asking.cancel()
        now = self._loop.time()
        self._wire.send(LeaseRequest(lease.ask(now), now, lease.left(now)))
        self._asking = self._loop.call_later(ASKING * lease.seconds, self._ask, lease)

    def _granted(self, number: int) -> None:
        lease = self._lease
        assert lease is not None
        lease.granted(number)
        if self._expiry is not None:
            self._expiry.cancel()
        else:  # the first one: tell the tree at once that it has arrived
            self._ask(lease)
        self._expiry = self._loop.call_at(lease.until, self.step_down, "the lease is over")
        self._agent.renewed()

    # -- processes ----------------------------------------------------------------------------------------------------------

    def _launch(self, message: Launch) -> None:
        if self._ending or self._lease is None or not self._lease.left(self._loop.time()):
            self._wire.send(ProcessEnded(message.number, ProcessDied(0, "its agent takes no more processes")))
            return
        task = self._loop.create_task(self._run(message), name=f"process {message.number} of {self._owner}")
        self._tasks.add(task)
        task.add_done_callback(self._done)

    async def _run(self, message: Launch) -> None:
        """Launch a process, and tell what becomes of it."""
        number = message.number
        try:
            process = await self._agent.launch(message, partial(self._tell, message))
        except OSError as error:
            self._wire.send(ProcessEnded(number, error))
            return
        self._processes[number] = process
        self._wire.send(Launched(number, process.id))
        self._agent.say(f"process {process.id} runs {'/'.join(message.path)} for {self._owner}")
        if self._killed:
            process.kill()
        elif self._ending:
            process.send(StopAsked("the session ends"))
        how = await process.ended
        del self._processes[number]
        self._wire.send(ProcessEnded(number, how))

    def _tell(self, message: Launch, event: Event | Opaque) -> None:
        """Send what a process tells. Lines that come faster than the wire takes them are counted instead: the lease goes by the same wire."""
        full = self._wire.unsent > MOST_UNSENT
        if full and isinstance(event, Opaque) and event.line:
            self._lost_lines += 1
            return
        if self._lost_lines and not full:
            lost, self._lost_lines = self._lost_lines, 0
            fields: dict[str, object] = {"lines": lost, "because": "they came faster than they could be sent"}
            line = Line(self._loop.time(), WARN, "/".join(message.path), 1, "log lines were lost", fields)
            self._wire.send(ProcessEvent(message.number, pack(line)))
        self._wire.send(ProcessEvent(message.number, event.data if isinstance(event, Opaque) else pack(event)))

    def _done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        self._end_if_idle()

    def _stop(self, why: str) -> None:
        self._ending = True
        for process in self._processes.values():
            process.unwatch()
            process.send(StopAsked(why))
        self._end_if_idle()

    def _end_if_idle(self) -> None:
        if not self._ending or self._tasks or self.ended.done():
            return
        for timer in (self._asking, self._expiry):
            if timer is not None:
                timer.cancel()
        self._wire.close()
        self.ended.set_result(None)
        self._agent.over(self)


def _pass_on(process: Running, message: ProcessRequest | Signaled | Watched) -> None:
    if isinstance(message, ProcessRequest):
        process.send(Opaque(message.request))
    elif isinstance(message, Watched):
        (process.watch if message.on else process.unwatch)()
    elif message.kill:
        process.kill()
    else:
        process.terminate()
