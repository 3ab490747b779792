"""`decide`: the rules of Erlang/OTP's `supervisor`, as one pure function from an event to acts.

`decide` reads the event and the state of the supervisor, and answers with acts. It waits for nothing, changes nothing and needs
no event loop. `Executor` carries the acts out, in their order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from actors.supervision.acts import (
    Act,
    CloseWhenReady,
    Confirm,
    Drop,
    Forget,
    Kill,
    Restart,
    RestartGroup,
    ShutDown,
    Start,
    Stop,
    StopNext,
    Tell,
)
from actors.supervision.administer import REQUESTS, for_good, forgotten, gone
from actors.supervision.children import Children
from actors.supervision.entry import Entry
from actors.supervision.errors import StartFailed, SupervisorGaveUp
from actors.supervision.events import AllReady, Ended, Event, KillAsked, Ready, StopAsked
from actors.supervision.policy import all_significant, any_significant, one_for_all, one_for_one, permanent, temporary
from actors.supervision.reasons import ExitReason, Killed, Returned, cause_of, is_abnormal

STOP_NEXT: Final = StopNext()
ONLY_STOP_NEXT: Final = (STOP_NEXT,)  # the answer to most ends while a supervisor stops, made once


def decide(event: Event, children: Children) -> Sequence[Act]:
    """The acts that follow from `event`. `children` already reflects the event: the life of an `Ended` is no longer in it.

    Raises the error with which a request is refused.
    """
    if (rule := RULES.get(type(event))) is None:
        children.check_open()
        rule = REQUESTS[type(event)]
    return rule(event, children)


def _ready(event: Ready, children: Children) -> Sequence[Act]:
    life = event.life
    if life.over or life.ready:
        return (Tell("unexpected", life, note="it said once more that it has started; dropped"),)
    return () if life.asked is not None or life.imposed is not None else (Confirm(life.ref.path[-1]),)


# ---------------------------------------------------------------------- the end of a life


def _ended(event: Ended, children: Children) -> Sequence[Act]:
    if children.phase == "stopping":
        return _ended_while_stopping(event, children)
    life, child = event.life, children.entries[event.life.ref.path[-1]]
    if life.asked is not None or child.marked:
        return _ended_by_request(event, child, children)
    if life.ready:
        return _ended_by_itself(event, child, children)
    if life.declined:
        return (Drop(life.ref.id), *for_good(child, children))
    return _failed_to_start(event, child, children)


def _ended_by_request(event: Ended, child: Entry, children: Children) -> Sequence[Act]:
    acts: Sequence[Act] = ()
    if not child.intent:
        acts = for_good(child, children)
    elif not child.queued:
        acts = (Start(child.id),)
    if _unclean(event.reason, child):
        return (Tell("shutdown_error", event.life, event.reason), *acts)
    return acts


def _ended_by_itself(event: Ended, child: Entry, children: Children) -> Sequence[Act]:
    """The end of a child by itself: a permanent one is restarted in any case, a transient one after a failure, a temporary one never."""
    restart, abnormal = child.spec.restart, is_abnormal(event.reason)
    acts: list[Act] = []
    if abnormal or restart == permanent:
        acts.append(Tell("child_terminated", event.life, event.reason))
    if restart == permanent or (abnormal and restart != temporary):
        return [*acts, *_restart(event, child, children)]
    if not (child.spec.significant and _ends_with(child, children)):
        return [*acts, *for_good(child, children)]
    if children.phase == "starting":
        return [*acts, CloseWhenReady(event), *for_good(child, children)]
    return [*acts, *forgotten(child, children), *_close(event, children), *_gone_of_a_template(child, children)]


def _ends_with(child: Entry, children: Children) -> bool:
    """Whether the supervisor shuts down because the significant `child` has ended for good."""
    if children.spec.auto_shutdown == all_significant:
        return not any(
            other.spec.significant and (other.now or other.intent) for other in children if other is not child
        )
    return children.spec.auto_shutdown == any_significant


def _all_ready(event: AllReady, children: Children) -> Sequence[Act]:
    return () if children.closing is None else _close(children.closing, children)


def _close(event: Ended, children: Children) -> Sequence[Act]:
    note = f"auto_shutdown={children.spec.auto_shutdown}"
    return (Tell("shutdown", event.life, event.reason, note), *_shut_down(children, "shutdown"))


def _failed_to_start(event: Ended, child: Entry, children: Children) -> Sequence[Act]:
    """A failed start: a restart is tried again, and counts; the caller of a request gets the error; a first start ends the supervisor."""
    told = Tell("start_error", event.life, event.reason)
    if child.intent == "restart":
        return (told, *_restart(event, child, children))
    error = _start_failed(event)
    if child.answer is None:
        return (told, *_shut_down(children, "shutdown", error))
    drop = Drop(child.id, error, park=True)
    if child.fresh:
        return (told, drop, Forget(child.id), gone(child, children, lost=True))
    return (told, drop, *for_good(child, children))


def _start_failed(event: Ended) -> StartFailed:
    reason = event.reason
    cause = cause_of(reason)
    if isinstance(cause, StartFailed):  # raised by a supervisor below: it names the child at fault
        return cause
    failure = StartFailed(event.life.ref.path, str(reason) if cause else f"{reason} before it had started")
    failure.__cause__ = cause
    return failure


# ---------------------------------------------------------------------- restarts


def _restart(event: Ended, child: Entry, children: Children) -> Sequence[Act]:
    """Restart the child, and with it those that the strategy names, unless the restart intensity is reached."""
    spec, at = children.spec, event.at
    if children.window.full(at, spec.intensity):
        return (*_give_up(event, children), *_gone_of_a_template(child, children))
    backoff = child.spec.backoff
    earlier = None if backoff is None else child.earlier_attempts(backoff, at)
    if spec.strategy == one_for_one:
        return (Restart(child.id, at, earlier),)
    stops, due = _group(child, children)
    return (RestartGroup(child.id, at, earlier, stops, due),)


def _group(failed: Entry, children: Children) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The children to stop, and those whose start becomes due, in a restart of the group of `failed`.

    A child that is starting is stopped, too, and its start stays due. A child that had ended for good by itself is started with
    its group; one that was stopped by a request is not.
    """
    stops: list[str] = []
    due: list[str] = []
    reached = children.spec.strategy == one_for_all
    for other in children:
        life = other.now
        if other is failed:
            reached = True
        elif not reached:
            continue
        elif life is None:
            if not other.intent and not other.parked:
                due.append(other.id)
        elif life.asked is None:
            stops.append(other.id)
            if life.ready and other.spec.restart != temporary:
                due.append(other.id)
    return tuple(reversed(stops)), tuple(due)


