"""Numbers that make no sense are refused where they are written, in words that say what is wanted."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from actors import DeclarationError, Node
from actors.actions import parallel, queue
from actors.testing import Rig
from tests.facts import lacks
from tests.stage import ADD, COUNT, NUMBERS, order


@pytest.mark.parametrize("size", [0, -1, 1.5, math.nan, math.inf, True, "1", None])
@pytest.mark.parametrize("policy", [queue, parallel])
def test_the_limit_of_an_arrival_policy_is_a_whole_number(policy: Any, size: Any) -> None:
    with pytest.raises(DeclarationError) as refused:
        policy(size)
    assert str(refused.value).startswith(f"{policy.__name__}({size!r})")
    assert lacks(str(refused.value), "limit 1 whole") == []


@pytest.mark.parametrize("seconds", ["1", None, True, math.nan])
def test_the_time_that_results_are_kept_is_seconds(seconds: Any) -> None:
    with pytest.raises(
        DeclarationError, match=rf"result_timeout={re.escape(repr(seconds))} must be seconds; 0 keeps no result"
    ):
        COUNT.serve(result_timeout=seconds)


@pytest.mark.parametrize("seconds", [0, 0.5, -1, math.inf])
def test_a_time_that_results_are_kept(seconds: float) -> None:
    assert callable(COUNT.serve(result_timeout=seconds))


@pytest.mark.parametrize("arrivals", [5, None, ["queue"], "random"])
def test_an_arrival_policy_is_one_of_those_that_there_are(arrivals: Any) -> None:
    with pytest.raises(
        DeclarationError, match=re.escape(f"arrivals={arrivals!r} is none of reject, preempt, queue, parallel")
    ):
        COUNT.serve(arrivals=arrivals)


@pytest.mark.parametrize("concurrent", [-1, 1.5, math.nan, math.inf, True, "2", None])
def test_how_many_handlers_run_at_once_is_a_whole_number(concurrent: Any) -> None:
    for decorator in (NUMBERS.on, ADD.serve):
        with pytest.raises(DeclarationError, match=rf"concurrent={re.escape(repr(concurrent))} must be 0 "):
            decorator(concurrent=concurrent)


@pytest.mark.parametrize("timeout", [None, "1", math.nan, True])
async def test_a_timeout_is_a_number_of_seconds(rig: Rig, timeout: Any) -> None:
    await rig.start(Node)
    said = re.escape(f"timeout={timeout!r} must be a number of seconds, or math.inf for no limit")
    with pytest.raises(ValueError, match=r"^/rig\.send_goal\(Action\(Fibonacci, 'count'\)\): " + said):
        rig.me.send_goal(COUNT, order(1), timeout=timeout)
    if timeout is not None:  # without limit
        with pytest.raises(ValueError, match=r"^/rig\.wait_for: " + said):
            await rig.me.wait_for(ADD, timeout=timeout)
        with pytest.raises(ValueError, match="^the stream of /numbers: " + said):
            await rig.me.subscribe(NUMBERS).next(timeout)
