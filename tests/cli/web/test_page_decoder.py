"""The page's decoder of messages, run by node: it reads what two other encoders wrote, byte by byte, and what Python encodes."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from actors.interfaces import Message, encode, get_message
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import Empty, Int64, UInt64MultiArray
from actors.interfaces.text import schema_text
from tests.conformance.checks.definitions import build, jazzy

NODE = shutil.which("node")
PROGRAM = Path(__file__).with_name("decode_cdr.mjs")
VECTORS = Path(__file__).parents[2] / "conformance" / "vectors"

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed: the page's decoder is not run")


def decoded(cases: list[dict[str, str]]) -> list[dict[str, Any]]:
    """What the page's decoder makes of {schema, type, hex}."""
    assert NODE is not None
    lines = "".join(json.dumps(case) + "\n" for case in cases)
    done = subprocess.run([NODE, PROGRAM], input=lines, capture_output=True, text=True, timeout=60, check=True)
    return [json.loads(line) for line in done.stdout.split("\n")[:-1]]  # other line breaks are text


def case(message: Message) -> dict[str, str]:
    return {
        "schema": schema_text(type(message)),
        "type": type(message).__ros_type__,
        "hex": encode(message).hex(),
    }


def plain(value: Any, exact: bool = False) -> Any:
    """A message as `decode_cdr.mjs` writes one: whole numbers beyond 2**53 exact, and arrays of 64 bits always."""
    if isinstance(value, Message):
        return {name: plain(getattr(value, name)) for name in type(value).__struct_fields__}
    if isinstance(value, np.ndarray):
        return [plain(one, exact=value.dtype.itemsize == 8 and value.dtype.kind in "iu") for one in value.tolist()]
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        return f"integer {value}" if exact or abs(value) > 2**53 - 1 else value
    assert isinstance(value, float)
    if math.isnan(value):
        return "number NaN"
    if math.isinf(value):
        return "number Infinity" if value > 0 else "number -Infinity"
    if value == 0.0:
        return "number -0" if math.copysign(1.0, value) < 0 else 0
    return f"number {value:.17e}" if value.is_integer() and abs(value) > 2**53 - 1 else value


def test_it_reads_every_vector_on_which_two_other_encoders_agree() -> None:
    path = VECTORS / "cdr_vectors.json"
    vectors = json.loads(path.read_text(encoding="utf-8"))["vectors"]
    with jazzy(path):
        classes: list[Any] = [get_message(vector["type"]) for vector in vectors]
        cases = [
            {"schema": schema_text(cls), "type": vector["type"], "hex": vector["cdr_hex"]}
            for cls, vector in zip(classes, vectors, strict=True)
        ]
        wanted = [plain(build(cls, vector["value"])) for cls, vector in zip(classes, vectors, strict=True)]
    assert len(cases) > 300
    for vector, answer, want in zip(vectors, decoded(cases), wanted, strict=True):
        assert answer["message"] == want, vector["type"]


NUMBERS = st.lists(st.floats(), max_size=5)
NAMES = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9), max_size=4)
MESSAGES = st.one_of(
    st.builds(
        lambda names, numbers: JointState(name=tuple(names), position=numbers, effort=numbers[:1]), NAMES, NUMBERS
    ),
    st.builds(lambda whole: Int64(data=whole), st.integers(-(2**63), 2**63 - 1)),
    st.builds(
        lambda wide: UInt64MultiArray(data=np.array(wide, dtype=np.uint64)),
        st.lists(st.integers(0, 2**64 - 1), max_size=4),
    ),
)


@settings(max_examples=5, phases=[Phase.generate])
@given(messages=st.lists(MESSAGES, min_size=20, max_size=40))
def test_it_reads_what_python_encodes(messages: list[Message]) -> None:
    """Many in each example, because `node` takes long to start."""
    answers = [answer["message"] for answer in decoded([*map(case, messages), case(Empty())])]
    assert answers == [*map(plain, messages), {}]


def test_big_endian_messages_are_read_too() -> None:
    schema = "float64[] data\nuint16 last"
    hexed = "00000000" + "00000002" + "00000000" + "3ff8000000000000" + "c000000000000000" + "0102"
    (answer,) = decoded([{"schema": schema, "type": "a/msg/B", "hex": hexed}])
    assert answer["message"] == {"data": [1.5, -2], "last": 258}


def test_the_numbers_of_a_message_are_found_by_their_paths() -> None:
    imu = Imu().replace(angular_velocity=Imu().angular_velocity.replace(z=0.25))
    report = DiagnosticArray()
    one, other = decoded([case(imu), case(report)])
    assert one["numbers"]["angular_velocity.z"] == 0.25
    assert one["numbers"]["header.stamp.sec"] == 0
    assert "orientation_covariance[]" in one["numbers"]
    assert "header.frame_id" not in one["numbers"]
    assert other["numbers"]["status[].level"] == "number NaN"  # there is no first status


@pytest.mark.parametrize(
    ("schema", "hexed", "why"),
    [
        ("float64 x", "0001", "2 bytes are no message"),
        ("uint8[] data", "00010000" + "ffffffff", "ends after 8 bytes"),
        ("string[] data", "00010000" + "ffffff7f", "does not fit"),
        ("other/Thing x", "00010000", "no definition of other/Thing"),
        ("float64 9x", "00010000", 'cannot read the line "float64 9x"'),
    ],
)
def test_what_cannot_be_read_is_refused_with_the_reason(schema: str, hexed: str, why: str) -> None:
    (answer,) = decoded([{"schema": schema, "type": "a/msg/B", "hex": hexed}])
    assert why in answer["error"]