def _give_up(event: Ended, children: Children) -> Sequence[Act]:
    intensity = children.spec.intensity
    failure = SupervisorGaveUp(children.path, event.life.ref.id, intensity.restarts, intensity.within, event.reason)
    failure.__cause__ = cause_of(event.reason)
    note = "restart intensity reached" if intensity.restarts else "no restart is allowed"
    told = Tell("shutdown", event.life, event.reason, note)
    return (told, *_shut_down(children, "shutdown", failure))


# ---------------------------------------------------------------------- the end of the supervisor


def _shut_down(children: Children, why: str, failure: Exception | None = None) -> Sequence[Act]:
    """End the supervisor: children stop one at a time, the last one first; instances of a template stop together."""
    if children.phase not in ("starting", "running"):
        return ()
    together = [Stop(name, why) for name in _alive(children)] if children.dynamic else ()
    return (ShutDown(why, failure), *together, STOP_NEXT)


def _kill(event: KillAsked, children: Children) -> Sequence[Act]:
    begun = () if children.phase == "stopping" else (ShutDown("killed"),)
    return (*begun, *(Kill(name) for name in _alive(children)), STOP_NEXT)


def _alive(children: Children) -> list[str]:
    """The names of the children that live, the last one first."""
    return [child.id for child in reversed(children.entries.values()) if child.now is not None]


def _ended_while_stopping(event: Ended, children: Children) -> Sequence[Act]:
    life, reason, child = event.life, event.reason, children.entries[event.life.ref.path[-1]]
    by_itself = life.asked is None and life.killed is None
    told: tuple[Act, ...] = ()
    if by_itself and not life.ready:
        if not life.declined:
            told = (Tell("start_error", life, reason),)
    elif _unclean(reason, child) or (by_itself and isinstance(reason, Returned) and child.spec.restart == permanent):
        told = (Tell("shutdown_error", life, reason),)
    if not told and not children.dynamic:
        return ONLY_STOP_NEXT
    return (*told, STOP_NEXT, *_gone_of_a_template(child, children))


def _unclean(reason: ExitReason, child: Entry) -> bool:
    brutal = child.spec.stop == "kill" and isinstance(reason, Killed)
    return is_abnormal(reason) and not brutal


def _gone_of_a_template(child: Entry, children: Children) -> Sequence[Act]:
    """Tell the system that an instance of a template is gone. Of other children the end of the supervisor says enough."""
    return (gone(child, children, lost=True),) if children.dynamic else ()


RULES: Final[Mapping[type[Event], Callable[[Any, Children], Sequence[Act]]]] = {
    Ready: _ready,
    Ended: _ended,
    AllReady: _all_ready,
    StopAsked: lambda event, children: _shut_down(children, event.why),
    KillAsked: _kill,
}
"""Kind of event -> the function that decides about it; for requests see `REQUESTS`. One lookup costs less than a chain of tests."""
