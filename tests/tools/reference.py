"""`python -m tests.tools.reference`: write build/reference.md, every public name with its signature and its docstring.

The site's reference is the same text, `tests/site`; it is not kept in the repository.
"""

from __future__ import annotations

import ast
import enum
import importlib
import inspect
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, is_typeddict

import actors
from actors import Action, ActorError, Service, Topic
from tests.project.surface import NO_CONSTRUCTOR, Surface
from tests.site.markdown import headlines
from tests.tools import no_arguments, numbers_table, parameter_table

PAGE = Path(__file__).parents[2] / "build" / "reference.md"

GROUPS: Mapping[str, Sequence[str]] = {
    "Running": ("spin", "run", "execute", "open_node", "System", "system_of", "graph_of"),
    "Contracts": ("Topic", "Service", "Action"),
    "Nodes": (
        "Node", "publishes", "subscribes", "parameter", "every", "Tick", "background", "LifecycleNode",
    ),
    "Parameters": ("Parameter", "SetResult"),
    "Topics": ("ContentFilter", "QoS", "qos"),
    "Actions": ("Steps", "Done", "Aborted", "GoalStatus", "retry"),
    "Supervision": (
        "Supervisor", "DynamicSupervisor", "Child", "Intensity", "Backoff", "one_for_one", "one_for_all", "rest_for_one", "permanent",
        "transient", "temporary", "Stop", "Skip", "ExitReason",
    ),
    "Checks": ("check_tree", "check_node"),
    "Errors": (
        "ActorError", "DeclarationError", "ServiceUnavailable", "CallTimeout",
        "ServiceFailed", "ActionUnavailable", "Reject", "GoalRejected", "GoalFailed", "GoalCanceled",
        "GoalAborted", "StartFailed", "SupervisorGaveUp",
    ),
}  # fmt: skip
"""Which names of `actors` belong together; those in no group come last."""

SECTIONS: Mapping[str, str] = {
    "Errors that say more": "actors.errors",
    "Lifecycle": "actors.lifecycle",
    "Goals that arrive while one runs": "actors.actions",
    "Arguments of programs": "actors.running",
    "Reasons of an end": "actors.supervision",
    "Types for annotations": "actors.typing",
    "Instants and durations": "actors.time",
    "Quality of service": "actors.qos",
    "Parameters in full": "actors.parameters",
    "Parameters of other nodes": "actors.parameters.client",
    "Parameter files": "actors.parameters.files",
    "Parameters as messages": "actors.parameters.messages",
    "Launch files": "actors.launch",
    "Tests of launches": "actors.launch.testing",
    "Logs": "actors.logs",
    "Diagnostics": "actors.diagnostics",
    "Spans": "actors.diagnostics.spans",
    "Images and point clouds": "actors.images",
    "Testing": "actors.testing",
    "Faults": "actors.testing.faults",
    "Blocking programs": "actors.blocking",
    "Recording": "actors.bag",
    "Replay": "actors.replay",
    "Nodes that come with it": "actors.nodes",
    "Transforms": "actors.tf2",
    "Message filters": "actors.message_filters",
    "Other processes": "actors.transport",
    "Other processes, by Zenoh": "actors.transport.zenoh",
    "Other processes, by DDS": "actors.transport.dds",
    "Other machines": "actors.hosts",
    "Security": "actors.transport.security",
    "A small authority": "actors.transport.security.authority",
    "Interfaces": "actors.interfaces",
    "Field types": "actors.interfaces.types",
}
"""The other public modules: all names of each in a section of its own, in the order of its ``__all__``."""

