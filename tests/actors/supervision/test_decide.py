"""The rules of the supervisor as a table: an event and the books on the left, the acts on the right. No event loop runs."""

from __future__ import annotations

from typing import Any

import pytest

from actors.errors import DeclarationError
from actors.supervision.acts import (
    Act,
    Add,
    Adopt,
    Answer,
    CloseWhenReady,
    Confirm,
    Drop,
    Due,
    EndHold,
    Forget,
    Gone,
    Kill,
    Restart,
    RestartGroup,
    ShutDown,
    Start,
    Stop,
    StopNext,
    Tell,
    Terminate,
    Update,
)
from actors.supervision.child import Child
from actors.supervision.children import Children, Phase, merged
from actors.supervision.decide import decide
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import (
    AlreadyPresent,
    AlreadyStarted,
    NotFound,
    Restarting,
    Running,
    StartFailed,
    SupervisorDown,
    SupervisorGaveUp,
    TooManyChildren,
)
from actors.supervision.events import (
    AllReady,
    DeleteChild,
    KillAsked,
    Ready,
    Reconfigure,
    ReplaceFactory,
    Request,
    RestartChild,
    Spawn,
    StartChild,
    StopAsked,
    TerminateChild,
)
from actors.supervision.policy import (
    AutoShutdown,
    Backoff,
    Intensity,
    Strategy,
    all_significant,
    any_significant,
    never,
    one_for_all,
    one_for_one,
    permanent,
    rest_for_one,
    temporary,
    transient,
)
from actors.supervision.policy import Restart as RestartType
from actors.supervision.reasons import ExitReason, Failed, Killed, Leaked, Returned, Stopped
from actors.supervision.refs import ChildRef
from tests.actors.supervision.bookkeeping import books, end, life
from tests.actors.supervision.kit import child, node

BROKEN = Failed(OSError("broken"))
ENDS: list[ExitReason] = [Returned(), Stopped(), BROKEN, Killed(None), Leaked(1.0)]


def group(*names: str, **options: Any) -> Supervisor:
    """A supervisor of permanent children."""
    return Supervisor("top", children=[child(name) for name in names], **options)


def only(kind: type[Act] | tuple[type[Act], ...], found: Any) -> list[Act]:
    """The acts of these kinds, in order."""
    return [act for act in found if isinstance(act, kind)]


# ---------------------------------------------------------------------- how a life ends, by restart type


@pytest.mark.parametrize("reason", ENDS, ids=str)
@pytest.mark.parametrize("restart", [permanent, transient, temporary])
def test_restart_types(restart: RestartType, reason: ExitReason) -> None:
    children = books(Supervisor("top", children=[child("a", restart=restart)]))
    event = end(children, "a", reason)
    abnormal = not isinstance(reason, (Returned, Stopped))
    told = [Tell("child_terminated", event.life, reason)]
    expected: list[Act] = {
        (permanent, False): [*told, Restart("a", 0.0, None)],
        (permanent, True): [*told, Restart("a", 0.0, None)],
        (transient, False): [Gone("a", kept=True)],
        (transient, True): [*told, Restart("a", 0.0, None)],
        (temporary, False): [Forget("a"), Gone("a", kept=True)],
        (temporary, True): [*told, Forget("a"), Gone("a", kept=True)],
    }[restart, abnormal]
    assert list(decide(event, children)) == expected


def test_a_temporary_child_that_is_not_declared_is_gone_without_a_trace() -> None:
    children = books(group("a"))
    children.add(child("b", restart=temporary))
    assert list(decide(end(children, "b", Returned()), children)) == [Forget("b"), Gone("b", kept=False)]


@pytest.mark.parametrize("restart", [transient, temporary])
def test_an_instance_of_a_template_is_forgotten_when_it_has_ended_for_good(restart: RestartType) -> None:
    children = books(DynamicSupervisor("top", child("a", restart=restart)), instances=2)
    assert list(decide(end(children, "a_1", Returned()), children)) == [Forget("a_1"), Gone("a_1", kept=False)]


