"""The parsing of a parameter value given as text, as in `param set NODE NAME VALUE`."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable
from typing import Any, cast

from actors.parameters.values import Parameter, ParameterType
from actors.yaml_bounds import load_yaml


def parse_parameter(name: str, text: str) -> Parameter:
    """Parse `text` with the types of `ros2 param set`: YAML 1.1 scalars and flat lists.

    `yes` is a bool, `010` is 8, `1e3` is a string (YAML 1.1 requires `1.0e+3`), and `[]` is an empty bool array. A text that is not a value
    of one of the nine types (a mapping, a date, null, a mixed list, or invalid YAML) is a string. Raises ValueError for an integer that
    needs more than 64 bits. Parameter files have different rules.
    """
    import yaml  # imported late because only commands need it

    try:
        value = load_yaml(text)
        kind = ParameterType.of(value)
    except (yaml.YAMLError, TypeError):
        return Parameter(name, text)
    if kind is ParameterType.NOT_SET:
        return Parameter(name, text)
    if value == []:
        kind = ParameterType.BOOL_ARRAY
    return Parameter(name, value, kind)


_WORDS = frozenset({"y", "n", "yes", "no", "on", "off", "true", "false", "null"})
"""What YAML does not take for a text."""

_UNPRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff]")


def parameter_file(node: str, parameters: Iterable[Parameter]) -> str:
    """The text of a parameter file with these parameters of one node. Names in groups keep their dots.

    Parameters without a value are left out, and so are arrays of bytes, for which parameter files have no notation: a comment names them.
    """
    lines = [f"{node}:", "  ros__parameters:"]
    for one in parameters:
        if one.type is ParameterType.BYTE_ARRAY and one.value:
            lines.append(f"    # {one.name}: an array of bytes")
        elif one.type is not ParameterType.NOT_SET:
            lines.append(f"    {_key(one.name)}: {_written(one.value)}")
    if not any(not line.lstrip().startswith("#") for line in lines[2:]):
        lines[1] += " {}"
    return "\n".join(lines) + "\n"


def _written(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ".nan" if math.isnan(value) else f"{'-' * (value < 0)}.inf"
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, int):
        return str(value)
    return f"[{', '.join(map(_written, cast('Iterable[Any]', value)))}]"


def _key(name: str) -> str:
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9_.]*", name) and name.lower() not in _WORDS
    return name if plain else _quoted(name)


def _quoted(text: str) -> str:
    """A text in double quotes, so that it is read as a text whatever it says."""
    shown = json.dumps(text, ensure_ascii=False)
    return _UNPRINTABLE.sub(lambda found: f"\\u{ord(found[0]):04x}", shown)
