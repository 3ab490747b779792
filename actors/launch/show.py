"""The tree of a launch as text: what `launch --show-tree` prints."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator

from actors.launch.entity import evaluate, one_or_more
from actors.launch.looking import looking
from actors.launch.packages import NodeTarget
from actors.launch.parameters import Layer
from actors.launch.plan import (
    Component,
    Deferred,
    Handler,
    Item,
    Job,
    Load,
    Message,
    Missing,
    Scope,
    Signal,
    Timer,
    Transitions,
    Unregister,
)
from actors.launch.shim import shim
from actors.names.names import fully_qualified

Branch = tuple[str, list["Branch"]]
"""A line, and those below it."""

LONGEST = 60
"""Characters of a value that are shown."""


def tree_text(scope: Scope) -> str:
    """The tree below a scope, one line for each supervisor, executable, timer and handler."""
    return "\n".join(_lines(_scope(scope)))


def _lines(branch: Branch) -> Iterator[str]:
    line, below = branch
    yield line
    for number, inner in enumerate(below):
        last = number == len(below) - 1
        for index, text in enumerate(_lines(inner)):
            lead = ("└─ " if last else "├─ ") if index == 0 else ("   " if last else "│  ")
            yield lead + text


def _scope(scope: Scope) -> Branch:
    title = (
        f"{scope.name} (supervisor, one_for_one)"
        if scope.title == "group"
        else f"{scope.title} (supervisor, one_for_one)"
    )
    return title, [_item(item) for item in scope.items]


def _item(item: Item) -> Branch:
    if isinstance(item, Scope):
        return _scope(item)
    if isinstance(item, Job):
        return _job(item)
    if isinstance(item, Load):
        return f"load into {item.container}", [_component(one) for one in item.components]
    if isinstance(item, Timer):
        return f"after {item.period:g} s", _later(item.then)
    if isinstance(item, Handler):
        return f"{item.handler.describe()}", _answers(item)
    if isinstance(item, Message):
        return f"log {item.level}: {item.text}", []
    if isinstance(item, Signal):
        return f"emit {_event(item.event)}", []
    if isinstance(item, Unregister):
        return f"no longer {item.handler.describe()}", []
    if isinstance(item, Transitions):
        return f"transitions {', '.join(map(str, item.ids))} of {', '.join(item.nodes)}", []
    return _missing(item)


def _missing(item: Missing) -> Branch:
    return f"{item.what}: {item.why}", []


def _job(job: Job) -> Branch:
    policy = _policy(job)
    node = job.node
    if node is None:
        assert job.process is not None
        return f"{job.label}: {_shown(shlex.join(job.process.cmd))}{policy}", _exit(job)
    name = "" if node.name is None else f" as {fully_qualified(node.namespace or '/', node.name)}"
    place = f" in {node.namespace}" if node.name is None and node.namespace not in ("", "/") else ""
    kind = _kind(job)
    arguments: list[Branch] = [(f"arguments {shlex.join(node.arguments)}", [])] if node.arguments else []
    below = [
        *_parameters(node.layers),
        *_remaps(node.remaps),
        *arguments,
        *_exit(job),
    ]
    return (
        f"{job.label}: {f'{node.package}/' if node.package else ''}{node.executable}{name}{place}{kind}{policy}",
        below,
    )


def _kind(job: Job) -> str:
    node = job.node
    assert node is not None
    if isinstance(node.found, NodeTarget):
        return f" ({node.found.target})"
    if node.found is not None:
        return f" (process {node.found.path})"
    return " (container)" if node.container else " (not here)"


def _policy(job: Job) -> str:
    words: list[str] = []
    if job.respawn:
        most = "" if job.respawn_max_retries < 0 else f" at most {job.respawn_max_retries} times"
        delay = f" after {job.respawn_delay:g} s" if job.respawn_delay else ""
        words.append(f"permanent: restarted{delay}{most}")
    if job.required:
        words.append("significant: its end ends the launch")
    return f" [{'; '.join(words)}]" if words else ""


def _exit(job: Job) -> list[Branch]:
    if job.on_exit is None or job.required:
        return []
    if callable(job.on_exit):
        return [(f"when it has ended: {_function(job.on_exit)}", [])]
    return [("when it has ended", _later(Deferred(one_or_more(job.on_exit), job.context)))]


def _component(component: Component) -> Branch:
    name = "" if component.name is None else f" as {fully_qualified(component.namespace or '/', component.name)}"
    return f"{component.package} {component.plugin}{name}", [*_parameters(component.layers), *_remaps(component.remaps)]


def _parameters(layers: Iterable[Layer]) -> list[Branch]:
    found: list[Branch] = []
    for layer in layers:
        if layer.source:
            found.append((f"parameters of {layer.source}{'' if layer.text is not None else ' (not here)'}", []))
        found += [(f"{name}: {_shown(repr(value))}", []) for name, value in layer.values.items()]
    return found


def _remaps(remaps: Iterable[tuple[str, str]]) -> list[Branch]:
    return [(f"{old} -> {new}", []) for old, new in remaps]


def _answers(item: Handler) -> list[Branch]:
    entities = item.handler.entities
    if callable(entities):
        return [(_function(entities), [])]
    return _later(Deferred(one_or_more(entities), item.context))


def _later(deferred: Deferred) -> list[Branch]:
    """What entities come to that are evaluated later, if they were evaluated now."""
    context = deferred.context.fork()
    context.lenient = context.only_shown = True
    scope = Scope("", "")
    with shim(context), looking():
        evaluate(deferred.entities, context, scope)
    return [_item(item) for item in scope.items]


def _function(function: object) -> str:
    return f"what {getattr(function, '__name__', type(function).__name__)}() returns"


def _event(event: object) -> str:
    reason = getattr(event, "reason", "")
    return f"{type(event).__name__}{f' ({reason})' if reason else ''}"


def _shown(text: str) -> str:
    one = " ".join(text.split())
    return one if len(one) <= LONGEST else f"{one[:LONGEST]}..."
