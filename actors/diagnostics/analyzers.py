"""The analyzers of an aggregator: each takes the statuses that are its own, and reports them under a path."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from actors.contracts.contracts import Topic
from actors.diagnostics.status import DIAGNOSTICS, DIAGNOSTICS_AGG, LEVELS
from actors.errors import DeclarationError
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from actors.interfaces.std_msgs.msg import Header
from actors.parameters.declare import parameter
from actors.runtime.declarations import every, publishes
from actors.runtime.node import Node
from actors.suggest import did_you_mean

GENERIC: Final = "diagnostic_aggregator/GenericAnalyzer"
_OPTIONS: Final = frozenset(
    {
        "contains", "discard_stale", "expected", "find_and_remove_prefix", "name", "num_items", "path", "regex", "remove_prefix",
        "startswith", "timeout", "type",
    }
)  # fmt: skip


class Analyzer:
    """ROS 2's GenericAnalyzer: the statuses whose names it matches, as items below ``<path>``, and their worst level at it.

    A status that was not renewed for `timeout` seconds counts as stale; with a negative one it never does.
    """

    def __init__(self, base: str, name: str, options: Mapping[str, Any]) -> None:
        unknown = sorted(options.keys() - _OPTIONS)
        if unknown:
            raise DeclarationError(
                f"analyzers.{name} has no option {unknown[0]!r}{did_you_mean(unknown[0], _OPTIONS)}; "
                f"there are {', '.join(sorted(_OPTIONS))}"
            )
        self.path = f"{base}/{options.get('path', name).strip('/')}"
        prefixes = _texts(options, "find_and_remove_prefix")
        self._starts = (*_texts(options, "startswith"), *prefixes)
        self._contains = _texts(options, "contains")
        self._patterns = tuple(map(re.compile, _texts(options, "regex")))
        self._expected = _texts(options, "expected")
        self._removed = (*prefixes, *_texts(options, "remove_prefix"))
        self._timeout = float(options.get("timeout", 5.0))
        self._discards = bool(options.get("discard_stale", False))
        self._number = int(options.get("num_items", -1))
        self._items: dict[str, tuple[float, DiagnosticStatus]] = {
            name: (-float("inf"), DiagnosticStatus(level=DiagnosticStatus.STALE, name=name, message="Missing"))
            for name in self._expected
        }

    def matches(self, name: str) -> bool:
        """Whether a status of this name is this analyzer's."""
        return (
            name in self._expected
            or name.startswith(self._starts)
            or any(part in name for part in self._contains)
            or any(pattern.fullmatch(name) for pattern in self._patterns)
        )

    def take(self, status: DiagnosticStatus, now: float) -> None:
        self._items[status.name] = (now, status)

    def report(self, now: float) -> list[DiagnosticStatus]:
        """The header and the items, the header first."""
        if self._discards:
            self._items = {name: one for name, one in self._items.items() if not self._is_stale(one, now)}
        items = [self._item(one, now) for _, one in sorted(self._items.items())]
        return [self._header(items), *items]

    def _is_stale(self, item: tuple[float, DiagnosticStatus], now: float) -> bool:
        return 0 < self._timeout < now - item[0]

    def _item(self, item: tuple[float, DiagnosticStatus], now: float) -> DiagnosticStatus:
        status = item[1]
        name = status.name
        for prefix in self._removed:
            if name.startswith(prefix):
                name = name[len(prefix) :].lstrip(" :/")
                break
        level = DiagnosticStatus.STALE if self._is_stale(item, now) else status.level
        return status.replace(level=level, name=f"{self.path}/{name.replace('/', ' ').strip()}")

    def _header(self, items: Iterable[DiagnosticStatus]) -> DiagnosticStatus:
        held = list(items)
        level = max((one.level for one in held), default=DiagnosticStatus.OK)
        if level == DiagnosticStatus.STALE and any(one.level != level for one in held):
            level = DiagnosticStatus.ERROR  # some are stale, and that is an error
        message = LEVELS.get(level, str(level))
        if 0 <= self._number != len(held):
            level, message = DiagnosticStatus.ERROR, f"Expected {self._number}, found {len(held)}"
        values = [KeyValue(key=one.name.rpartition("/")[2], value=one.message) for one in held]
        return DiagnosticStatus(level=level, name=self.path, message=message, values=values)