INTERNAL: Mapping[str, Sequence[str]] = {
    "System": (
        "join", "leave", "master", "open", "start",
    ),
    "Clock": ("loop_time", "call_at"),
    "Recording": ("entries", "start"),
    "Rig": ("leaks",),
    "Node": ("__machinery__", "declarations", "managed"),
    "NodeRecord": (
        "actions", "asked_state", "close", "forget", "inbox", "life", "note", "note_restart", "park", "running", "saved", "services",
        "subscriptions", "sweep", "task", "timers", "used", "work_on",
    ),
    "Publisher": (
        "add_tap", "alive", "attach", "attached", "count_incompatible_qos", "count_incompatible_type", "detach", "due", "due_alive",
        "end_events", "gated", "here", "history", "join", "keep_events", "kept_events", "latched", "leave", "matched", "notify", "part", "peers",
        "replay", "resume", "suspend", "taps", "targets", "node", "entry", "owner",
    ),
    "Probe": (
        "catch_up", "count_incompatible_qos", "count_incompatible_type", "count_lost", "deliver", "due", "end_events", "entry", "full",
        "here", "join", "keep_events", "kept_events", "leave", "matched", "node", "notify", "part", "publishers", "room", "senders", "target",
        "unwrap", "waiting", "wrapped",
    ),
    "HandlerSubscription": (
        "catch_up", "count_incompatible_qos", "count_incompatible_type", "count_lost", "deliver", "deliver_all", "due", "end_events", "entry", "expiring",
        "full", "here", "join", "keep_events", "kept_events", "leave", "matched", "node", "notify", "part", "publishers", "room", "senders", "target",
        "timed", "unwrap", "waiting", "wrapped",
        "handler", "inbox", "label", "must_unwrap", "run", "stamp", "take_over",
    ),
    "RunningSupervisor": (
        "ask", "below", "incarnation", "leaked", "life", "lives", "name", "phase", "recent_restarts", "run", "statuses", "stop",
    ),
    "Supervisor": ("check_child",),
    "Timer": ("on_tick",),
    "DynamicSupervisor": ("instance",),
    "Identity": ("remapping",),
    "CallbackHandle": ("callback", "kind"),
    "ExpectedFailure": ("demand", "takes"),
}  # fmt: skip
"""What is public for other modules of the framework only."""

ROBOT: Mapping[str, str] = {
    "The robot": "robot",
    "Topics, services and actions of the robot": "robot.contracts",
    "Trials of the robot": "robot.testing",
}
"""The public modules of `robot`, after those of `actors`."""

HEAD = """# All names

Every public name with its signature and its docstring. The sections that name no module are about `actors` itself.
"""


def page() -> str:
    """The text of the page."""
    found = list(entries())
    body: list[str] = []
    subject = ""
    for one, name, value, face in found:
        if one != subject:
            subject = one
            body.append(f"\n## {subject}")
            if face != "actors":
                body.append(f"\nNames of `{face}`. {prose(first_paragraph(face))}")
        body += described(name, value, face)
    text = "\n".join(body).rstrip() + "\n"
    found_headlines = list(headlines(text))
    anchors = [anchor for level, _, anchor in found_headlines if level == 3]
    text += "\n## Parameters of the robot\n\n" + "\n".join(parameter_table.table()) + "\n"
    text += "\n## Numbers of the controllers\n\n" + "\n".join(numbers_table.tables())
    contents: list[str] = []
    for level, subject, anchor in found_headlines:
        if level == 2:
            names = [
                f"[{name}](#{own})" for (one, name, _, _), own in zip(found, anchors, strict=True) if one == subject
            ]
            contents.append(f"- [{subject}](#{anchor}): " + ", ".join(names))
    return "\n".join([HEAD, *contents, text])


def first_paragraph(face: str) -> str:
    """The first paragraph of a module's docstring."""
    return inspect.cleandoc(sys.modules[face].__doc__ or "").partition("\n\n")[0]


def entries() -> Iterator[tuple[str, str, Any, str]]:
    """Subject, name, value and module of every entry, in the order of the page."""
    for subject, names in GROUPS.items():
        for name in names:
            yield subject, name, getattr(actors, name), "actors"
    for subject, face in SECTIONS.items():
        module = importlib.import_module(face)
        for name in module.__all__:
            yield subject, name, getattr(module, name), face
    for subject, face in ROBOT.items():
        module = importlib.import_module(face)
        for name in getattr(module, "__all__", None) or contracts(module):
            yield subject, name, getattr(module, name), face
    grouped = {name for names in GROUPS.values() for name in names}
    for name in actors.__all__:
        if name not in grouped:
            yield "More", name, getattr(actors, name), "actors"


def contracts(module: ModuleType) -> list[str]:
    """The topics, services and actions that a module defines, in the order of its source."""
    return [name for name, value in vars(module).items() if isinstance(value, (Topic, Service, Action))]


@cache
def classes() -> frozenset[type[Any]]:
    """All classes that have an entry."""
    return frozenset(value for _, _, value, _ in entries() if isinstance(value, type))


def is_protocol(kind: type[Any]) -> bool:
    return bool(getattr(kind, "_is_protocol", False))


def heading(name: str, value: Any) -> str:
    """The headline of an entry: its name; a module is called one, since an anchor knows no capitals."""
    return f"{name} (module)" if isinstance(value, ModuleType) else name


def described(name: str, value: Any, face: str) -> list[str]:
    """One entry: heading, signature, text, and the members of a class or module."""
    lines = [f"\n### {heading(name, value)}\n"]
    if isinstance(value, ModuleType):
        return [*lines, prose(value.__doc__), "", *constants(value)]
    if isinstance(value, type):
        return [*lines, *class_lines(name, value)]
    if callable(value) and inspect.isfunction(value):
        return [*lines, code(f"{name}{signature(value)}"), "", prose(inspect.getdoc(value))]
    definition, text = documented_constant(face, name)
    return [*lines, code(definition), "", prose(text)]


