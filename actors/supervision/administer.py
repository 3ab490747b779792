"""The part of `decide` for requests, the methods of `RunningSupervisor` that change children. Pure, like the rest of `decide`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from actors.errors import DeclarationError
from actors.supervision.acts import (
    Act,
    Add,
    Adopt,
    Answer,
    Drop,
    Due,
    EndHold,
    Forget,
    Gone,
    Start,
    Stop,
    Terminate,
    Update,
)
from actors.supervision.child import Child
from actors.supervision.children import Children
from actors.supervision.declarations import DynamicSupervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import (
    AlreadyPresent,
    AlreadyStarted,
    NotFound,
    Restarting,
    Running,
    StartFailed,
    TooManyChildren,
)
from actors.supervision.events import (
    DeleteChild,
    Event,
    Reconfigure,
    ReplaceFactory,
    RestartChild,
    Spawn,
    StartChild,
    TerminateChild,
)
from actors.supervision.policy import temporary
from actors.supervision.refs import ChildRef


def _start_child(request: StartChild, children: Children) -> Sequence[Act]:
    if isinstance(children.spec, DynamicSupervisor):
        raise DeclarationError(f"{children.name} makes its children from a template: use spawn(), not start_child()")
    children.spec.check_child(request.spec)
    return _start_new(Add(request.spec, id=request.id), children)


def _spawn(request: Spawn, children: Children) -> Sequence[Act]:
    dynamic = children.spec
    if not isinstance(dynamic, DynamicSupervisor):
        raise DeclarationError(f"{children.name} has no template to spawn from: use start_child(), not spawn()")
    if dynamic.max_children is not None and len(children) >= dynamic.max_children:
        raise TooManyChildren(f"{children.name} has {len(children)} children, and max_children is that many")
    numbered, name = children.numbered, request.name
    while not name or (not request.name and name in children.entries):
        numbered += 1
        name = f"{dynamic.template.name}_{numbered}"
    spec = dynamic.instance(name, request.args, request.parameters)
    if not (request.args or request.parameters):
        return _start_new(Add(spec, numbered=numbered), children)
    return _start_new(Add(spec, (request.args, request.parameters), numbered), children)


def _start_new(add: Add, children: Children) -> Sequence[Act]:
    name = add.id or add.spec.name
    if (known := children.entries.get(name)) is not None:
        if known.now is not None and known.state == "running":
            raise AlreadyStarted(children.name, known.now.ref)
        raise AlreadyPresent(f"{children.name} has a child {name} already; it is {known.state}")
    return (add,)


def _terminate(request: TerminateChild, children: Children) -> Sequence[Act]:
    child = _meant(request.target, children)
    if child is None:
        return (Answer(),)
    name = child.id
    error = None
    if child.answer is not None:
        error = StartFailed((*children.path, name), "it was terminated before it had started")
    hold = (EndHold(),) if children.steps.holder is child else ()
    if child.now is not None:
        return (Terminate(name, error, request.why), *hold)
    return (Drop(name, error, park=True), *for_good(child, children), Answer(), *hold)


def _restart(request: RestartChild, children: Children) -> Sequence[Act]:
    name = _stopped(request.child, children).id
    return (Due(name), Start(name))


def _delete(request: DeleteChild, children: Children) -> Sequence[Act]:
    return (Forget(_stopped(request.child, children).id), Answer())


def _replace(request: ReplaceFactory, children: Children) -> Sequence[Act]:
    child = children.find(request.child)
    name = child.id
    if not isinstance(child.spec, Child):
        raise DeclarationError(f"{children.name}: {name} is a supervisor and has no factory; reconfigure() changes it")
    update = Update(name, child.spec.replace(factory=request.factory))
    if child.now is None:
        return (update, Answer())
    if child.state == "running":
        return (update, Due(name), Stop(name, "replaced"))
    return (update, Answer(), Stop(name, "replaced")) if child.intent else (update, Answer())


def _reconfigure(request: Reconfigure, children: Children) -> Sequence[Act]:
    old, spec = children.spec, request.spec
    if type(spec) is not type(old) or spec.name != old.name:
        raise DeclarationError(
            f"{children.name} is a {type(old).__name__} named {old.name!r}, and cannot become {spec!r}"
        )
    return (Adopt(spec), Answer())


REQUESTS: Final[Mapping[type[Event], Callable[[Any, Children], Sequence[Act]]]] = {
    StartChild: _start_child,
    Spawn: _spawn,
    TerminateChild: _terminate,
    RestartChild: _restart,
    DeleteChild: _delete,
    ReplaceFactory: _replace,
    Reconfigure: _reconfigure,
}
"""Kind of request -> the function that decides about it."""


# ---------------------------------------------------------------------- children that have ended for good


def for_good(child: Entry, children: Children) -> tuple[Act, ...]:
    """The acts for a child that has ended for good, or was dropped before its start."""
    if children.dynamic:
        return (Forget(child.id), Gone(child.id, kept=False))
    forget = forgotten(child, children)
    return (*forget, gone(child, children, lost=bool(forget)))


def forgotten(child: Entry, children: Children) -> tuple[Forget, ...]:
    """The act that forgets a child which has ended for good, if it is temporary or an instance of a template; else none."""
    return (Forget(child.id),) if child.spec.restart == temporary or children.dynamic else ()


def gone(child: Entry, children: Children, *, lost: bool) -> Gone:
    """Tell the system that the child is gone. It is kept if a request can start it again, or, when `lost`, if it is still declared.

    `lost` says that the child is removed from the state of the supervisor.
    """
    spec, name = children.spec, child.id
    if isinstance(spec, DynamicSupervisor):
        return Gone(name, kept=False)
    kept = not lost or any(each.name == name for each in spec.children)
    return Gone(name, kept)


# ---------------------------------------------------------------------- the child that a request names


def _meant(target: str | ChildRef, children: Children) -> Entry | None:
    """The direct child that an id or a reference names; None for a reference to an ended life. Raises `NotFound`."""
    if isinstance(target, str):
        return children.find(target)
    if target.path[:-1] != children.path:
        raise NotFound(f"{target} is no child of {children.name}; ask its own supervisor")
    child = children.entries.get(target.id)
    alive = child is not None and child.now is not None and child.now.ref == target
    return child if alive else None


def _stopped(name: str, children: Children) -> Entry:
    """The direct child with this id, which must be stopped. Raises `Restarting`, `Running`, `NotFound`."""
    child = children.find(name)
    if child.intent:
        raise Restarting(f"{children.name}: {name} is {child.state}; wait, or terminate_child({name!r}) first")
    if child.now is not None:
        raise Running(children.name, child.now.ref)
    return child
