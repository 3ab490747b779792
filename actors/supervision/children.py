"""The books of a supervisor: who its children are, in which order, and how far each of them is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Literal, TypeAlias

from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import NotFound, SupervisorDown
from actors.supervision.events import Ended
from actors.supervision.steps import Steps
from actors.supervision.window import Window

__all__ = ["Children", "Phase"]

Phase: TypeAlias = Literal["new", "starting", "running", "stopping", "over"]


class Children:
    """What one run of a supervisor knows: `spec`, as it is declared now, and an entry for each child.

    `dynamic`: its children are instances of a template; `numbered` is the last number that was used to name one. `why` is the
    reason of its end. `closing` is the end of a significant child that will end it once all have started.

    Invariants:
    - `entries` is in start order, which `position` repeats; each entry lies under its child's name.
    - A child that lives is in the books.
    - `phase` only moves onwards, from "new" to "over". From "stopping" on nothing is due, planned or held back, and no
      life begins; `last` holds the entries that lived when it began, in start order, less those of its tail that have ended.
    """

    __slots__ = (
        "closing",
        "dynamic",
        "entries",
        "last",
        "numbered",
        "path",
        "phase",
        "position",
        "spec",
        "steps",
        "why",
        "window",
    )

    def __init__(self, spec: Supervisor | DynamicSupervisor, path: tuple[str, ...]) -> None:
        self.spec = spec
        self.dynamic = isinstance(spec, DynamicSupervisor)
        self.path = path
        self.entries: dict[str, Entry] = {}
        self.position = 0
        self.phase: Phase = "new"
        self.why = ""
        self.steps = Steps()
        self.window = Window()
        self.closing: Ended | None = None
        self.last: list[Entry] = []
        self.numbered = 0
        for child in spec.children if isinstance(spec, Supervisor) else ():
            self.add(child)

    def __len__(self) -> int:
        return len(self.entries)

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries.values())

    def __getitem__(self, name: str) -> Entry:
        return self.entries[name]

    @property
    def name(self) -> str:
        """The supervisor's path from the root, as one text."""
        return "/".join(self.path)

    def check_open(self) -> None:
        """Raise `SupervisorDown` unless requests can be served."""
        if self.phase not in ("starting", "running"):
            raise SupervisorDown(f"supervisor {self.name} is not running (it is {self.phase}); it can do nothing now")

    def find(self, name: str) -> Entry:
        """The child with this id. Raises `NotFound`."""
        if (entry := self.entries.get(name)) is not None:
            return entry
        if isinstance(self.spec, DynamicSupervisor) and name == self.spec.template.name:
            raise NotFound(f"{self.name}: {name!r} names the template; give the reference, or the id, of one instance")
        raise NotFound(f"{self.name} has no child {name!r}; it has: {', '.join(self.entries) or 'none'}")

    def add(self, spec: Spec, given: tuple[tuple[object, ...], Mapping[str, object] | None] = ((), None)) -> Entry:
        """Enter a child after the others."""
        self.position += 1
        entry = self.entries[spec.name] = Entry(spec, self.position)
        entry.given = given
        return entry

    def begin(self) -> None:
        """The first start of all children is due."""
        self.phase = "starting"
        for entry in self:
            entry.intent = "start"
        self.steps.plan(self)

    def restart(self, entry: Entry, at: float, earlier: int | None) -> None:
        """Count a restart, which is now due."""
        self.window.add(at, self.spec.intensity)
        entry.intent = "restart"
        if earlier is not None:
            entry.attempts, entry.ready_at = earlier + 1, None

    def plan(self, stops: Iterable[str], due: Iterable[str]) -> None:
        """Mark these for a stop, and let a restart be due for those. Merges with what is under way."""
        for name in stops:
            self.entries[name].marked = True
        for name in due:
            self.entries[name].intent = "restart"
        self.steps.plan(self)

    def close_when_ready(self, end: Ended) -> None:
        """Once all have started, the supervisor is to end because of this; the first reason counts."""
        self.closing = self.closing or end

    def shut_down(self, why: str) -> None:
        """Nothing is planned any more; who lives is to be stopped, the last one first."""
        self.phase, self.why = "stopping", why
        self.last = [entry for entry in self if entry.now is not None]
        self.steps.clear()

    def last_alive(self) -> Entry | None:
        """While it stops: who is to end next. None when all have ended."""
        while self.last and self.last[-1].now is None:
            self.last.pop()
        return self.last[-1] if self.last else None

    def adopt(self, spec: Supervisor | DynamicSupervisor) -> None:
        """Go on with another declaration of the same kind and name: new children are known, but not started."""
        self.spec = spec
        if isinstance(spec, DynamicSupervisor):
            for name, entry in self.entries.items():
                entry.spec = spec.instance(name, *entry.given)
            return
        declared = {child.name: child for child in spec.children}
        known, self.entries, self.position = self.entries, {}, 0
        for name in merged(known, declared):
            if (old := known.get(name)) is None:
                self.add(declared[name]).parked = True
            else:
                self.position += 1
                old.spec, old.position = declared.get(name, old.spec), self.position
                self.entries[name] = old
        if self.steps.busy:
            self.steps.plan(self)


def merged(known: Iterable[str], declared: Iterable[str]) -> list[str]:
    """The names of both, in the order of `declared`; one that is only known stays behind the declared one it has been behind."""
    order = dict.fromkeys(declared)
    followers: dict[str, list[str]] = {"": []}
    place = ""
    for name in known:
        if name in order:
            place = name
        else:
            followers.setdefault(place, []).append(name)
    return [*followers[""], *(each for name in order for each in (name, *followers.get(name, ())))]