# ---------------------------------------------------------------------- whom a restart concerns


@pytest.mark.parametrize(
    ("strategy", "expected"),
    [
        (one_for_one, Restart("c", 7.0, None)),
        (one_for_all, RestartGroup("c", 7.0, None, stops=("e", "d", "b", "a"), due=("a", "b", "d", "e"))),
        (rest_for_one, RestartGroup("c", 7.0, None, stops=("e", "d"), due=("d", "e"))),
    ],
)
def test_strategies(strategy: Strategy, expected: Act) -> None:
    children = books(group(*"abcde", strategy=strategy))
    assert decide(end(children, "c", BROKEN, at=7.0), children)[-1] == expected


def test_who_of_a_group_is_stopped_and_who_begins_anew() -> None:
    spec = Supervisor(
        "top",
        strategy=one_for_all,
        children=[*(child(name) for name in ("failed", "starts", "asked", "ended", "parked", "due")),
                  child("short", restart=temporary)],
    )  # fmt: skip
    children = books(spec)
    children["starts"].now, children["starts"].intent = life("starts", ready=False), "start"
    children["asked"].now = life("asked", asked="terminated")
    children["ended"].now = None
    children["parked"].now, children["parked"].parked = None, True
    children["due"].now, children["due"].intent = None, "restart"
    (restart,) = only(RestartGroup, decide(end(children, "failed", BROKEN), children))
    assert restart == RestartGroup("failed", 0.0, None, stops=("short", "starts"), due=("ended",))


# ---------------------------------------------------------------------- how often, how fast


@pytest.mark.parametrize(
    ("restarts", "times", "at", "gives_up"),
    [
        (0, [], 0.0, True),
        (1, [], 0.0, False),
        (1, [0.0], 5.0, True),
        (1, [0.0], 5.1, False),
        (3, [0.0, 1.0], 2.0, False),
        (3, [0.0, 1.0, 2.0], 2.0, True),
        (3, [0.0, 4.0, 4.5], 5.1, False),
        (1, [3.0, 3.5, 4.0], 5.0, True),
    ],
)
def test_intensity(restarts: int, times: list[float], at: float, gives_up: bool) -> None:
    children = books(group("a", "b", intensity=Intensity(restarts, within=5.0)))
    children.window.times.extend(times)
    event = end(children, "a", BROKEN, at=at)
    answer = decide(event, children)
    if not gives_up:
        assert answer[-1] == Restart("a", at, None)
        return
    note = "restart intensity reached" if restarts else "no restart is allowed"
    assert answer[1] == Tell("shutdown", event.life, BROKEN, note)
    shut_down = answer[2]
    assert isinstance(shut_down, ShutDown)
    assert isinstance(shut_down.failure, SupervisorGaveUp)
    assert shut_down.failure.__cause__ is BROKEN.error
    assert list(answer[3:]) == [StopNext()]


@pytest.mark.parametrize(
    ("attempts", "ready_at", "earlier"), [(0, None, 0), (4, None, 4), (4, 9.5, 4), (4, 4.5, 0), (0, 9.5, 0)]
)
def test_backoff(attempts: int, ready_at: float | None, earlier: int) -> None:
    backoff = Backoff(first=1.0, most=10.0)
    children = books(Supervisor("top", children=[child("a", backoff=backoff)]))
    children["a"].attempts, children["a"].ready_at = attempts, ready_at
    assert decide(end(children, "a", BROKEN, at=10.0), children)[-1] == Restart("a", 10.0, earlier)


# ---------------------------------------------------------------------- starts


def test_ready() -> None:
    children = books(group("a"))
    assert decide(Ready(life("a", ready=False)), children) == (Confirm("a"),)
    assert decide(Ready(life("a", ready=False, asked="shutdown")), children) == ()
    assert decide(Ready(life("a", ready=False, imposed=OSError())), children) == ()
    for stale in (life("a"), life("a", ready=False, over=True)):
        (told,) = decide(Ready(stale), children)
        assert told == Tell("unexpected", stale, note="it said once more that it has started; dropped")


