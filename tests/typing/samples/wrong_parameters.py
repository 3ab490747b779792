"""Parameters used wrongly: each marked line is one error, for the checkers that it names."""

from __future__ import annotations

from collections.abc import Sequence

from actors import Child, Node, Parameter, Supervisor, parameter
from actors.parameters import on_set


class Wrong(Node):
    speed = parameter(0.5, ge=0.0, le=2.0)
    legs = parameter(4)
    gait = parameter("trot")
    gains = parameter([1.0, 2.0])
    armed = parameter(False)

    @speed.validate  # E
    def takes_another_type(self, value: str) -> str | None: ...

    @speed.validate  # E
    def answers_with_a_flag(self, value: float) -> bool:
        return value > 1.0

    @legs.changed  # E
    async def waits(self, value: int) -> None: ...

    @on_set  # E
    def answers_nothing(self, parameters: Sequence[Parameter]) -> None: ...

    def use(self) -> str:
        fast: int = self.speed  # E
        gains: list[float] = self.gains  # E
        self.armed = len(gains) > fast  # E: mypy
        return self.legs  # E

    def read_on_the_class(self) -> float:
        return Wrong.speed  # E

    def set(self) -> bool:
        return self.set_parameter("speed", 1.0)  # E

    def set_without_a_value(self) -> None:
        self.set_parameter("speed")  # E


def assign(node: Wrong) -> None:
    node.gait = "walk"  # E


TREE = Supervisor("tree", children=[Node()])  # E
CHILD = Child(Node, restart="sometimes")  # E
