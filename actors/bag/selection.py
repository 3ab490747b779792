"""Which topics, services and actions are meant, by name, pattern or type."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final

from actors.names.names import is_hidden
from actors.suggest import near_name

EVENT: Final = "/_service_event"
ACTION: Final = "/_action/"


def service_of(topic: str) -> str | None:
    """The service whose events are on this topic, or None. Those of the services of an action belong to the action."""
    return topic.removesuffix(EVENT) if topic.endswith(EVENT) and ACTION not in topic else None


def action_of(topic: str) -> str | None:
    """The action that this topic is a part of (its feedback, its status, the events of its services), or None."""
    action, found, _ = topic.partition(ACTION)
    return action if found else None


def _names(names: Iterable[str]) -> frozenset[str]:
    return frozenset(name if name.startswith("/") else f"/{name}" for name in names)


@dataclass(frozen=True, kw_only=True)
class Selection:
    """Topics, services and actions by name, pattern or type. What is excluded is not taken in any case.

    Names are full names. Patterns are searched in the names of topics, services and actions. Hidden topics (those with a part that begins
    with an underscore) are taken only by name, or with `hidden`; the topics of services and actions are taken with these, and only so.
    """

    topics: Iterable[str] = ()
    all_topics: bool = False
    types: Iterable[str] = ()
    services: Iterable[str] = ()
    all_services: bool = False
    actions: Iterable[str] = ()
    all_actions: bool = False
    regex: str = ""
    exclude_regex: str = ""
    exclude_topics: Iterable[str] = ()
    exclude_types: Iterable[str] = ()
    exclude_services: Iterable[str] = ()
    exclude_actions: Iterable[str] = ()
    hidden: bool = False
    _sets: dict[str, frozenset[str]] = field(
        init=False, repr=False, compare=False, default_factory=dict[str, frozenset[str]]
    )

    def __post_init__(self) -> None:
        for name in ("topics", "services", "actions", "exclude_topics", "exclude_services", "exclude_actions"):
            self._sets[name] = _names(getattr(self, name))
        for name in ("types", "exclude_types"):
            self._sets[name] = frozenset(getattr(self, name))
        for pattern in (self.regex, self.exclude_regex):
            try:
                re.compile(pattern)
            except re.error as error:
                raise ValueError(f"{pattern!r} is no regular expression: {error}") from None

    @property
    def names(self) -> frozenset[str]:
        """The topics that are given by name."""
        return self._sets["topics"]

    def takes(self, topic: str, type: str) -> bool:
        """Whether a topic of this full name and type is meant."""
        if topic in self._sets["topics"] and not self._excluded(topic):
            return True
        if (service := service_of(topic)) is not None:
            wanted = self.all_services or service in self._sets["services"] or self._matches(service)
            return wanted and service not in self._sets["exclude_services"] and not self._excluded(service)
        if (action := action_of(topic)) is not None:
            wanted = self.all_actions or action in self._sets["actions"] or self._matches(action)
            return wanted and action not in self._sets["exclude_actions"] and not self._excluded(action)
        if is_hidden(topic) and not self.hidden:
            return False
        wanted = self.all_topics or type in self._sets["types"] or self._matches(topic)
        excluded = topic in self._sets["exclude_topics"] or type in self._sets["exclude_types"]
        return wanted and not excluded and not self._excluded(topic)

    def absent(self, topics: Iterable[str]) -> Iterator[str]:
        """What is given by name and is not among these topics: ``topic /spd; did you mean '/speed'?``."""
        names = list(topics)
        known = {
            "topic": set(names),
            "service": {service for name in names if (service := service_of(name)) is not None},
            "action": {action for name in names if (action := action_of(name)) is not None},
        }
        for kind, there in known.items():
            for name in sorted(self._sets[f"{kind}s"] - there):
                yield f"{kind} {name}{near_name(name, sorted(there))}"

    def _matches(self, name: str) -> bool:
        return bool(self.regex) and re.search(self.regex, name) is not None

    def _excluded(self, name: str) -> bool:
        return bool(self.exclude_regex) and re.search(self.exclude_regex, name) is not None


EVERYTHING: Final = Selection(all_topics=True, all_services=True, all_actions=True, hidden=True)
"""All topics, services and actions."""