def failed_start(children: Children, name: str, reason: ExitReason = BROKEN) -> Any:
    event = end(children, name, reason, ready=False)
    answer = decide(event, children)
    assert answer[0] == Tell("start_error", event.life, reason)
    return answer[1:]


def test_a_first_start_that_fails_is_the_end_of_the_supervisor() -> None:
    children = books(group("a", "b"), phase="starting")
    children["b"].intent = "start"
    shut_down, step = failed_start(children, "b")
    assert isinstance(shut_down.failure, StartFailed)
    assert str(shut_down.failure) == "b did not start: it raised OSError: broken (in the tree: top/b)"
    assert shut_down.failure.__cause__ is BROKEN.error
    assert step == StopNext()


def test_the_leaf_that_did_not_start_is_at_fault_however_deep_it_is() -> None:
    children = books(group("a"), phase="starting")
    children["a"].intent = "start"
    leaf = StartFailed(("top", "a", "leaf"), "no power")
    shut_down, _ = failed_start(children, "a", Failed(leaf))
    assert shut_down.failure is leaf


def test_a_start_phase_that_returns_has_failed_too() -> None:
    children = books(group("a"), phase="starting")
    children["a"].intent = "start"
    shut_down, _ = failed_start(children, "a", Returned())
    assert "a did not start: it returned before it had started" in str(shut_down.failure)


def test_a_restart_that_fails_is_tried_again_and_counts() -> None:
    children = books(group("a", intensity=Intensity(1)))
    children["a"].intent = "restart"
    assert failed_start(children, "a") == (Restart("a", 0.0, None),)
    children.window.times.append(0.0)
    children["a"].intent = "restart"
    assert isinstance(failed_start(children, "a")[1], ShutDown)


@pytest.mark.parametrize(
    ("fresh", "restart", "left"),
    [
        (False, permanent, [Gone("a", kept=True)]),
        (False, temporary, [Forget("a"), Gone("a", kept=True)]),
        (True, permanent, [Forget("a"), Gone("a", kept=True)]),
    ],
)
def test_a_start_that_a_caller_waits_for_fails_for_the_caller(
    fresh: bool, restart: RestartType, left: list[Act]
) -> None:
    children = books(Supervisor("top", children=[child("a", restart=restart)]))
    entry: Any = children["a"]
    entry.intent, entry.fresh, entry.answer = "start", fresh, object()
    drop, *others = failed_start(children, "a")
    assert isinstance(drop.error, StartFailed)
    assert drop == Drop("a", drop.error, park=True)
    assert others == left


@pytest.mark.parametrize(("restart", "kept"), [(permanent, []), (temporary, [Forget("a")])])
def test_one_that_declines_to_start_stays_known(restart: RestartType, kept: list[Act]) -> None:
    children = books(Supervisor("top", children=[child("a", restart=restart)]))
    children["a"].intent = "start"
    answer = decide(end(children, "a", Stopped("declined"), ready=False, declined=True), children)
    assert list(answer) == [Drop("a"), *kept, Gone("a", kept=True)]


# ---------------------------------------------------------------------- ends that were asked for


def test_an_end_that_was_asked_for() -> None:
    children = books(group("a", "b"))
    assert decide(end(children, "a", Stopped(), asked="shutdown"), children) == (Gone("a", kept=True),)
    children["b"].intent = "start"
    assert decide(end(children, "b", Stopped(), asked="replaced"), children) == (Start("b"),)
    children["b"].queued = True
    assert decide(end(children, "b", Stopped(), asked="shutdown"), children) == ()


@pytest.mark.parametrize(
    ("stop", "reason", "unclean"),
    [(5.0, Stopped(), False), (5.0, Killed(5.0), True), ("kill", Killed(0.0), False), ("kill", Leaked(1.0), True)],
)
def test_an_unclean_end_is_reported(stop: Any, reason: ExitReason, unclean: bool) -> None:
    children = books(Supervisor("top", children=[child("a", stop=stop)]))
    children["a"].marked = True
    event = end(children, "a", reason)
    told = [Tell("shutdown_error", event.life, reason)] if unclean else []
    assert list(decide(event, children)) == [*told, Gone("a", kept=True)]


