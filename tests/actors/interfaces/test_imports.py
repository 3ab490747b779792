"""What an import costs: nothing that a program without arrays does not need."""

from __future__ import annotations

import subprocess
import sys

import pytest


def modules_after(code: str) -> set[str]:
    """The modules that a fresh interpreter holds after this code."""
    script = f"{code}\nimport sys\nprint(*sys.modules)"
    return set(
        subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout.split()
    )


@pytest.mark.parametrize(
    "code",
    [
        "import actors.interfaces",
        "from actors.interfaces.std_msgs.msg import String; String(data='x')",
        "from actors.interfaces.sensor_msgs.msg import Imu",
        "from actors.interfaces.geometry_msgs.msg import Twist; from actors.interfaces import encode; encode(Twist())",
    ],
)
def test_numpy_is_imported_only_for_a_message_with_an_array(code: str) -> None:
    assert "numpy" not in modules_after(code)


def test_a_message_with_an_array_brings_numpy() -> None:
    assert "numpy" in modules_after("from actors.interfaces.sensor_msgs.msg import Imu; Imu()")


def test_declaring_types_needs_neither_the_parser_nor_the_codec() -> None:
    loaded = modules_after("import actors.interfaces.geometry_msgs.msg")
    assert not {f"actors.interfaces.{name}" for name in ("parse", "loading", "cdr", "hashes", "generate")} & loaded


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    import actors.interfaces as interfaces

    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        interfaces.nothing  # noqa: B018
    for name in interfaces.__all__:
        assert getattr(interfaces, name) is not None
