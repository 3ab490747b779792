"""Laws of `decide`, for any books and any event."""

from __future__ import annotations

from typing import Any

from hypothesis import assume, given
from hypothesis import strategies as st

from actors.errors import DeclarationError
from actors.supervision.acts import (
    Act,
    Add,
    Adopt,
    Answer,
    CloseWhenReady,
    Due,
    EndHold,
    Gone,
    Restart,
    RestartGroup,
    ShutDown,
    Start,
    Stop,
    StopNext,
    Tell,
    Terminate,
)
from actors.supervision.children import Children, merged
from actors.supervision.decide import decide
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import SupervisionError
from actors.supervision.events import (
    AllReady,
    DeleteChild,
    Ended,
    KillAsked,
    Ready,
    Reconfigure,
    ReplaceFactory,
    RestartChild,
    Spawn,
    StartChild,
    StopAsked,
    TerminateChild,
)
from actors.supervision.policy import (
    Backoff,
    Intensity,
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
from actors.supervision.reasons import Failed, Killed, Leaked, Returned, Stopped, is_abnormal
from actors.supervision.refs import ChildRef
from tests.actors.supervision.bookkeeping import books, end, life
from tests.actors.supervision.kit import child, node

NAMES = ["a", "b", "c", "d", "e"]
BROKEN = Failed(OSError("broken"))
reasons = st.sampled_from([Returned(), Stopped(), BROKEN, Killed(None), Leaked(1.0)])
strategies = st.sampled_from([one_for_one, one_for_all, rest_for_one])
intensities = st.builds(Intensity, st.integers(0, 3), st.sampled_from([0.5, 5.0]))
closings = st.sampled_from([never, any_significant, all_significant])


@st.composite
def groups(draw: st.DrawFn) -> Supervisor:
    closing = draw(closings)
    children = []
    for name in NAMES[: draw(st.integers(1, 5))]:
        restart = draw(st.sampled_from([permanent, transient, temporary]))
        significant = closing != never and restart != permanent and draw(st.booleans())
        backoff = draw(st.sampled_from([None, Backoff(1.0, 8.0)]))
        children.append(child(name, restart=restart, significant=significant, backoff=backoff))
    return Supervisor(
        "top", children=children, strategy=draw(strategies), intensity=draw(intensities), auto_shutdown=closing
    )


@st.composite
def pools(draw: st.DrawFn) -> DynamicSupervisor:
    restart = draw(st.sampled_from([permanent, transient, temporary]))
    limit = draw(st.sampled_from([None, 0, 3, 9]))
    return DynamicSupervisor("top", child("a", restart=restart), intensity=draw(intensities), max_children=limit)


@st.composite
def any_books(draw: st.DrawFn, specs: st.SearchStrategy[Any] | None = None) -> Children:
    """Books in which each child is in some state, also such as hardly ever meet."""
    spec = draw(specs if specs is not None else st.one_of(groups(), pools()))
    children = books(spec, phase=draw(st.sampled_from(["starting", "running", "stopping"])), instances=3)
    for entry in children:
        name: Any = entry.spec.name
        state = draw(st.sampled_from(["running", "starting", "asked", "stopped", "parked", "due", "marked"]))
        open_ = children.phase != "stopping"
        if state == "starting":
            entry.now = life(name, ready=False)
            entry.intent = draw(st.sampled_from(["start", "restart"])) if open_ else ""
        elif state == "asked":
            entry.now = life(name, asked="shutdown", ready=draw(st.booleans()))
        elif state != "running" and state != "marked":
            entry.now, entry.parked = None, state == "parked"
            entry.intent = "restart" if state == "due" and open_ else ""
        entry.marked = state == "marked" and open_
        entry.attempts = draw(st.integers(0, 3))
        entry.ready_at = draw(st.sampled_from([None, 0.0, 9.0]))
        if entry.intent == "start" and draw(st.booleans()):
            entry.answer, entry.fresh = draw(st.just(object())), draw(st.booleans())  # type: ignore[assignment]
    children.window.times.extend(sorted(draw(st.lists(st.floats(0.0, 10.0), max_size=4))))
    return children


def ends(draw: st.DrawFn, children: Children) -> Ended | None:
    alive = [entry.spec.name for entry in children if entry.now is not None]
    if not alive:
        return None
    name = draw(st.sampled_from(alive))
    now = children[name].now
    assert now is not None
    facts = {"ready": now.ready, "asked": now.asked, "declined": not now.ready and draw(st.booleans())}
    return end(children, name, draw(reasons), at=10.0, **facts)


@st.composite
def cases(draw: st.DrawFn) -> tuple[Any, Children]:
    """An event, and the books after it."""
    children = draw(any_books())
    names = st.sampled_from([*children.entries, "a", "z"])
    name = draw(names)
    kind = draw(st.integers(0, 12))
    if kind < 3 and (ended := ends(draw, children)) is not None:
        return ended, children
    events: list[Any] = [
        Ready(life(name, ready=draw(st.booleans()), over=draw(st.booleans()))),
        AllReady(),
        StopAsked("off"),
        KillAsked(),
        StartChild(child(name)),
        Spawn((), draw(st.sampled_from([None, name])), None),
        TerminateChild(draw(st.sampled_from([name, ChildRef(("top", name), 1), ChildRef(("top", name), 2)]))),
        RestartChild(name),
        DeleteChild(name),
        ReplaceFactory(name, node),
        Reconfigure(draw(st.one_of(groups(), pools()))),
    ]
    return draw(st.sampled_from(events)), children


def answer(event: Any, children: Children) -> list[Act] | str:
    try:
        return list(decide(event, children))
    except (SupervisionError, DeclarationError) as refusal:
        return f"{type(refusal).__name__}: {refusal}"


def pages(children: Children) -> list[Any]:
    """All that stands in the books."""
    entries = [[getattr(entry, slot) for slot in entry.__slots__] + [repr(entry.now)] for entry in children]
    steps, window = children.steps, children.window
    fields = [getattr(children, slot) for slot in children.__slots__]
    return [entries, fields, list(children.entries), [*steps.stops, *steps.starts], steps.current, list(window.times)]


def said(acts: list[Act] | str) -> str:
    """An answer as text, in which errors are equal that say the same."""
    return repr(acts)


@given(cases())
def test_it_changes_nothing_and_says_the_same_again(case: tuple[Any, Children]) -> None:
    event, children = case
    before = pages(children)
    first = answer(event, children)
    assert pages(children) == before
    assert said(answer(event, children)) == said(first)


@given(cases())
def test_no_act_is_for_an_unknown_child(case: tuple[Any, Children]) -> None:
    event, children = case
    known = set(children.entries)
    found = answer(event, children)
    for act in found if isinstance(found, list) else []:
        if isinstance(act, Add):
            known.add(act.spec.name)
        name = getattr(act, "child", None)
        stale = isinstance(event, Ready) and (event.life.over or event.life.ready)
        assert name is None or name in known or (isinstance(event, Ready) and not stale)
        assert not isinstance(act, RestartGroup) or known.issuperset({*act.stops, *act.due})


@given(cases())
def test_a_request_is_refused_or_answered_once(case: tuple[Any, Children]) -> None:
    event, children = case
    found = answer(event, children)
    if isinstance(event, (Ended, Ready, AllReady, StopAsked, KillAsked)):
        assert isinstance(found, list), "only requests are refused"
        assert not any(isinstance(act, (Answer, Terminate, Due, Add)) for act in found)
    elif children.phase == "stopping":
        assert isinstance(found, str)
        assert found.startswith("SupervisorDown")
    elif isinstance(found, list):
        assert sum(isinstance(act, (Answer, Terminate, Due, Add)) for act in found) == 1


@given(cases())
def test_nothing_begins_once_the_supervisor_stops(case: tuple[Any, Children]) -> None:
    event, children = case
    found = answer(event, children)
    acts = found if isinstance(found, list) else []
    begins = (Start, Restart, RestartGroup, Add, Due, Adopt, EndHold, CloseWhenReady)
    places = [place for place, act in enumerate(acts) if isinstance(act, ShutDown)]
    after = acts if children.phase == "stopping" else acts[places[0] :] if places else []
    assert not any(isinstance(act, begins) for act in after)
    assert len(places) <= 1
    assert not places or any(isinstance(act, StopNext) for act in after), "its end goes on until nobody is left"


def failing(children: Children, name: str) -> Ended:
    return end(children, name, BROKEN, at=10.0)


@given(any_books(groups()), st.data())
def test_a_group_is_stopped_from_its_end_exactly_those_that_the_strategy_names(
    children: Children, data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(list(children.entries)))
    children.phase = "running"
    children.window.times.clear()
    children.spec = children.spec.replace(intensity=Intensity(1))
    failed = children[name]
    failed.spec = failed.spec.replace(restart=permanent, significant=False)
    failed.now, failed.intent, failed.marked = life(name), "", False
    names = list(children.entries)
    place = names.index(name)
    concerned = {one_for_one: [], one_for_all: names, rest_for_one: names[place + 1 :]}[children.spec.strategy]
    can_stop = [
        each for each in concerned if each != name and (now := children[each].now) is not None and now.asked is None
    ]
    last = decide(failing(children, name), children)[-1]
    assert isinstance(last, (Restart, RestartGroup))
    assert isinstance(last, Restart) is (children.spec.strategy == one_for_one)
    if isinstance(last, RestartGroup):
        assert list(last.stops) == can_stop[::-1]
        assert set(last.due) <= set(concerned) - {name}
        assert list(last.due) == sorted(last.due, key=names.index)
        assert not any(children[each].parked for each in last.due)
        assert not any(children[each].spec.restart == temporary for each in last.due if each in can_stop)


@given(any_books(), st.data())
def test_restart_types(children: Children, data: st.DataObject) -> None:
    event = ends(data.draw, children)
    assume(event is not None and children.phase != "stopping")
    assert event is not None
    entry = children[event.life.ref.id]
    assume(event.life.ready and event.life.asked is None and not entry.marked)
    found = decide(event, children)
    again = any(isinstance(act, (Restart, RestartGroup)) for act in found)
    gave_up = any(isinstance(act, ShutDown) and act.failure is not None for act in found)
    abnormal = is_abnormal(event.reason)
    wanted = entry.spec.restart == permanent or (entry.spec.restart == transient and abnormal)
    assert (again or gave_up) is wanted
    assert any(isinstance(act, Tell) and act.context == "child_terminated" for act in found) is (
        abnormal or entry.spec.restart == permanent
    )


@given(intensities, strategies, st.lists(st.integers(0, 20), max_size=20))
def test_the_law_of_intensity(intensity: Intensity, strategy: Any, gaps: list[int]) -> None:
    """It gives up at the first restart that makes more of them than allowed in any period, and at no other."""
    children = books(Supervisor("top", children=[child("a")], intensity=intensity, strategy=strategy))
    times, now = list[float](), 0.0
    for gap in gaps:
        now += gap / 10
        times.append(now)
        recent = sum(round(now - time, 9) <= intensity.within for time in times)
        found = decide(end(children, "a", BROKEN, at=now), children)
        gives_up = any(isinstance(act, ShutDown) for act in found)
        assert gives_up is (recent > intensity.restarts)
        if gives_up:
            return
        children.restart(children["a"], now, None)
        children["a"].now, children["a"].intent = life("a"), ""


@given(any_books(pools()))
def test_a_pool_that_is_shut_down_stops_all_that_live_at_once(children: Children) -> None:
    assume(children.phase != "stopping")
    alive = [each.spec.name for each in children if each.now is not None]
    assert list(decide(StopAsked("off"), children)) == [
        ShutDown("off"),
        *(Stop(name, "off") for name in reversed(alive)),
        StopNext(),
    ]


@given(any_books(pools()), st.data())
def test_what_ends_for_good_in_a_pool_is_not_kept(children: Children, data: st.DataObject) -> None:
    event = ends(data.draw, children)
    assume(event is not None)
    assert event is not None
    assert not any(isinstance(act, Gone) and act.kept for act in decide(event, children))


@given(st.lists(st.sampled_from("abcdef"), unique=True), st.lists(st.sampled_from("abcxyz"), unique=True))
def test_the_order_of_another_declaration(known: list[str], declared: list[str]) -> None:
    order = merged(known, declared)
    assert sorted(order) == sorted({*known, *declared})
    assert [name for name in order if name in declared] == declared
    for name in set(known) - set(declared):
        before = [each for each in known[: known.index(name)] if each in declared]
        place = [each for each in order[: order.index(name)] if each in declared]
        assert place[-1:] == before[-1:]