def class_lines(name: str, kind: type[Any]) -> list[str]:
    """A class: how it is made, its text, its members."""
    shown_too = classes()
    bases = [
        base.__name__
        for base in kind.__bases__
        if base in shown_too or (issubclass(kind, ActorError) and base is not Exception)
    ]
    head = f"class {name}({', '.join(bases)})" if bases else f"class {name}"
    made = constructor(name, kind)
    lines = [code("\n".join(filter(None, (head, made)))), "", prose(inspect.getdoc(kind))]
    if issubclass(kind, enum.Enum):
        return [*lines, "", ", ".join(f"`{one.name}` = {one.value!r}" for one in kind)]
    hidden = INTERNAL.get(name, ())
    attributes = documented_attributes(kind)
    for member, text in attributes.items():
        if member not in hidden:
            lines += [f"\n#### {name}.{member}\n", prose(text)]
    for member, value in members(kind):
        if member not in attributes and member not in hidden:
            lines += member_lines(f"{name}.{member}", value)
    return lines


def constructor(name: str, kind: type[Any]) -> str:
    """The call that makes an instance; empty where there is nothing to say."""
    text = " ".join((inspect.getdoc(kind) or "").split())
    if NO_CONSTRUCTOR in text or issubclass(kind, enum.Enum) or is_protocol(kind) or is_typeddict(kind):
        return ""
    try:
        text = signature(kind)
    except ValueError:  # an exception without a constructor of its own
        return ""
    return "" if text == "()" else f"{name}{text}"


