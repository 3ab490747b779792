"""Errors are pickled and copied whole: pools of processes pass them on, and one that cannot be read again would break the pool."""

from __future__ import annotations

import copy
import pickle

import pytest

from actors import CallTimeout, GoalAborted, GoalRejected, ServiceFailed, StartFailed, SupervisorGaveUp
from actors.errors import CallCycle, NodeRestarting, ProcessDied, ProcessHung, RemoteError
from actors.hosts.host import HostLost
from actors.launch.errors import Line, SubstitutionFailure
from actors.names.names import InvalidName
from actors.names.remapping import InvalidRule
from actors.parameters.errors import InvalidParameterValue, ParameterNotDeclared
from actors.parameters.files import InvalidParams
from actors.running.arguments import InvalidRosArguments, UnknownRosArguments
from actors.supervision.reasons import Failed
from actors.transport.security.document import SecurityError

ERRORS = [
    CallTimeout("/adder did not answer within 2 s"),
    CallCycle(("/a", "/b")),
    GoalAborted("/paint", "no paint", result=[1, 2]),
    GoalRejected("/paint", "no paint"),
    HostLost("rover", 3.0),
    InvalidName("node name", "unallowed_characters", 3, "rob ot"),
    InvalidParameterValue("too fast", node="/gait", names=("speed",), reason="too fast"),
    InvalidParams("is no number", source="robot.yaml", line=4, key="speed"),
    InvalidRosArguments("-r needs a rule", ("-r",)),
    InvalidRule("a=b", "there is no :="),
    NodeRestarting("/gait", 2),
    ParameterNotDeclared.among("/gait", ["sped"], ["speed"]),
    ProcessDied(4711, "exit code 3"),
    ProcessHung(4711, 5.0, "gait.py:12"),
    RemoteError("TheirError", "it broke"),
    SecurityError("is no certificate", file="keys.yaml", line=2),
    ServiceFailed("/adder", "ValueError", "negative"),
    StartFailed(("robot", "gait"), "no legs"),
    SubstitutionFailure("there is no LEG", Line("robot.launch.py", 7)),
    SupervisorGaveUp(("robot",), "gait", 3, 5.0, Failed(ValueError("no legs"))),
    UnknownRosArguments(("--speed",)),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_is_pickled_and_copied_with_its_text_and_attributes(error: Exception) -> None:
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert {name: str(value) for name, value in vars(again).items()} == {
            name: str(value) for name, value in vars(error).items()
        }