# ---------------------------------------------------------------------- significant children


@pytest.mark.parametrize(
    ("auto_shutdown", "other", "closes"),
    [
        (any_significant, "runs", True),
        (all_significant, "runs", False),
        (all_significant, "due", False),
        (all_significant, "ended", True),
    ],
)
def test_significant_children(auto_shutdown: AutoShutdown, other: str, closes: bool) -> None:
    spec = Supervisor(
        "top",
        auto_shutdown=auto_shutdown,
        children=[*(child(name, restart=transient, significant=True) for name in "ab"), child("c")],
    )
    children = books(spec)
    if other != "runs":
        children["b"].now = None
    if other == "due":
        children["b"].intent = "restart"
    event = end(children, "a", Returned())
    note = f"auto_shutdown={auto_shutdown}"
    closing = [Tell("shutdown", event.life, Returned(), note), ShutDown("shutdown"), StopNext()]
    assert list(decide(event, children)) == (closing if closes else [Gone("a", kept=True)])


def test_significance_is_nothing_to_a_supervisor_that_was_told_to_ignore_it() -> None:
    children = books(Supervisor("top", auto_shutdown=any_significant, children=[significant("a")]))
    children.spec = children.spec.replace(auto_shutdown=never, children=[])
    assert list(decide(end(children, "a", Returned()), children)) == [Gone("a", kept=True)]


def significant(name: str) -> Child:
    return child(name, restart=transient, significant=True)


def test_a_significant_child_that_ends_while_others_start_is_obeyed_when_all_are_ready() -> None:
    children = books(Supervisor("top", auto_shutdown=any_significant, children=[significant("a")]), phase="starting")
    event = end(children, "a", Returned())
    assert list(decide(event, children)) == [CloseWhenReady(event), Gone("a", kept=True)]
    children.phase = "running"
    assert decide(AllReady(), children) == ()
    children.closing = event
    told = Tell("shutdown", event.life, Returned(), "auto_shutdown=any_significant")
    assert decide(AllReady(), children) == (told, ShutDown("shutdown"), StopNext())


# ---------------------------------------------------------------------- the end of the supervisor


def test_instances_of_a_template_stop_together_and_children_one_by_one() -> None:
    assert decide(StopAsked("off"), books(group("a", "b"))) == (ShutDown("off"), StopNext())
    pool = books(DynamicSupervisor("top", child("a")), instances=3)
    pool["a_2"].now = None
    stops = (Stop("a_3", "off"), Stop("a_1", "off"))
    assert decide(StopAsked("off"), pool) == (ShutDown("off"), *stops, StopNext())


@pytest.mark.parametrize("phase", ["stopping", "over"])
def test_it_ends_once(phase: Phase) -> None:
    assert decide(StopAsked("off"), books(group("a"), phase=phase)) == ()


def test_a_kill_ends_all_at_once_also_in_the_middle_of_an_orderly_end() -> None:
    kills = (Kill("b"), Kill("a"), StopNext())
    assert decide(KillAsked(), books(group("a", "b"))) == (ShutDown("killed"), *kills)
    assert decide(KillAsked(), books(group("a", "b"), phase="stopping")) == kills


@pytest.mark.parametrize(
    ("facts", "reason", "told"),
    [
        ({"asked": "off"}, Stopped(), None),
        ({"asked": "off"}, Killed(5.0), "shutdown_error"),
        ({}, Returned(), "shutdown_error"),
        ({}, BROKEN, "shutdown_error"),
        ({}, Stopped(), None),
        ({"ready": False}, BROKEN, "start_error"),
        ({"ready": False, "declined": True}, Stopped(), None),
        ({"ready": False, "asked": "off"}, Stopped(), None),
        ({"killed": 0.0}, Killed(0.0), "shutdown_error"),
    ],
)
def test_ends_while_the_supervisor_stops(facts: dict[str, Any], reason: ExitReason, told: Any) -> None:
    children = books(group("a", "b"), phase="stopping")
    event = end(children, "b", reason, **facts)
    reports = [Tell(told, event.life, reason)] if told else []
    assert list(decide(event, children)) == [*reports, StopNext()]


