"""Statements about the supervisor, by their numbers in the conformance vectors, with real processes that crash, hang and are killed."""

from __future__ import annotations

import asyncio
import math
import os
import signal
from typing import Any

import pytest

from actors import (
    Backoff,
    Child,
    DynamicSupervisor,
    Intensity,
    StartFailed,
    Supervisor,
    SupervisorGaveUp,
    System,
    one_for_all,
    permanent,
    rest_for_one,
    temporary,
    transient,
)
from actors.errors import ProcessDied
from actors.supervision import Failed, Killed, all_significant, any_significant
from tests.actors.processes.kit import Diary, Scripted, alive, in_order, running, until

pytestmark = pytest.mark.realtime


def kill(diary: Diary, name: str) -> None:
    os.kill(diary.processes(name)[-1], signal.SIGKILL)


async def killed_and_back(diary: Diary, name: str, lives: int = 2) -> None:
    """Kill a process, and wait until that life of the node is ready."""
    kill(diary, name)
    await until(lambda: diary.lines("ready").count(f"ready {name}") == lives, f"life {lives} of {name} is ready")


def reports(system: System) -> list[str]:
    return [f"{each.context} {each.child.id}" for each in system.reports if each.context != "progress"]


async def gave_up(system: System) -> None:
    """Wait until the tree has given up."""
    with pytest.raises(SupervisorGaveUp):
        await system.wait()


async def test_children_start_in_order_each_after_the_one_before_is_ready(diary: Diary) -> None:
    children = in_order(diary, "a", "b", "c", a={"start": 0.2})
    async with running(Supervisor("top", children=children)):
        assert diary.lines() == ["start a", "ready a", "start b", "ready b", "start c", "ready c"]
        assert len({diary.processes(name)[0] for name in "abc"} | {os.getpid()}) == 4


async def test_a_failed_start_is_rolled_back(diary: Diary) -> None:
    tree = Supervisor("top", children=in_order(diary, "a", "b", "c", b={"refuse": 9}))
    with pytest.raises(StartFailed, match="b refuses") as caught:
        async with running(tree):
            pass
    assert caught.value.child == "b"
    assert isinstance(caught.value.__cause__, OSError)
    assert "Scripted" in "".join(caught.value.__cause__.__notes__) or "on_start" in "".join(
        caught.value.__cause__.__notes__
    )
    assert diary.lines() == ["start a", "ready a", "start b", "stop b", "end b", "stop a", "end a"]


