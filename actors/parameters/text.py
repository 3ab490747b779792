"""The parsing of a parameter value given as text, as in `param set NODE NAME VALUE`."""

from __future__ import annotations

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