def test_instances_of_a_template_are_gone_also_when_all_end() -> None:
    pool = books(DynamicSupervisor("top", child("a"), intensity=Intensity(0)), instances=2)
    answer = decide(end(pool, "a_1", BROKEN), pool)
    assert answer[-1] == Gone("a_1", kept=False)
    assert only((ShutDown, Stop), answer)[1:] == [Stop("a_2", "shutdown")]
    pool.phase = "stopping"
    assert decide(end(pool, "a_2", Stopped(), asked="off"), pool) == (StopNext(), Gone("a_2", kept=False))


def test_a_significant_instance_is_forgotten_before_all_end() -> None:
    template = child("a", restart=temporary, significant=True)
    pool = books(DynamicSupervisor("top", template, auto_shutdown=any_significant), instances=2)
    event = end(pool, "a_1", Returned())
    forget, told, *stops, gone = decide(event, pool)
    assert (forget, gone) == (Forget("a_1"), Gone("a_1", kept=False))
    assert isinstance(told, Tell)
    assert stops == [ShutDown("shutdown"), Stop("a_2", "shutdown"), StopNext()]


# ---------------------------------------------------------------------- requests


def stopped(children: Children, name: str) -> Children:
    children[name].now = None
    return children


def restarting(children: Children, name: str) -> Children:
    children[name].now, children[name].intent = None, "restart"
    return children


def held(children: Children, name: str) -> Children:
    restarting(children, name).steps.holder = children[name]
    return children


def starting_again(children: Children, name: str) -> Children:
    children[name].now, children[name].intent = life(name, ready=False), "restart"
    return children


def stopping(children: Children, name: str) -> Children:
    children[name].now = life(name, asked="terminated")
    return children


GROUP = group("a", "b")
POOL = DynamicSupervisor("top", child("a"), max_children=2)
OLD, LIVE = ChildRef(("top", "a"), 9), life("a").ref
NEW = child("new")


def other() -> None:
    """Another factory."""


RENEWED = child("a").replace(factory=other)


@pytest.mark.parametrize(
    ("children", "request_", "expected"),
    [
        (books(GROUP), StartChild(NEW), [Add(NEW)]),
        (books(POOL, instances=1), Spawn((), None, None),
         [Add(child("a_2"), ((), None), 2)]),
        (books(POOL), Spawn((7,), "extra", {"rate": 1}),
         [Add(Child(node, name="extra", args=(7,), parameters={"rate": 1}), ((7,), {"rate": 1}))]),
        (books(GROUP), TerminateChild("a"), [Terminate("a")]),
        (books(GROUP), TerminateChild(LIVE), [Terminate("a")]),
        (books(GROUP), TerminateChild(OLD), [Answer()]),
        (books(GROUP), TerminateChild(ChildRef(("top", "z"), 1)), [Answer()]),
        (stopped(books(GROUP), "a"), TerminateChild("a"), [Drop("a", park=True), Gone("a", kept=True), Answer()]),
        (held(books(GROUP), "a"), TerminateChild("a"),
         [Drop("a", park=True), Gone("a", kept=True), Answer(), EndHold()]),
        (restarting(books(POOL, instances=1), "a_1"), TerminateChild("a_1"),
         [Drop("a_1", park=True), Forget("a_1"), Gone("a_1", kept=False), Answer()]),
        (stopped(books(GROUP), "a"), RestartChild("a"), [Due("a"), Start("a")]),
        (stopped(books(GROUP), "a"), DeleteChild("a"), [Forget("a"), Answer()]),
        (books(GROUP), ReplaceFactory("a", other), [Update("a", RENEWED), Due("a"), Stop("a", "replaced")]),
        (stopped(books(GROUP), "a"), ReplaceFactory("a", other), [Update("a", RENEWED), Answer()]),
        (stopping(books(GROUP), "a"), ReplaceFactory("a", other), [Update("a", RENEWED), Answer()]),
        (starting_again(books(GROUP), "a"), ReplaceFactory("a", other),
         [Update("a", RENEWED), Answer(), Stop("a", "replaced")]),
        (books(GROUP), Reconfigure(group("b")), [Adopt(group("b")), Answer()]),
    ],
)  # fmt: skip
def test_requests(children: Children, request_: Request, expected: list[Act]) -> None:
    assert list(decide(request_, children)) == expected


