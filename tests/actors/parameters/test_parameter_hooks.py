"""`@speed.validate`, `@speed.changed`, `@pre_set`, `@on_set`, `@post_set`: what a class says about the sets of its parameters."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pytest

import actors
from actors import Child, DeclarationError, Node, Parameter, Service, SetResult, StartFailed, parameter
from actors.interfaces.rcl_interfaces import srv
from actors.parameters import SetParametersResult, on_set, post_set, pre_set
from actors.parameters.messages import to_parameter
from actors.runtime.incarnation import incarnation_of
from actors.testing import Rig

SET = Service(srv.SetParameters, "/driver/set_parameters")
ATOMIC = Service(srv.SetParametersAtomically, "/driver/set_parameters_atomically")


class Driver(Node):
    """Has one of each, and writes down in which order they are asked."""

    speed = parameter(0.5, ge=0.0, le=2.0)
    gain = parameter(1.0, name="pid.gain")
    legs = parameter(4)

    def __init__(self) -> None:
        self.said: list[Any] = []

    @speed.validate
    def sane(self, value: float) -> str | None:
        self.said.append(("validate", value, self.speed))
        return "1.3 m/s makes it sway" if value == 1.3 else None

    @speed.changed
    def told(self, value: float) -> None:
        self.said.append(("changed", value, self.speed))

    @gain.changed
    def tuned(self, value: float) -> None:
        self.said.append(("gain", value))

    @pre_set
    def rewrite(self, parameters: Sequence[Parameter]) -> Iterable[Parameter]:
        self.said.append("pre_set")
        return [Parameter(one.name, 2.0) if one.value == 2.5 else one for one in parameters if one.value != 9]

    @on_set
    def together(self, parameters: Sequence[Parameter]) -> SetResult:
        self.said.append("on_set")
        wanted = {one.name: one.value for one in parameters}
        return SetResult(
            not (wanted.get("legs") == 2 and wanted.get("speed", 0.0) > 1.0), "two legs fall at this speed"
        )

    @post_set
    def all_told(self, parameters: Sequence[Parameter]) -> None:
        self.said.append(("post_set", sorted(one.name for one in parameters)))


async def test_a_set_is_validated_stored_and_told_in_ros_order(rig: Rig) -> None:
    await rig.start(Driver)
    driver = rig.node(Driver)
    assert driver.set_parameter("speed", 1.5) == SetResult()
    assert driver.said == [
        "pre_set",
        ("validate", 1.5, 0.5),
        "on_set",
        ("changed", 1.5, 1.5),
        ("post_set", ["speed"]),
    ]


async def test_a_refusal_says_why_and_changes_and_tells_nothing(rig: Rig) -> None:
    await rig.start(Driver)
    driver = rig.node(Driver)
    assert driver.set_parameter("speed", 1.3) == SetResult(False, "1.3 m/s makes it sway")
    assert driver.said == ["pre_set", ("validate", 1.3, 0.5)]
    assert driver.set_parameters({"legs": 2, "speed": 1.5}) == SetResult(False, "two legs fall at this speed")
    assert (driver.speed, driver.legs) == (0.5, 4)
    assert driver.set_parameter("legs", 9) == SetResult(
        False, "parameter list cannot be empty: the pre-set callbacks left nothing to set."
    )


async def test_other_nodes_requests_meet_the_same_checks(rig: Rig) -> None:
    await rig.start(Driver)
    wanted = [to_parameter(Parameter("speed", value)) for value in (1.3, 2.5, 1.0)]
    answer = await rig.call(SET, srv.SetParameters.Request(parameters=wanted))
    assert [(one.successful, one.reason) for one in answer.results] == [
        (False, "1.3 m/s makes it sway"),
        (True, ""),
        (True, ""),
    ]
    told = [one for one in rig.node(Driver).said if one[0] == "changed"]
    assert told == [("changed", 2.0, 2.0), ("changed", 1.0, 1.0)]


async def test_the_hook_of_a_parameter_with_a_ros_name_of_its_own(rig: Rig) -> None:
    await rig.start(Driver)
    driver = rig.node(Driver)
    driver.set_parameter("pid.gain", 3.0)
    assert ("gain", 3.0) in driver.said


async def test_of_a_name_given_twice_the_last_value_is_told(rig: Rig) -> None:
    await rig.start(Driver)
    twice = [to_parameter(Parameter("speed", value)) for value in (0.1, 0.2)]
    answer = await rig.call(ATOMIC, srv.SetParametersAtomically.Request(parameters=twice))
    assert answer.result.successful
    assert [one for one in rig.node(Driver).said if one[0] in ("validate", "changed")] == [
        ("validate", 0.1, 0.5),
        ("validate", 0.2, 0.5),
        ("changed", 0.2, 0.2),
    ]


async def test_the_values_that_a_node_is_started_with_are_validated_before_on_start(rig: Rig) -> None:
    await rig.start(Child(Driver, parameters={"speed": 1.0}))
    assert rig.node(Driver).said == [("validate", 1.0, 1.0), "on_set"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"speed": 1.3}, "node /driver cannot start with speed = 1.3: 1.3 m/s makes it sway"),
        (
            {"speed": 1.5, "legs": 2},
            "node /driver cannot start with speed = 1.5, legs = 2: two legs fall at this speed",
        ),
    ],
)
async def test_a_start_with_a_value_that_is_refused_fails_with_the_reason(rig: Rig, given: Any, said: str) -> None:
    with pytest.raises(StartFailed, match=re.escape(said)):
        await rig.start(Child(Driver, parameters=given))


class Further(Driver):
    """Inherits some, declares one parameter anew and does without a hook."""

    speed = parameter(0.7)
    all_told = None  # type: ignore[assignment]

    @Driver.legs.validate
    def even(self, value: int) -> str | None:
        return None if value % 2 == 0 else "an odd number of legs"


async def test_hooks_are_inherited_and_a_parameter_of_the_base_gets_further_ones(rig: Rig) -> None:
    await rig.start(Child(Further, name="driver"))
    driver = rig.node(Further)
    assert driver.set_parameter("legs", 3) == SetResult(False, "an odd number of legs")
    assert driver.set_parameter("speed", 1.3) == SetResult(False, "1.3 m/s makes it sway")
    assert driver.set_parameter("speed", 1.0).successful and ("changed", 1.0, 1.0) in driver.said
    assert not any(one[0] == "post_set" for one in driver.said)


class Sloppy(Node):
    """Answers what is no answer."""

    speed = parameter(0.5)

    @speed.validate
    def sane(self, value: float) -> str | None:
        answers: dict[float, Any] = {1.0: True, 2.0: "", 3.0: SetResult()}
        return answers[value]  # type: ignore[no-any-return]


@pytest.mark.parametrize(("value", "answer"), [(1.0, "bool True"), (2.0, "str ''"), (3.0, "SetResult SetResult(")])
async def test_a_validator_that_answers_neither_none_nor_a_reason_is_told(rig: Rig, value: float, answer: str) -> None:
    await rig.start(Sloppy)
    with pytest.raises(
        TypeError, match=rf"@speed\.validate Sloppy\.sane answered {re.escape(answer)}.*; return None to accept"
    ):
        rig.node(Sloppy).set_parameter("speed", value)
    assert rig.node(Sloppy).speed == 0.5


async def test_a_deleted_parameter_is_nothing_to_validate_or_to_tell(rig: Rig) -> None:
    await rig.start(Driver)
    driver = rig.node(Driver)
    store = incarnation_of(driver).parameters
    store.set_descriptor("speed", actors.parameters.ParameterDescriptor(dynamic_typing=True))
    driver.said.clear()
    assert driver.set_parameter("speed", None).successful
    assert driver.said == ["pre_set", "on_set", ("post_set", ["speed"])]


async def wait(self: Any, value: float) -> None: ...


SPEED = parameter(1.0)
ELSEWHERE = parameter(1.0, name="elsewhere")


@pytest.mark.parametrize(
    ("decorate", "method", "said"),
    [
        (SPEED.changed, wait, "Pilot.hook is @speed.changed: make it a plain `def hook(self, value)`, which must not wait; self.create_task"),
        (SPEED.validate, lambda self: None, "Pilot.hook is @speed.validate: make it a plain `def hook(self, value)`"),
        (on_set, lambda self: SetResult(), "Pilot.hook is @on_set: make it a plain `def hook(self, parameters)`"),
        (ELSEWHERE.changed, lambda self, value: None, "Pilot.hook is @elsewhere.changed, a parameter that the class does not declare"),
    ],
)  # fmt: skip
def test_a_hook_that_cannot_be_called_is_refused(decorate: Callable[[Any], Any], method: Any, said: str) -> None:
    with pytest.raises(DeclarationError, match="^" + re.escape(said)):
        type("Pilot", (Node,), {"speed": SPEED, "hook": decorate(method)})


def test_a_hook_says_what_it_is_before_its_parameter_has_a_name() -> None:
    def hook(self: Any, value: int) -> None: ...

    parameter(1).changed(hook)
    assert repr(hook.__declarations__[0]) == "@parameter.changed"  # type: ignore[attr-defined]


def test_what_stands_in_their_signatures_can_be_imported_also_under_its_ros_name() -> None:
    assert SetParametersResult is SetResult is actors.SetResult
    assert actors.Parameter is Parameter
