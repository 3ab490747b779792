"""`speed = parameter(0.5, ...)` in a class body: what it declares, how it reads, what it refuses."""

from __future__ import annotations

import math
from typing import Any

import pytest

from actors import parameter
from actors.errors import DeclarationError, NotStarted
from actors.parameters import (
    NO_PARAMETERS,
    FloatingPointRange,
    IntegerRange,
    ParameterDeclaration,
    ParameterNotDeclared,
    ParameterStore,
    ParameterTable,
    ParameterType,
)
from actors.parameters.values import INT64_MAX, INT64_MIN


class Core:
    """What a started node has behind it, as far as parameters are concerned."""

    def __init__(self, parameters: ParameterStore) -> None:
        self.parameters = parameters


class Mover:
    speed = parameter(0.5, unit="m/s", ge=0.0, le=2.0, step=0.25, description="Forward speed.")
    gait = parameter("trot", choices=("trot", "walk"))
    gain = parameter((1.0, 0.1), name="pid.gain", read_only=True)

    __machinery__: Core | None = None


def table_of(*declarations: ParameterDeclaration[Any]) -> ParameterTable:
    return ParameterTable(declarations)


def started_mover() -> Mover:
    mover = Mover()
    mover.__machinery__ = Core(ParameterStore("/mover", table=table_of(Mover.speed, Mover.gait, Mover.gain)))
    return mover


def test_the_class_shows_the_declaration_and_a_started_node_the_value() -> None:
    mover = started_mover()
    assert (mover.speed, mover.gait, mover.gain) == (0.5, "trot", (1.0, 0.1))
    assert Mover.speed.name == "speed"
    assert Mover.gain.name == "pid.gain"
    assert repr(Mover.speed) == "<parameter 'speed': DOUBLE = 0.5>"


def test_a_node_reads_the_new_value_after_a_set() -> None:
    mover = started_mover()
    assert mover.__machinery__ is not None
    assert mover.__machinery__.parameters.set_values({"speed": 1}).successful
    assert mover.speed == 1.0


def test_reading_before_the_start_says_when_to_read() -> None:
    with pytest.raises(NotStarted, match=r"Mover\.speed .* not started yet: read it in on_start or later"):
        _ = Mover().speed


def test_reading_an_undeclared_one_names_parameter_and_node() -> None:
    mover = started_mover()
    assert mover.__machinery__ is not None
    mover.__machinery__.parameters.undeclare("speed")
    with pytest.raises(ParameterNotDeclared, match="node /mover has not declared 'speed'"):
        _ = mover.speed


def test_assigning_is_refused_with_the_way_to_do_it() -> None:
    mover = started_mover()
    with pytest.raises(AttributeError, match=r"call self\.set_parameter\('speed', 1\.0\)"):
        mover.speed = 1.0  # type: ignore[assignment]
    assert mover.speed == 0.5


def test_the_descriptor_holds_what_the_declaration_says() -> None:
    described = Mover.speed.descriptor
    assert (described.name, described.type, described.read_only) == ("speed", ParameterType.DOUBLE, False)
    assert (described.description, described.additional_constraints) == ("Forward speed.", "unit: m/s")
    assert described.floating_point_range == FloatingPointRange(0.0, 2.0, 0.25)
    assert Mover.gait.descriptor.choices == ("trot", "walk")
    assert Mover.gain.descriptor.read_only
    assert Mover.gain.descriptor.name == "pid.gain"


def test_a_missing_end_is_open() -> None:
    assert parameter(1, ge=0).descriptor.integer_range == IntegerRange(0, INT64_MAX)
    assert parameter(1, le=3).descriptor.integer_range == IntegerRange(INT64_MIN, 3)
    assert parameter(1, ge=1, step=2).descriptor.integer_range == IntegerRange(1, INT64_MAX, 2)
    assert parameter(1.0, ge=0.0).descriptor.floating_point_range == FloatingPointRange(0.0, math.inf)
    assert parameter(1.0, le=1.0).descriptor.floating_point_range == FloatingPointRange(-math.inf, 1.0)
    assert parameter(1.0).descriptor.floating_point_range is None


def test_an_int_with_a_float_among_its_limits_is_a_float() -> None:
    assert parameter(1, ge=0.0, le=2).default.type is ParameterType.DOUBLE
    assert parameter(1, choices=(1, 2.5)).descriptor.choices == (1.0, 2.5)
    assert parameter((1, 0.5)).default.value == (1.0, 0.5)
    assert parameter(1).default.type is ParameterType.INTEGER
    assert parameter([1, 2]).default.type is ParameterType.INTEGER_ARRAY


