"""`Children`: the state of a running supervisor, with its children in start order."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from typing import Literal, TypeAlias

from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import NotFound, SupervisorDown
from actors.supervision.events import Ended
from actors.supervision.policy import Intensity
from actors.supervision.steps import Steps

Phase: TypeAlias = Literal["new", "starting", "running", "stopping", "over"]


class Window:
    """The times of the restarts in the last `within` seconds. A restart exactly `within` seconds old still counts.

    Invariants: `times` ascend, loop time in seconds. When a time is added, those more than `within` seconds before it are
    removed.
    """

    __slots__ = ("times",)

    def __init__(self) -> None:
        self.times: deque[float] = deque()

    def full(self, now: float, intensity: Intensity) -> bool:
        """Whether a restart at `now` would be one more than `intensity` allows. This changes nothing."""
        times, allowed = self.times, intensity.restarts
        if len(times) < allowed:
            return False
        return allowed == 0 or _recent(times[-allowed], now, intensity)

    def add(self, now: float, intensity: Intensity) -> None:
        """Count a restart at `now`, and remove those that are too old to count."""
        times = self.times
        times.append(now)
        while not _recent(times[0], now, intensity):
            times.popleft()


def _recent(at: float, now: float, intensity: Intensity) -> bool:
    return round(now - at, 9) <= intensity.within  # deadlines are exact to 1 ns, so ages are rounded to that


class Children:
    """The state of one run of a supervisor: its present declaration, `spec`, and an entry for each child.

    `dynamic` says that the children are instances of a template; `numbered` is the last number used to name one. `why` is the
    reason of the supervisor's end. `closing` is the end of a significant child that ends the supervisor once all have started.

    Invariants:

    - `entries` has each entry under its child's id, in start order; the `position`s of the entries ascend in this order.
    - Every child that lives has an entry.
    - `phase` only moves forwards, from "new" to "over". From "stopping" on nothing is due, planned or held back, and no life
      begins. `last` then holds the entries that lived when the stop began, in start order; it is shortened from its end as
      they end.
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
        """The path of the supervisor from the root, joined by slashes."""
        return "/".join(self.path)

    def check_open(self) -> None:
        """Raise `SupervisorDown` unless the supervisor is starting or running, and so can serve requests."""
        if self.phase not in ("starting", "running"):
            raise SupervisorDown(f"supervisor {self.name} is not running (it is {self.phase}); it can do nothing now")

    def find(self, name: str) -> Entry:
        """The child with this id. Raises `NotFound`."""
        if (entry := self.entries.get(name)) is not None:
            return entry
        if isinstance(self.spec, DynamicSupervisor) and name == self.spec.template.name:
            raise NotFound(f"{self.name}: {name!r} names the template; give the reference, or the id, of one instance")
        raise NotFound(f"{self.name} has no child {name!r}; it has: {', '.join(self.entries) or 'none'}")

    def add(
        self, spec: Spec, given: tuple[tuple[object, ...], Mapping[str, object] | None] = ((), None), id: str = ""
    ) -> Entry:
        """Add an entry for a child, after the others. Its id is its name unless another one is given."""
        self.position += 1
        entry = Entry(spec, self.position, id)
        self.entries[entry.id] = entry
        entry.given = given
        return entry

    def begin(self) -> None:
        """Begin the start of the supervisor: the first start of all children is due."""
        self.phase = "starting"
        for entry in self:
            entry.intent = "start"
        self.steps.plan(self)

    def restart(self, entry: Entry, at: float, earlier: int | None) -> None:
        """Count a restart of the child at `at`, loop time in seconds, and make it due."""
        self.window.add(at, self.spec.intensity)
        entry.intent = "restart"
        if earlier is not None:
            entry.attempts, entry.ready_at = earlier + 1, None

    def plan(self, stops: Iterable[str], due: Iterable[str]) -> None:
        """Mark the children in `stops` to be stopped, and make a restart due for those in `due`; ordered work under way is merged in."""
        for name in stops:
            self.entries[name].marked = True
        for name in due:
            self.entries[name].intent = "restart"
        self.steps.plan(self)

    def close_when_ready(self, end: Ended) -> None:
        """Have the supervisor end because of `end` once all children have started; the first call counts."""
        self.closing = self.closing or end

    def shut_down(self, why: str) -> None:
        """Begin the end of the supervisor: drop all plans, and note the children that live, to be stopped last first."""
        self.phase, self.why = "stopping", why
        self.last = [entry for entry in self if entry.now is not None]
        self.steps.clear()

    def last_alive(self) -> Entry | None:
        """The child to stop next, while the supervisor stops; None when all have ended."""
        while self.last and self.last[-1].now is None:
            self.last.pop()
        return self.last[-1] if self.last else None

    def adopt(self, spec: Supervisor | DynamicSupervisor) -> None:
        """Replace the declaration by one of the same kind and name. New children are added, but not started."""
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
    """The names of both in the order of `declared`. A name that is only in `known` follows the declared name that it followed there."""
    order = dict.fromkeys(declared)
    followers: dict[str, list[str]] = {"": []}
    place = ""
    for name in known:
        if name in order:
            place = name
        else:
            followers.setdefault(place, []).append(name)
    return [*followers[""], *(each for name in order for each in (name, *followers.get(name, ())))]
