"""Failures that fail a test: of nodes, and of supervisors that give up, unless the test says that it expects them.

`Rig.advance` and the rig's end look here; `Rig.expect_failure` and `Rig.crash` say what is meant to happen.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Final

from actors.places import place_of
from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.reasons import cause_of, is_abnormal

if TYPE_CHECKING:
    from actors.names.identity import Identity
    from actors.supervision.report import Report
    from actors.system import System

__all__ = ["ExpectedFailure", "FailureWatch", "UnexpectedFailure"]

Kinds = type[BaseException] | tuple[type[BaseException], ...]


class UnexpectedFailure(AssertionError):
    """A node failed, or a supervisor gave up, in a test that did not say so. Its `__cause__` is the node's own error."""


class Failure:
    """One thing that failed: what it is called in the tree and in the graph, when, why, and the error behind it."""

    __slots__ = ("classes", "error", "names", "text")

    def __init__(
        self, names: tuple[str, ...], classes: tuple[type, ...], text: str, error: BaseException | None
    ) -> None:
        self.names: Final = names
        self.classes: Final = classes
        self.text: Final = text
        self.error: Final = error


class ExpectedFailure:
    """A failure that a test expects: from where it says so to its end, or within the ``with`` block that it opens.

    `errors` are those that came. The test fails when none has come by the end of the block, or of the test.

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
        """Whether this is one of those that were expected; if so it is kept."""
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
        """Fail unless it has come."""
        if not self._met:
            raise AssertionError(f"expected a failure ({self!r}), but none had come by {end}")


class FailureWatch:
    """Hears the reports of one system and keeps the failures that nobody expected, until they are raised.

    `excused` says of a node's error that it is no failure: a simulation has caused it.
    """

    def __init__(self, excused: Callable[[BaseException], bool] | None = None) -> None:
        self._excused = excused
        self.expected: list[ExpectedFailure] = []
        self.planned: list[BaseException] = []
        """Errors with which the test itself made a node fail."""
        self._system: System | None = None
        self._beside: set[tuple[str, ...]] = set()
        self._untold: list[Failure] = []

    def begin(self, system: System) -> None:
        """Watch `system`, which has not started yet."""
        self._system = system
        self._untold.clear()
        system.observe(reports=self._reported, end=self._tree_ended)

    def expect(self, kinds: Kinds, node: type | str | None, match: str) -> ExpectedFailure:
        """From now on; what failed before is judged without it."""
        expected = ExpectedFailure(self, kinds, node, match)
        self.expected.append(expected)
        return expected

    def look_beside(self, own: tuple[str, ...] | None = None) -> None:
        """Take notice of nodes beside the tree that failed; only of `own` while the others' errors may still be raised to who opened them."""
        system = self._system
        for identity, error in system.runtime.tree.unsupervised.failed() if system is not None else ():
            if identity.path not in self._beside and own in (None, identity.path):
                self._beside.add(identity.path)
                text = f"{identity.fqn}, a node beside the tree, failed: {_described(error)}"
                self._judge(Failure(_names(identity.path, identity), (), text, error))

    def check(self, *, more: str = "") -> None:
        """Raise `UnexpectedFailure` for what has failed and has not been raised yet."""
        __tracebackhide__ = True  # pytest then shows the test's line and the node's error, not this
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
        """Fail when something was expected for the rest of the test and has not come."""
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
            return  # an orderly end, or one that the child's own `stop` asks for
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
        if any(failure.error is planned for planned in self.planned):
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
    """All that a part of the tree may be called by in `expect_failure(node=...)`."""
    return (path[-1], "/".join(path), *((identity.name, identity.fqn) if identity is not None else ()))


def _described(error: BaseException) -> str:
    place = place_of(error)
    text = ": ".join(part for part in (type(error).__name__, str(error)) if part)
    return f"{text} (at {place})" if place else text