async def test_a_child_may_decline_to_start(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a", "b", a={"skip": True}))) as system:
        assert system.supervisor is not None
        assert [(each.id, each.state) for each in system.supervisor.children()] == [("a", "stopped"), ("b", "running")]
        assert reports(system) == []


async def test_a_failed_start_child_is_forgotten(diary: Diary) -> None:
    (broken,) = in_order(diary, "b", b={"refuse": 9})
    async with running(Supervisor("top", children=in_order(diary, "a"))) as system:
        assert system.supervisor is not None
        with pytest.raises(StartFailed, match="b refuses"):
            await system.supervisor.start_child(broken)
        assert [each.id for each in system.supervisor.children()] == ["a"]


async def test_a_terminated_child_can_be_started_again_in_a_new_process(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a"))) as system:
        assert system.supervisor is not None
        await system.supervisor.terminate_child("a")
        assert not alive(diary.processes("a")[0])
        assert diary.lines("stop", "end") == ["stop a", "end a"]
        await system.supervisor.restart_child("a")
        assert alive(diary.processes("a")[1])
        assert reports(system) == []


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
async def test_a_permanent_child_is_restarted_when_its_process_is_killed(diary: Diary, number: signal.Signals) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a"))) as system:
        os.kill(diary.processes("a")[0], number)
        await until(lambda: diary.lines("ready") == ["ready a", "ready a"])
        await until(lambda: system.nodes["top", "a"].state == "running")
        assert reports(system) == ["child_terminated a"]
        reason = system.reports[1].reason
        assert isinstance(reason, Failed) and isinstance(reason.error, ProcessDied)
        assert number.name in str(reason.error)
        assert system.nodes["top", "a"].incarnation == 2


async def test_a_permanent_child_is_restarted_when_it_stops_by_itself(diary: Diary) -> None:
    plan = {"after": 0.1, "stops": True, "lives": 1}
    async with running(Supervisor("top", children=in_order(diary, "a", a=plan))) as system:
        await until(lambda: diary.lines("ready") == ["ready a", "ready a"])
        assert reports(system) == ["child_terminated a"]


async def test_a_transient_child_is_restarted_after_a_kill_and_not_after_an_orderly_end(diary: Diary) -> None:
    plans: dict[str, Any] = {"a": {}, "b": {"after": 0.1, "stops": True}}
    transients: dict[str, Any] = {name: {"restart": transient} for name in "ab"}
    async with running(Supervisor("top", children=in_order(diary, "a", "b", options=transients, **plans))) as system:
        await killed_and_back(diary, "a")
        await until(lambda: system.nodes["top", "b"].state == "stopped")
        assert diary.lines("start").count("start b") == 1
        assert reports(system) == ["child_terminated a"]


async def test_a_temporary_child_is_not_restarted_and_is_forgotten(diary: Diary) -> None:
    children = in_order(diary, "a", "b", options={"a": {"restart": temporary}})
    async with running(Supervisor("top", children=children)) as system:
        kill(diary, "a")
        supervisor = system.supervisor
        assert supervisor is not None
        await until(lambda: [each.id for each in supervisor.children()] == ["b"])
        assert system.nodes["top", "a"].state == "stopped"
        assert diary.lines("start") == ["start a", "start b"]


async def test_a_temporary_bystander_of_a_group_restart_is_stopped_and_not_started(diary: Diary) -> None:
    children = in_order(diary, "a", "b", options={"b": {"restart": temporary}})
    async with running(Supervisor("top", strategy=one_for_all, children=children)) as system:
        await killed_and_back(diary, "a")
        assert diary.lines("start") == ["start a", "start b", "start a"]
        assert system.supervisor is not None
        assert [each.id for each in system.supervisor.children()] == ["a"]


async def test_one_for_one_restarts_the_killed_process_only(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a", "b", "c"))):
        await killed_and_back(diary, "b")
        assert diary.lines("start", "stop") == ["start a", "start b", "start c", "start b"]


async def test_one_for_all_stops_the_others_in_reverse_order_and_starts_all_in_order(diary: Diary) -> None:
    async with running(Supervisor("top", strategy=one_for_all, children=in_order(diary, "a", "b", "c"))):
        await killed_and_back(diary, "b")
        await until(lambda: diary.lines("ready").count("ready c") == 2)
        assert diary.lines("start", "stop")[3:] == ["stop c", "stop a", "start a", "start b", "start c"]


async def test_rest_for_one_restarts_those_after_the_killed_process(diary: Diary) -> None:
    async with running(Supervisor("top", strategy=rest_for_one, children=in_order(diary, "a", "b", "c"))):
        await killed_and_back(diary, "b")
        await until(lambda: diary.lines("ready").count("ready c") == 2)
        assert diary.lines("start", "stop")[3:] == ["stop c", "start b", "start c"]
        assert len(diary.processes("a")) == 1


async def test_instances_in_processes_are_restarted_with_their_own_arguments(diary: Diary) -> None:
    template = Child(Scripted, process=True)
    async with running(DynamicSupervisor("top", template)) as system:
        assert system.supervisor is not None
        await system.supervisor.spawn(str(diary.path), {}, name="one")
        await system.supervisor.spawn(str(diary.path), {"cleanup": 0.01}, name="two")
        await killed_and_back(diary, "two")
        assert diary.lines("start") == ["start one", "start two", "start two"]


async def test_a_failure_climbs_the_tree(diary: Diary) -> None:
    inner = Supervisor("inner", intensity=Intensity(0), children=in_order(diary, "b", "c"))
    async with running(Supervisor("top", children=[*in_order(diary, "a"), inner])) as system:
        await killed_and_back(diary, "b")
        await until(lambda: diary.lines("ready").count("ready c") == 2)
        assert len(diary.processes("a")) == 1
        assert reports(system) == ["child_terminated b", "shutdown b", "child_terminated inner"]


async def test_a_subtree_with_a_process_of_its_own_that_gives_up_is_restarted_in_a_new_process(
    diary: Diary,
) -> None:
    nodes = [child.replace(process=False) for child in in_order(diary, "b", "c", b={"after": 0.2, "lives": 1})]
    inner = Supervisor("inner", process=True, intensity=Intensity(0), children=nodes)
    async with running(Supervisor("top", children=[*in_order(diary, "a"), inner])) as system:
        await until(lambda: diary.lines("ready").count("ready c") == 2)
        assert len({*diary.processes("b"), *diary.processes("c")}) == 2
        assert reports(system) == ["child_terminated b", "shutdown b", "child_terminated inner"]
        reason = next(each.reason for each in system.reports if each.child.id == "inner" and each.reason)
        assert isinstance(getattr(reason, "cause", None), SupervisorGaveUp)
        await until(lambda: system.nodes["top", "inner", "c"].state == "running")


async def test_a_process_that_is_killed_once_too_often_ends_its_supervisor(diary: Diary) -> None:
    tree = Supervisor("top", intensity=Intensity(2, within=60.0), children=in_order(diary, "a", "b"))
    with pytest.raises(SupervisorGaveUp, match="signal SIGKILL"):
        async with running(tree) as system:
            await killed_and_back(diary, "b", 2)
            await killed_and_back(diary, "b", 3)
            kill(diary, "b")
            await system.wait()
    assert diary.lines("stop", "end") == ["stop a", "end a"]


async def test_zero_tolerance(diary: Diary) -> None:
    with pytest.raises(SupervisorGaveUp):
        async with running(Supervisor("top", intensity=Intensity(0), children=in_order(diary, "a"))) as system:
            kill(diary, "a")
            await system.wait()
    assert diary.lines("start") == ["start a"]


async def test_attempts_that_fail_count_and_are_repeated_until_one_holds(diary: Diary) -> None:
    tree = Supervisor("top", intensity=Intensity(3, within=60.0), children=in_order(diary, "a"))
    async with running(tree) as system:
        refusing = Child(Scripted, name="b", args=(str(diary.path), {"after": 0.05, "lives": 3}), process=True)
        assert system.supervisor is not None
        await system.supervisor.start_child(refusing)
        await until(lambda: diary.lines("ready").count("ready b") == 4)
        assert reports(system) == ["child_terminated b"] * 3
        kill(diary, "b")
        await gave_up(system)


async def test_rest_for_one_is_retried_with_its_group(diary: Diary) -> None:
    tree = Supervisor(
        "top",
        strategy=rest_for_one,
        intensity=Intensity(9, within=60.0),
        children=in_order(diary, "a", "b", "c", b={"after": 0.3, "lives": 2}),
    )
    async with running(tree):
        await until(lambda: diary.lines("ready").count("ready b") == 3 and diary.lines("ready")[-1] == "ready c")
        assert len(diary.processes("a")) == 1
        starts = "".join(line[-1] for line in diary.lines("start"))
        assert set(starts[1:].split("b")) <= {
            "",
            "c",
        }  # each attempt of b is followed by one of c, or by the next one of b


async def test_a_supervisor_answers_while_a_process_waits_for_its_next_attempt(diary: Diary) -> None:
    options: dict[str, Any] = {"a": {"backoff": Backoff(60.0, 60.0)}}
    async with running(Supervisor("top", children=in_order(diary, "a", options=options))) as system:
        kill(diary, "a")
        await until(lambda: system.nodes["top", "a"].state == "restarting")
        assert system.supervisor is not None
        (more,) = in_order(diary, "b")
        await system.supervisor.start_child(more)
        assert diary.lines("ready") == ["ready a", "ready b"]


async def test_a_retry_can_be_cancelled(diary: Diary) -> None:
    options: dict[str, Any] = {"a": {"backoff": Backoff(60.0, 60.0)}}
    async with running(Supervisor("top", children=in_order(diary, "a", options=options))) as system:
        kill(diary, "a")
        await until(lambda: system.nodes["top", "a"].state == "restarting")
        assert system.supervisor is not None
        await system.supervisor.terminate_child("a")
        assert system.nodes["top", "a"].state == "stopped"
        assert len(diary.processes("a")) == 1


async def test_processes_stop_in_reverse_order_one_at_a_time(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a", "b", "c", c={"cleanup": 0.2}))):
        pass
    assert diary.lines("stop", "end") == ["stop c", "end c", "stop b", "end b", "stop a", "end a"]


async def test_a_process_that_cleans_up_for_too_long_is_terminated_and_the_others_stop_in_order(
    diary: Diary,
) -> None:
    children = in_order(diary, "a", "b", b={"cleanup": 1000}, options={"b": {"stop": 0.2}})
    async with running(Supervisor("top", children=children)) as system:
        pass
    assert diary.lines("stop", "end") == ["stop b", "stop a", "end a"]
    assert reports(system) == ["shutdown_error b"]
    assert system.reports[-1].reason == Killed(0.2)


async def test_a_process_that_does_not_hear_is_killed(diary: Diary) -> None:
    children = in_order(diary, "a", "b", b={"deaf": True}, options={"b": {"stop": 0.2, "hang": math.inf}})
    async with running(Supervisor("top", children=children)) as system:
        pass
    assert not alive(diary.processes("b")[0])
    assert diary.lines("stop", "end") == ["stop b", "stop a", "end a"]
    assert system.reports[-1].reason == Killed(0.2)


async def test_a_brutal_kill_leaves_no_time_for_a_clean_up(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a", options={"a": {"stop": "kill"}}))) as system:
        pass
    assert diary.lines() == ["start a", "ready a"]
    assert reports(system) == []


async def test_without_a_limit_a_clean_up_is_waited_for(diary: Diary) -> None:
    children = in_order(diary, "a", a={"cleanup": 0.5}, options={"a": {"stop": math.inf}})
    async with running(Supervisor("top", children=children)) as system:
        pass
    assert diary.lines("stop", "end") == ["stop a", "end a"]
    assert reports(system) == []


async def test_a_process_that_dies_while_the_tree_stops_is_reported_and_not_waited_for(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a", "b", b={"cleanup": 1000}))) as system:
        stop = asyncio.create_task(system.stop())
        await until(lambda: diary.lines("stop") == ["stop b"])
        kill(diary, "a")
        kill(diary, "b")
        await stop
    assert sorted(reports(system)) == ["shutdown_error a", "shutdown_error b"]


async def test_instances_stop_together(diary: Diary) -> None:
    async with running(DynamicSupervisor("top", Child(Scripted, process=True))) as system:
        assert system.supervisor is not None
        for name in ("one", "two"):
            await system.supervisor.spawn(str(diary.path), {"cleanup": 0.5}, name=name)
    assert sorted(diary.lines("stop", "end")[:2]) == ["stop one", "stop two"]


async def test_a_failed_start_reaches_the_program_with_its_cause(diary: Diary) -> None:
    inner = Supervisor("inner", process=True, children=[*in_order(diary, "a", "b", b={"refuse": 9})])
    with pytest.raises(StartFailed, match="top/inner/b") as caught:
        async with running(Supervisor("top", children=[inner])):
            pass
    assert caught.value.path == ("top", "inner", "b")
    assert diary.lines("end") == ["end b", "end a"]


async def test_the_end_of_a_significant_process_ends_its_supervisor(diary: Diary) -> None:
    options: dict[str, Any] = {"b": {"restart": temporary, "significant": True}}
    children = in_order(diary, "a", "b", options=options)
    async with running(Supervisor("top", auto_shutdown=any_significant, children=children)) as system:
        kill(diary, "b")
        await system.wait()
    assert diary.lines("stop") == ["stop a"]


async def test_the_last_of_all_significant_processes_ends_its_supervisor(diary: Diary) -> None:
    options: dict[str, Any] = {name: {"restart": temporary, "significant": True} for name in "ab"}
    children = in_order(diary, "a", "b", options=options)
    async with running(Supervisor("top", auto_shutdown=all_significant, children=children)) as system:
        kill(diary, "a")
        await until(lambda: reports(system) == ["child_terminated a"])
        assert system.running
        kill(diary, "b")
        await system.wait()


async def test_a_permanent_supervisor_is_restarted_with_its_processes(diary: Diary) -> None:
    inner = Supervisor("inner", process=True, restart=permanent, children=in_order(diary, "a", "b"))
    async with running(Supervisor("top", children=[inner])) as system:
        first = [diary.processes(name)[0] for name in "ab"]
        (process,) = {_parent(_parent(pid)) for pid in first}  # the parent of the zygote that has forked them
        os.kill(process, signal.SIGKILL)
        await until(lambda: diary.lines("ready").count("ready b") == 2)
        await until(lambda: not any(map(alive, first)), "the orphans are gone")
        assert reports(system)[0] == "child_terminated inner"


def _parent(pid: int) -> int:
    with open(f"/proc/{pid}/stat") as file:
        return int(file.read().rpartition(")")[2].split()[1])
