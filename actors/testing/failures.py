"""Failures of nodes and supervisors that fail a test unless the test expects them.

`Rig.advance` and the end of a rig check for them. A test announces failures with `Rig.expect_failure` and causes them with `Rig.crash`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from types import TracebackType
from typing import Final, NamedTuple

from actors.checks import NoPublicConstructor, create
from actors.names.identity import Identity
from actors.places import place_of
from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.reasons import cause_of, is_abnormal
from actors.supervision.report import Report
from actors.system import System

Kinds = type[BaseException] | tuple[type[BaseException], ...]


class UnexpectedFailure(AssertionError):
    """A node failed or a supervisor gave up, and the test did not expect it. `__cause__` is the error of the node."""


class Failure(NamedTuple):
    """One failure: the names and classes of what failed, a description, and the error that caused it."""

    names: tuple[str, ...]
    classes: tuple[type, ...]
    text: str
    error: BaseException | None


class ExpectedFailure(metaclass=NoPublicConstructor):
    """A failure that a test expects, until the test ends or within the ``with`` block that it opens.

    `errors` holds the errors that occurred. The test fails if none has occurred by the end of the block or of the test.

    It has no public constructor: `Rig.expect_failure` gives one.
    """

    def __init__(self, watch: FailureWatch, kinds: Kinds, node: type | str | None, match: str) -> None:
        self.errors: list[BaseException] = []
        self._watch = watch
        self._kinds = kinds
        self._node = node
        self._match = re.compile(match)
        self._met = 0

    def __repr__(self) -> str:
        kinds = self._kinds if isinstance(self._kinds, tuple) else (self._kinds,)
        node = self._node if isinstance(self._node, str) or self._node is None else self._node.__name__
        text = " or ".join(kind.__name__ for kind in kinds)
        return (
            text
            + (f" matching {self._match.pattern!r}" if self._match.pattern else "")
            + (f" of {node}" if node else "")
        )

    def __enter__(self) -> ExpectedFailure:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._watch.expected.remove(self)
        if error is None:
            self._watch.check()
            self.demand("the end of its block")

    def takes(self, failure: Failure) -> bool:
        """Whether `failure` is of the expected kind. If so, it is recorded."""
        if failure.error is None:
            fits = self._kinds is BaseException and not self._match.pattern
        else:
            fits = isinstance(failure.error, self._kinds) and self._match.search(str(failure.error)) is not None
        if isinstance(self._node, str):
            fits = fits and self._node in failure.names
        elif self._node is not None:
            fits = fits and any(issubclass(one, self._node) for one in failure.classes)
        if fits:
            self._met += 1
            if failure.error is not None:
                self.errors.append(failure.error)
        return fits

    def demand(self, end: str) -> None:
        """Raise `AssertionError` if no such failure has occurred. `end` names the end of the period, for the text."""
        if not self._met:
            raise AssertionError(f"expected a failure ({self!r}), but none had come by {end}")


class FailureWatch:
    """Receives the reports of one system, and keeps unexpected failures until they are raised.

    `excused` returns True for a node's error that is not a failure, because a simulation has caused it.

    Invariants:

    * Each failure is judged once, when it is reported: it is planned, excused, matched with all expectations up to the first that takes it,
      or kept for `check`.
    * A failure is raised at most once.
    * After `end` no failure is kept.
    """

    def __init__(self, excused: Callable[[BaseException], bool] | None = None) -> None:
        self._excused = excused
        self.expected: list[ExpectedFailure] = []
        self.planned: list[BaseException] = []
        """The errors that the test itself has raised in nodes."""
        self._system: System | None = None
        self._beside: set[tuple[str, ...]] = set()
        self._untold: list[Failure] = []
        self._ended = False

    def begin(self, system: System) -> None:
        """Watch `system`, which has not been started yet."""
        self._system = system
        self._untold.clear()
        system.observe(reports=self._reported, end=self._tree_ended)

    def end(self) -> None:
        """Judge no failure from now on: the test has killed the system."""
        self._ended = True

    def expect(self, kinds: Kinds, node: type | str | None, match: str) -> ExpectedFailure:
        """Expect a failure from now on. Failures that have been reported before are not affected."""
        expected = create(ExpectedFailure, self, kinds, node, match)
        self.expected.append(expected)
        return expected

    def look_beside(self, own: tuple[str, ...] | None = None) -> None:
        """Judge the failures of nodes outside the tree: all of them, or only that of `own` while the code that opened the others may still
        receive their errors."""
        system = self._system
        for identity, error in system.master.joined.failed() if system is not None else ():
            if identity.path not in self._beside and own in (None, identity.path):
                self._beside.add(identity.path)
                text = f"{identity.fqn}, a node beside the tree, failed: {_described(error)}"
                self._judge(Failure(_names(identity.path, identity), (), text, error))

    def check(self, *, more: str = "") -> None:
        """Raise `UnexpectedFailure` for the failures that have not been raised yet. `more` is added to its text."""
        # `pytest` then shows the line of the test and the error of the node instead of this function.
        __tracebackhide__ = True
        if not self._untold:
            return
        untold, self._untold = self._untold, []
        errors = [failure.error for failure in untold if failure.error is not None]
        kinds = dict.fromkeys(type(error).__name__ for error in errors) or {"": None}
        remedy = " ".join(f"rig.expect_failure({kind})" for kind in kinds)
        lines = [*dict.fromkeys(failure.text for failure in untold), *([more] if more else [])]
        failure = UnexpectedFailure("\n".join(lines))
        failure.add_note(f"If the test means this to happen, let it say so before: {remedy}")
        raise failure from (errors[0] if errors else None)

    def demand(self) -> None:
        """Raise `AssertionError` for a failure that was expected for the rest of the test and has not occurred."""
        for expected in self.expected:
            expected.demand("the end of the test")

    def _tree_ended(self) -> None:
        assert self._system is not None
        failure = self._system.failure
        if failure is not None:
            path = failure.path if isinstance(failure, SupervisorGaveUp) else ("system",)
            self._judge(Failure(_names(path), (), str(failure), failure))

    def _reported(self, report: Report) -> None:
        system = self._system
        assert system is not None
        reason = report.reason
        if reason is None or report.context not in ("child_terminated", "start_error", "shutdown_error"):
            return
        error = cause_of(reason)
        if error is None and (report.context != "child_terminated" or not is_abnormal(reason)):
            return  # an orderly end, or one requested by the child's own `stop`
        state = system.nodes.get(report.child.path)
        identity = state.identity if state is not None else None
        made_by = state.child.factory if state is not None else None
        node_class = state.node_class if state is not None else None
        classes = tuple(one for one in (node_class, made_by) if isinstance(one, type))
        why = _described(error) if error is not None else str(reason)
        place = f"{'/'.join(report.child.path)} (incarnation {report.child.incarnation})"
        text = f"{place} {_VERBS[report.context]} at t={system.clock.now():.3f} s: {why}"
        if isinstance(error, SupervisorGaveUp):
            text = str(error)
        self._judge(Failure(_names(report.child.path, identity), classes, text, error))

    def _judge(self, failure: Failure) -> None:
        if self._ended or any(failure.error is planned for planned in self.planned):
            return
        if self._excused is not None and failure.error is not None and self._excused(failure.error):
            return
        if not any(expected.takes(failure) for expected in self.expected):
            self._untold.append(failure)


_VERBS: Final = {
    "child_terminated": "failed",
    "start_error": "did not start",
    "shutdown_error": "did not stop in order",
}


def _names(path: tuple[str, ...], identity: Identity | None = None) -> tuple[str, ...]:
    """All names under which `expect_failure(node=...)` finds a part of the tree."""
    return (path[-1], "/".join(path), *((identity.name, identity.fqn) if identity is not None else ()))


def _described(error: BaseException) -> str:
    place = place_of(error)
    text = ": ".join(part for part in (type(error).__name__, str(error)) if part)
    return f"{text} (at {place})" if place else text