def test_an_empty_list_is_of_the_type_that_is_said() -> None:
    for of, kind in (
        (str, ParameterType.STRING_ARRAY),
        (float, ParameterType.DOUBLE_ARRAY),
        (int, ParameterType.INTEGER_ARRAY),
        (bool, ParameterType.BOOL_ARRAY),
        (bytes, ParameterType.BYTE_ARRAY),
    ):
        declared = parameter([], of=of, description="sources")
        assert (declared.default.value, declared.default.type, declared.descriptor.type) == ((), kind, kind)
    assert parameter([1, 2], of=float).default.value == (1.0, 2.0)


def test_what_began_as_an_empty_list_keeps_its_type() -> None:
    class Joined:
        sources = parameter([], of=str)

    store = ParameterStore("/joined", table=table_of(Joined.sources))
    assert store.set_values({"sources": ["/a", "/b"]}).successful
    assert not store.set_values({"sources": [1.0]}).successful
    assert store.set_values({"sources": []}).successful and store.value("sources") == ()


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"default": 3.0, "ge": 0.0, "le": 2.0}, "does not obey its own limits: it is out of range 0.0..2.0"),
        ({"default": math.nan, "ge": 0.0}, "does not obey its own limits"),
        ({"default": "run", "choices": ("trot", "walk")}, "must be one of 'trot', 'walk'"),
        ({"default": None}, "needs a default value"),
        ({"default": ()}, r"an empty list has no element type; write parameter\(\[\], of=str\)"),
        ({"default": ["a"], "of": int}, "of=int is for a list of which all elements are of that type"),
        ({"default": "a", "of": str}, "of=str is for a list"),
        ({"default": [], "of": dict}, "of=dict .*: bool, int, float, str or bytes"),
        ({"default": (1, "a")}, "mixed list"),
        ({"default": object()}, "cannot hold"),
        ({"default": 2**63}, "64 bits"),
        ({"default": "a", "ge": 0}, "ge, le and step limit an int or a float, not a STRING"),
        ({"default": True, "le": 1}, "not a BOOL"),
        ({"default": "a", "ge": 0.5}, "not a STRING"),
        ({"default": (1.0,), "choices": (1.0,)}, "choices limit an int, a float or a string, not a DOUBLE_ARRAY"),
        ({"default": 1, "choices": (1, "two")}, "the choice 'two' is not of the type of the default 1"),
        ({"default": 1, "ge": 2, "le": 0}, "ge=2 is above le=0"),
        ({"default": 1, "step": 2}, "step=2 counts from ge; give ge as well"),
        ({"default": 1, "ge": 0, "step": -2}, "must not be negative"),
    ],
)
def test_a_wrong_declaration_is_refused_where_it_is_written(arguments: dict[str, Any], why: str) -> None:
    with pytest.raises(DeclarationError, match=why):
        parameter(**arguments)


def test_one_declaration_cannot_be_two_attributes() -> None:
    with pytest.raises((DeclarationError, RuntimeError)) as caught:

        class Twice:
            first = parameter(1)
            second = first

    shown = caught.value.__cause__ or caught.value
    assert isinstance(shown, DeclarationError)
    assert "Twice.second and .first are one and the same parameter()" in str(shown)


def test_a_declaration_can_be_taken_over_by_another_class_under_its_name() -> None:
    class Borrower:
        speed = Mover.speed

    assert Borrower.speed is Mover.speed


def test_every_node_has_the_two_parameters_of_ros() -> None:
    assert NO_PARAMETERS.values == {"use_sim_time": False, "start_type_description_service": True}
    assert NO_PARAMETERS.descriptors["start_type_description_service"].read_only
    assert NO_PARAMETERS.descriptors["use_sim_time"].type is ParameterType.BOOL
    assert repr(NO_PARAMETERS) == "<parameter table: use_sim_time, start_type_description_service>"


def test_a_name_is_declared_once_in_a_class() -> None:
    with pytest.raises(DeclarationError, match=r"'pid\.gain' is declared twice"):
        table_of(parameter(1, name="pid.gain"), parameter(2, name="pid.gain"))
    with pytest.raises(DeclarationError, match="'use_sim_time' is declared twice"):
        table_of(parameter(True, name="use_sim_time"))
