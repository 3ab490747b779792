"""A parameter value from the text that a person types after `param set NODE NAME`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from actors.parameters.values import Parameter, ParameterType


def parse_parameter(name: str, text: str) -> Parameter:
    """The parameter that `text` means, typed as `ros2 param set` does: YAML 1.1 scalars and flat lists.

    So `yes` is a bool, `010` is 8, `1e3` is a string (YAML 1.1 wants `1.0e+3`); what is not a value of one of the nine
    types (a mapping, a date, null, a mixed list, or no YAML at all) is the string itself; `[]` is an empty bool array.
    Raises ValueError for an integer that needs more than 64 bits. (Parameter files have their own, different rules.)
    """
    import yaml  # late: only commands need it

    load: Callable[[str], object] = cast("Any", yaml).safe_load
    try:
        value = load(text)
        kind = ParameterType.of(value)
    except (yaml.YAMLError, TypeError, ValueError):  # PyYAML raises ValueError for 2024-13-99
        return Parameter(name, text)
    if kind is ParameterType.NOT_SET:
        return Parameter(name, text)
    if value == []:
        kind = ParameterType.BOOL_ARRAY
    return Parameter(name, value, kind)