@pytest.mark.parametrize(
    ("children", "request_", "refusal", "said"),
    [
        (books(POOL), StartChild(NEW), DeclarationError, "use spawn(), not start_child()"),
        (books(GROUP), Spawn((), None, None), DeclarationError, "use start_child(), not spawn()"),
        (books(POOL, instances=2), Spawn((), None, None), TooManyChildren, "top has 2 children"),
        (books(POOL, instances=1), Spawn((), "a_1", None), AlreadyStarted, "already runs a_1"),
        (books(GROUP), StartChild(child("a")), AlreadyStarted, "already runs a"),
        (stopped(books(GROUP), "a"), StartChild(child("a")), AlreadyPresent, "it is stopped"),
        (starting_again(books(GROUP), "a"), StartChild(child("a")), AlreadyPresent, "it is restarting"),
        (books(GROUP), TerminateChild("z"), NotFound, "top has no child 'z'; it has: a, b"),
        (books(GROUP), TerminateChild(ChildRef(("else", "a"), 1)), NotFound, "ask its own supervisor"),
        (books(POOL), TerminateChild("a"), NotFound, "'a' names the template"),
        (books(GROUP), RestartChild("a"), Running, "a is running"),
        (restarting(books(GROUP), "a"), RestartChild("a"), Restarting, "a is restarting"),
        (books(GROUP), DeleteChild("a"), Running, "a is running"),
        (restarting(books(GROUP), "a"), DeleteChild("a"), Restarting, "a is restarting"),
        (books(Supervisor("top", children=[group("x").replace(name="sub")])), ReplaceFactory("sub", other),
         DeclarationError, "sub is a supervisor"),
        (books(GROUP), Reconfigure(POOL), DeclarationError, "cannot become"),
        (books(GROUP), Reconfigure(GROUP.replace(name="else")), DeclarationError, "cannot become"),
        (books(GROUP, phase="stopping"), StartChild(NEW), SupervisorDown, "it is stopping"),
        (books(GROUP, phase="over"), RestartChild("a"), SupervisorDown, "it is over"),
    ],
)  # fmt: skip
def test_refusals(children: Children, request_: Request, refusal: type[Exception], said: str) -> None:
    with pytest.raises(refusal) as caught:
        decide(request_, children)
    assert said in str(caught.value)


def test_who_waits_for_a_start_hears_that_it_was_terminated() -> None:
    children = books(GROUP)
    entry: Any = children["a"]
    entry.intent, entry.answer = "start", object()
    terminate = decide(TerminateChild("a"), children)[0]
    assert isinstance(terminate, Terminate)
    assert str(terminate.error).startswith("a did not start: ")
    assert "top/a" in str(terminate.error)


def test_the_number_of_an_instance_is_used_once() -> None:
    children = books(DynamicSupervisor("top", child("a")))
    children.numbered = 4
    add = decide(Spawn((), None, None), children)[0]
    assert isinstance(add, Add)
    assert (add.spec.name, add.numbered) == ("a_5", 5)


@pytest.mark.parametrize(
    ("known", "declared", "expected"),
    [
        ("", "ab", "ab"),
        ("ab", "", "ab"),
        ("abc", "cba", "cba"),
        ("axb", "ba", "bax"),
        ("xab", "ba", "xba"),
        ("axyb", "nba", "nbaxy"),
    ],
)
def test_order_of_another_declaration(known: str, declared: str, expected: str) -> None:
    assert "".join(merged(known, declared)) == expected
