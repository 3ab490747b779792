"""What a running supervisor does on request: the handlers behind the public methods, each of them one event."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from typing import Concatenate, ParamSpec, TypeAlias, TypeVar

from actors.errors import DeclarationError, WrongThread
from actors.supervision.child_task import ChildTask
from actors.supervision.core import Core
from actors.supervision.declarations import Child, DynamicSupervisor, Spec, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import (
    AlreadyPresent,
    AlreadyStarted,
    NotFound,
    Restarting,
    Running,
    SupervisorDown,
    TooManyChildren,
)
from actors.supervision.refs import ChildRef

__all__ = ["Path", "Requests"]

T = TypeVar("T")
P = ParamSpec("P")
Path: TypeAlias = str | Sequence[str]
"""The way down from a supervisor: "gaits/walk", or ("gaits", "walk")."""


class Requests(Core):
    """The handlers. A handler that cannot do what is asked raises, before it has changed anything."""

    async def _request(
        self, handler: Callable[Concatenate[asyncio.Future[T], P], None], *args: P.args, **kw: P.kwargs
    ) -> T:
        """Handle a request as an event, in its turn; the handler, or a later event, completes the future."""
        if self._phase not in ("starting", "running"):
            raise SupervisorDown(f"supervisor {self.name} is not running (it is {self._phase}); it can do nothing now")
        if asyncio.get_running_loop() is not self.loop:
            raise WrongThread(
                f"supervisor {self.name} was asked from a foreign event loop: ask it by asyncio.run_coroutine_threadsafe(..., loop)"
            )
        answer: asyncio.Future[T] = self.loop.create_future()

        def handle() -> None:
            try:
                handler(answer, *args, **kw)
            except Exception as error:
                answer.set_exception(error)

        self.post(handle)
        return await answer

    def _on_start_child(self, answer: asyncio.Future[ChildRef | None], spec: Spec) -> None:
        if isinstance(self.spec, DynamicSupervisor):
            raise DeclarationError(f"{self.name} makes its children from a template: use spawn(), not start_child()")
        self.spec.check_child(spec)
        self._start_new(answer, spec)

    def _on_spawn(
        self,
        answer: asyncio.Future[ChildRef | None],
        args: tuple[object, ...],
        name: str | None,
        parameters: Mapping[str, object] | None,
    ) -> None:
        dynamic = self.spec
        if isinstance(dynamic, Supervisor):
            raise DeclarationError(f"{self.name} has no template to spawn from: use start_child(), not spawn()")
        if dynamic.max_children is not None and len(self._entries) >= dynamic.max_children:
            raise TooManyChildren(f"{self.name} has {len(self._entries)} children, and max_children is that many")
        entry = self._start_new(answer, dynamic.instance(name or self._next_name(dynamic), args, parameters))
        entry.given = (args, parameters)

    def _next_name(self, dynamic: DynamicSupervisor) -> str:
        while (name := f"{dynamic.template.name}_{next(self._names)}") in self._entries:
            continue
        return name

    def _start_new(self, answer: asyncio.Future[ChildRef | None], spec: Spec) -> Entry:
        if (known := self._entries.get(spec.name)) is not None:
            if known.now is not None and known.state == "running":
                raise AlreadyStarted(self.name, known.now.ref)
            raise AlreadyPresent(f"{self.name} has a child {spec.name} already; it is {known.state}")
        entry = self._add(spec)
        entry.fresh, entry.intent, entry.answer = True, "start", answer
        self._start_in_turn(entry)
        return entry

    def _on_terminate(self, answer: asyncio.Future[None], target: str | ChildRef) -> None:
        entry = self._entry_of(target)
        if entry is None:
            answer.set_result(None)
            return
        self._drop_plans(entry, "it was terminated before it had started")
        entry.parked = True
        if entry.now is None:
            self._forget(entry)
            self._tell_gone(entry)
            answer.set_result(None)
        else:
            entry.now.watch(lambda _: None if answer.done() else answer.set_result(None))
            self._ask(entry.now, "shutdown")
        if self._lane.holder is entry:
            self._lane.release()
            self._advance()

    def _on_restart_child(self, answer: asyncio.Future[ChildRef | None], id: str) -> None:
        entry = self._stopped(id)
        entry.parked, entry.intent, entry.answer = False, "start", answer
        self._start_in_turn(entry)

    def _on_delete(self, answer: asyncio.Future[None], id: str) -> None:
        del self._entries[self._stopped(id).spec.name]
        answer.set_result(None)

    def _on_replace(self, answer: asyncio.Future[ChildRef | None], id: str, factory: Callable[..., object]) -> None:
        entry = self._entry(id)
        if not isinstance(entry.spec, Child):
            raise DeclarationError(f"{self.name}: {id} is a supervisor and has no factory; reconfigure() changes it")
        entry.spec = entry.spec.replace(factory=factory)
        now = entry.now
        if now is None or entry.state != "running":
            answer.set_result(None)
        else:
            entry.intent, entry.answer = "start", answer
        if now is not None and entry.intent:
            entry.marked = False
            self._ask(now, "replaced")

    def _on_reconfigure(self, answer: asyncio.Future[None], spec: Supervisor | DynamicSupervisor) -> None:
        old = self.spec
        if type(spec) is not type(old) or spec.name != old.name:
            raise DeclarationError(
                f"{self.name} is a {type(old).__name__} named {old.name!r}, and cannot become {spec!r}"
            )
        self.spec = spec
        if isinstance(spec, Supervisor):
            self._reorder(spec)
        else:
            for name, entry in self._entries.items():
                entry.spec = spec.instance(name, *entry.given)
        answer.set_result(None)

    def _reorder(self, spec: Supervisor) -> None:
        """Take over order and specs. A child that is not declared any more stays behind the one it has been behind."""
        known, declared = self._entries, {child.name: child for child in spec.children}
        followers: dict[str, list[str]] = {"": []}
        place = ""
        for name in known:
            if name in declared:
                place = name
            else:
                followers.setdefault(place, []).append(name)
        names = [*followers[""], *(each for name in declared for each in (name, *followers.get(name, ())))]
        self._entries, self._positions = {}, count(1)
        for name in names:
            child = declared.get(name) or known[name].spec
            entry = known.get(name) or Entry(child, 0)
            entry.spec, entry.position, entry.parked = child, next(self._positions), entry.parked or name not in known
            self._entries[name] = entry
        if self._lane.busy:
            self._lane.plan(self._entries.values())

    # ------------------------------------------------------------------ finding

    def _entry(self, id: str) -> Entry:
        """The direct child with this id. Raises `NotFound`."""
        if (entry := self._entries.get(id)) is not None:
            return entry
        if isinstance(self.spec, DynamicSupervisor) and id == self.spec.template.name:
            raise NotFound(f"{self.name}: {id!r} names the template; give the reference, or the id, of one instance")
        raise NotFound(f"{self.name} has no child {id!r}; it has: {', '.join(self._entries) or 'none'}")

    def _entry_of(self, target: str | ChildRef) -> Entry | None:
        """The direct child meant by an id or a live reference; None for a reference to an ended incarnation."""
        if isinstance(target, str):
            return self._entry(target)
        if target.path[:-1] != self.path:
            raise NotFound(f"{target} is no child of {self.name}; ask its own supervisor")
        entry = self._entries.get(target.id)
        alive = entry is not None and entry.now is not None and entry.now.ref == target
        return entry if alive else None

    def _stopped(self, id: str) -> Entry:
        """The direct child with this id, if it is stopped."""
        entry = self._entry(id)
        if entry.intent:
            raise Restarting(f"{self.name}: {id} is {entry.state}; wait, or terminate_child({id!r}) first")
        if entry.now is not None:
            raise Running(self.name, entry.now.ref)
        return entry

    def _walk(self, path: Path) -> ChildTask | None:
        """The present incarnation of a descendant; None if it, or a supervisor on the way to it, has none."""
        first, *rest = path.split("/") if isinstance(path, str) else path
        incarnation = self._entry(first).now
        if not rest or incarnation is None:
            return incarnation
        if not isinstance(incarnation.life, Requests):
            raise NotFound(f"{self.name}: {first} is not a running supervisor, so it has no {'/'.join(rest)}")
        return incarnation.life._walk(rest)

    def _incarnation(self, ref: ChildRef) -> ChildTask | None:
        """The incarnation that `ref` means; None if it has ended."""
        depth = len(self.path)
        if ref.path[:depth] != self.path or len(ref.path) == depth:
            raise NotFound(f"{ref} is not below {self.name}")
        try:
            incarnation = self._walk(ref.path[depth:])
        except NotFound:
            return None
        return incarnation if incarnation is not None and incarnation.ref == ref else None