def analyzers_of(base: str, parameters: Mapping[str, object]) -> list[Analyzer]:
    """The analyzers that parameters ``analyzers.<name>.<option>`` declare, in their order. Raises `DeclarationError`."""
    declared: dict[str, dict[str, object]] = {}
    for key, value in parameters.items():
        name, dot, option = key.partition(".")
        if not dot:
            raise DeclarationError(f"analyzers.{key} must be analyzers.<name>.<option>")
        declared.setdefault(name, {})[option] = value
    for name, options in declared.items():
        kind = options.get("type", "")
        if kind != GENERIC:
            raise DeclarationError(f"analyzers.{name}.type is {kind!r}; the one that is known here is {GENERIC}")
    return [Analyzer(base, name, options) for name, options in declared.items()]


def _texts(options: Mapping[str, Any], name: str) -> tuple[str, ...]:
    value = options.get(name, ())
    return (value,) if isinstance(value, str) else tuple(value)


TOPLEVEL: Final = Topic(DiagnosticStatus, "/diagnostics_toplevel_state")


class Aggregator(Node):
    """Sorts what comes on ``/diagnostics`` and publishes it on ``/diagnostics_agg``, and the worst level on ``/diagnostics_toplevel_state``.

    Its parameters are those of diagnostic_aggregator: ``path``, ``pub_rate``, ``other_as_errors`` and
    ``analyzers.<name>.<option>`` for analyzers of the type ``diagnostic_aggregator/GenericAnalyzer``. What no analyzer takes is reported
    under ``Other``.
    """

    node_name = "diagnostic_aggregator"
    automatically_declare_parameters_from_overrides = True

    path = parameter("")
    pub_rate = parameter(1.0, unit="Hz")
    other_as_errors = parameter(False)
    aggregated = publishes(DIAGNOSTICS_AGG)
    toplevel = publishes(TOPLEVEL)

    async def on_start(self) -> None:
        base = f"/{self.path.strip('/')}".rstrip("/")
        given = self.get_parameters_by_prefix("analyzers")
        self.analyzers = analyzers_of(base, {name: one.value for name, one in given.items()})
        self.other = Analyzer(base, "Other", {"type": GENERIC, "discard_stale": True})

    @DIAGNOSTICS.on(qos=1000)
    def take(self, message: DiagnosticArray) -> None:
        """Give each status to the analyzers that match it."""
        now = self.clock.now()
        for status in message.status:
            takers = [one for one in self.analyzers if one.matches(status.name)]
            for one in takers or [self.other]:
                if one is self.other and self.other_as_errors:
                    status = status.replace(level=DiagnosticStatus.ERROR)
                one.take(status, now)

    @every(hz="pub_rate")
    def report(self) -> None:
        now, stamp = self.clock.now(), self.clock.stamp()
        headers: list[DiagnosticStatus] = []
        statuses: list[DiagnosticStatus] = []
        for one in (*self.analyzers, self.other):
            header, *items = one.report(now)
            if items or one is not self.other:
                headers.append(header)
                statuses += [header, *items]
        self.aggregated(DiagnosticArray(header=Header(stamp=stamp), status=statuses))
        worst = _worst(headers)
        self.toplevel(DiagnosticStatus(level=worst, name="toplevel_state", message=LEVELS.get(worst, str(worst))))


def _worst(headers: list[DiagnosticStatus]) -> int:
    """The worst level of several headers; stale is an error unless all are stale."""
    levels = {header.level for header in headers} or {DiagnosticStatus.OK}
    worst = max(levels)
    return DiagnosticStatus.ERROR if worst == DiagnosticStatus.STALE and len(levels) > 1 else worst
