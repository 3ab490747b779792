"""Parameters: callbacks, a store without a node, errors, files, messages."""

from collections.abc import Iterable, Sequence

from actors import Node, Parameter, SetResult, parameter
from actors.interfaces.builtin_interfaces.msg import Time
from actors.parameters import (
    NO_PARAMETERS, CallbackHandle, FloatingPointRange, IntegerRange, InvalidParameterName, InvalidParameterType, InvalidParameterValue,
    OnSetCallback, ParameterAlreadyDeclared, ParameterBusy, ParameterChange, ParameterDeclaration, ParameterDescriptor, ParameterError,
    ParameterImmutable, ParameterNames, ParameterNotDeclared, ParameterStore, ParameterTable, ParameterType, ParameterUninitialized,
    PostSetCallback, PreSetCallback, SetParametersResult, Value, on_set, post_set, pre_set,
)
from actors.parameters.client import Asking, ParameterClient
from actors.parameters.files import ALL_NODES, InvalidParams, Origin, ParamValue, ParameterOverrides, parse_value, reaches
from actors.parameters.messages import (
    from_descriptor, from_event, from_parameter, from_result, from_value, to_descriptor, to_event, to_parameter, to_result, to_value,
)
from actors.testing import Rig

# -- callbacks

class Heater(Node):
    """Keeps between two temperatures, which change together."""

    low = parameter(18.0, unit="degC")
    high = parameter(22.0, unit="degC")

    @pre_set
    def widened(self, parameters: Sequence[Parameter]) -> Iterable[Parameter]:
        return [Parameter("high", 30.0) if one.name == "high" and one.value > 30.0 else one for one in parameters]

    @on_set
    def in_order(self, parameters: Sequence[Parameter]) -> SetResult:
        wanted = {"low": self.low, "high": self.high} | {one.name: one.value for one in parameters}
        return SetResult() if wanted["low"] < wanted["high"] else SetResult(False, "low must stay below high")

    @post_set
    def told(self, parameters: Sequence[Parameter]) -> None:
        self.changes = [one.name for one in parameters]


async def test_a_set_is_rewritten_refused_or_told(rig: Rig) -> None:
    await rig.start(Heater)
    heater = rig.node(Heater)
    refused: SetParametersResult = heater.set_parameter("low", 25.0)
    assert not refused.successful and refused.reason == "low must stay below high"
    assert heater.set_parameter("high", 99.0).successful
    assert heater.high == 30.0 and heater.changes == ["high"]


declared: ParameterDeclaration[float] = Heater.__dict__["low"]
steps: tuple[PreSetCallback | OnSetCallback | PostSetCallback, ...] = (lambda many: many, lambda many: SetResult(), lambda many: None)
assert declared.name == "low" and len(steps) == 3

# -- types, ranges, descriptions

told: list[ParameterChange] = []
table: ParameterTable = NO_PARAMETERS
store = ParameterStore("/heater", {"gains.p": 2}, table=table, on_event=told.append, announce=False)
tenths = ParameterDescriptor(floating_point_range=FloatingPointRange(0.0, 10.0, 0.5), description="proportional gain")
assert store.declare("gains.p", 1.0, tenths).value == 2.0  # the override counts, widened to the declared type
store.declare("gains.steps", 4, ParameterDescriptor(integer_range=IntegerRange(1, 8), read_only=True))
store.declare("label", ParameterType.STRING)  # a type, and no value yet
names: ParameterNames = store.list(["gains"])
value: Value = store.value("gains.p")
assert names.names == ("gains.p", "gains.steps") and value == 2.0 and store.type_of("gains.steps") is ParameterType.INTEGER

(refused,) = store.set([Parameter("gains.p", 11.0)])
assert not refused.successful and tenths.value_objection(Parameter("gains.p", 0.3)) is not None
assert store.set_values({"gains.p": 3}).successful and told[-1].changed == (Parameter("gains.p", 3.0),)

wrong = {
    ParameterNotDeclared: lambda: store.get("gains.d"),
    ParameterUninitialized: lambda: store.get("label"),
    ParameterAlreadyDeclared: lambda: store.declare("label", "x"),
    ParameterImmutable: lambda: store.undeclare("gains.steps"),
    InvalidParameterName: lambda: store.declare("", 1),
    InvalidParameterValue: lambda: store.declare("gains.i", 9, ParameterDescriptor(integer_range=IntegerRange(1, 8))),
    InvalidParameterType: lambda: ParameterStore("/other", {"rate": "fast"}).declare("rate", 1.0),
}
for kind, deed in wrong.items():
    try:
        deed()
    except kind as error:
        assert isinstance(error, ParameterError)
        print(error)
    else:
        raise AssertionError(kind)

handle: CallbackHandle = store.add_post_set_callback(lambda parameters: store.set_values({"label": "again"}) and None)
try:
    store.set_values({"gains.p": 4.0})
except ParameterBusy as error:
    print(error)
handle.remove()

# -- files and arguments

overrides = ParameterOverrides().with_text("/heater:\n  ros__parameters:\n    low: 15.0\n", source="plant.yaml").with_rule("high:=21.0")
assert overrides.for_node("/heater") == {"low": 15.0, "high": 21.0} and overrides.for_node("/fan") == {"high": 21.0}
origin: Origin = overrides.origin("/heater", "low")
assert (origin.source, origin.line) == ("plant.yaml", 3)
assert reaches(ALL_NODES, "/plant/heater") and not reaches("/*", "/plant/heater")
many: ParamValue = parse_value("[1.5, 2.5]")
assert many == (1.5, 2.5)
try:
    parse_value("[1, two]")
except InvalidParams as error:
    print(error)

# -- as messages

low = Parameter("low", 15.0)
assert from_parameter(to_parameter(low)) == low and from_value("low", to_value(low)) == low
assert from_descriptor(to_descriptor(tenths)).floating_point_range == tenths.floating_point_range
assert from_result(to_result(SetResult(False, "too cold"))) == SetResult(False, "too cold")
event = to_event(ParameterChange(changed=(low,)), "/heater", Time(sec=1))
assert from_event(event).changed == (low,) and event.node == "/heater"


async def test_any_node_can_ask(rig: Rig) -> None:
    await rig.start(Heater)
    asking: Asking = rig.me
    assert await ParameterClient(asking, "/heater").get("low") == 18.0