def members(kind: type[Any]) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that a class has itself or from bases that have no entry of their own, in the order of the source."""
    shown_elsewhere = classes() - {kind}
    seen: set[str] = set()
    for owner in kind.__mro__:
        if owner in shown_elsewhere or not owner.__module__.startswith(("actors.", "robot.")):
            continue
        for member, value in vars(owner).items():
            plain = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
            if (
                member.startswith("_")
                or member in seen
                or not (inspect.isfunction(plain) or isinstance(value, property))
            ):
                continue
            seen.add(member)
            if inspect.getdoc(value if isinstance(value, property) else plain):
                yield member, value


def member_lines(name: str, value: Any) -> list[str]:
    """A method or a property."""
    if isinstance(value, property):
        assert value.fget is not None
        returned = inspect.signature(value.fget).return_annotation
        text = f"{name.rpartition('.')[2]}: {annotation(returned)}"
        return [f"\n#### {name}\n", code(text), "", prose(inspect.getdoc(value))]
    plain = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
    mark = {classmethod: "@classmethod\n", staticmethod: "@staticmethod\n"}.get(type(value), "")
    verb = "async " if inspect.iscoroutinefunction(plain) else ""
    bound = not isinstance(value, staticmethod)
    return [
        f"\n#### {name}\n",
        code(f"{mark}{verb}{name.rpartition('.')[2]}{signature(plain, bound=bound)}"),
        "",
        prose(inspect.getdoc(plain)),
    ]


# -- signatures -----------------------------------------------------------------------------------------------------------------


def signature(function: Any, *, bound: bool = False) -> str:
    """A signature as its source has it, on several lines when it is long."""
    found = inspect.signature(function)
    parameters = list(found.parameters.values())[1 if bound else 0 :]
    parts: list[str] = []
    for number, one in enumerate(parameters):
        if one.kind is one.KEYWORD_ONLY and not any(
            p.kind in (p.VAR_POSITIONAL, p.KEYWORD_ONLY) for p in parameters[:number]
        ):
            parts.append("*")
        parts.append(parameter_text(one))
        following = parameters[number + 1] if number + 1 < len(parameters) else None
        if one.kind is one.POSITIONAL_ONLY and (following is None or following.kind is not one.POSITIONAL_ONLY):
            parts.append("/")
    returned = found.return_annotation
    end = "" if returned is found.empty or isinstance(function, type) else f" -> {annotation(returned)}"
    short = f"({', '.join(parts)}){end}"
    return short if len(short) <= 100 else "(\n    " + ",\n    ".join(parts) + f",\n){end}"


def parameter_text(one: inspect.Parameter) -> str:
    stars = {one.VAR_POSITIONAL: "*", one.VAR_KEYWORD: "**"}.get(one.kind, "")
    text = f"{stars}{one.name}"
    if one.annotation is not one.empty:
        text += f": {annotation(one.annotation)}"
    if one.default is not one.empty:
        text += f" = {shown(one.default)}" if ":" in text else f"={shown(one.default)}"
    return text


def annotation(value: Any) -> str:
    """A type as one writes it."""
    if isinstance(value, str):
        return value
    text = value.__name__ if isinstance(value, type) and not getattr(value, "__args__", ()) else str(value)
    return re.sub(r"\b(?:actors|robot|typing|collections\.abc)(?:\.\w+)*\.(?=\w)", "", text)


def shown(value: Any) -> str:
    """A default as one writes it."""
    if isinstance(value, tuple):
        items: tuple[Any, ...] = value
        return f"({', '.join(map(shown, items))}{',' if len(items) == 1 else ''})"
    if type(value) is object:
        return "..."
    if isinstance(value, enum.Enum):
        return f"{type(value).__name__}.{value.name}"
    if inspect.isroutine(value) or isinstance(value, type):
        return value.__name__
    return text if len(text := repr(value)) <= 100 else f"{type(value).__name__}(...)"


# -- texts ----------------------------------------------------------------------------------------------------------------------


def prose(text: str | None) -> str:
    """A docstring as Markdown: a block after `::` is code already."""
    cleaned = inspect.cleandoc(text or "")
    lines = [re.sub(r"::$", ":", line) for line in cleaned.splitlines()]
    return "\n".join(lines)


def code(text: str) -> str:
    """A block of code; not marked as those of the other pages are, which the test suite runs."""
    return f"```py\n{text}\n```"


def target_of(statement: ast.stmt) -> ast.expr | None:
    """What an assignment gives a value to."""
    if isinstance(statement, ast.AnnAssign):
        return statement.target
    return statement.targets[0] if isinstance(statement, ast.Assign) else None


def strings_after(body: Sequence[ast.stmt]) -> Iterator[tuple[str, str, str]]:
    """(owner, name, text) for every assignment that a string follows; the owner is `self` or empty."""
    for statement, following in pairwise(body):
        if not (isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)):
            continue
        target = target_of(statement)
        text = str(following.value.value)
        for one in target.elts if isinstance(target, ast.Tuple) else [target]:
            if isinstance(one, ast.Name):
                yield "", one.id, text
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
            yield target.value.id, target.attr, text


def documented_attributes(kind: type[Any]) -> dict[str, str]:
    """The public attributes of a class that a string in its body or its `__init__` explains."""
    tree = ast.parse(inspect.cleandoc("\n" + inspect.getsource(kind)))
    (definition,) = (one for one in tree.body if isinstance(one, ast.ClassDef))
    bodies = [definition.body]
    bodies += [one.body for one in definition.body if isinstance(one, ast.FunctionDef) and one.name == "__init__"]
    found = {name: text for body in bodies for _, name, text in strings_after(body)}
    return {name: text for name, text in found.items() if not name.startswith("_")}


@cache
def surface_of(package: str) -> Surface:
    """The names of a package, from its sources."""
    return Surface(Path(importlib.import_module(package).__path__[0]))


def documented_constant(face: str, name: str) -> tuple[str, str]:
    """The definition of a constant or a type, wherever it stands, and the string after it."""
    surface = surface_of(face.partition(".")[0])
    found = surface.resolve(face, name)
    if found is None:  # of another package, where its own entry is
        return f"{name} = {shown(getattr(sys.modules[face], name))}", ""
    module = surface.modules[found.module]
    statement = module.defined[found.name]
    texts = {name: text for _, name, text in strings_after(module.tree.body)}
    assert isinstance(statement, (ast.Assign, ast.AnnAssign)), name
    several = isinstance(target_of(statement), ast.Tuple) or statement.value is None
    shown_value = (
        repr(getattr(sys.modules[face], name)) if several or statement.value is None else ast.unparse(statement.value)
    )
    return f"{name} = {shown_value}", texts.get(found.name, "")


def constants(module: ModuleType) -> list[str]:
    """The constants of a module, one line each."""
    inside = [one for full, one in sorted(sys.modules.items()) if f"{full}.".startswith(f"{module.__name__}.")]
    trees = [ast.parse(inspect.getsource(one)).body for one in inside]
    texts = {name: text for tree in trees for _, name, text in strings_after(tree)}
    lines: list[str] = []
    for name in module.__all__:
        value = getattr(module, name)
        if not isinstance(value, type) and not callable(value) and not str(value).startswith("typing."):
            text = " ".join(prose(texts.get(name, "")).split())
            lines.append(f"- `{name}`: `{shown(value)}`" + (f". {text}" if text else ""))
    return lines


def main() -> int:
    """Write the page."""
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE.name}, {sum(1 for _ in entries())} entries")
    return 0


if __name__ == "__main__":
    no_arguments(__doc__)
    sys.exit(main())
