"""YAML, imported when it is needed, and typed."""

from __future__ import annotations

from typing import Any

from actors import yaml_bounds


def load_yaml(text: str) -> Any:
    """The value that the text stands for. Raises `ValueError` for text that is no YAML."""
    import yaml

    try:
        return yaml_bounds.load_yaml(text)
    except yaml.YAMLError as error:
        raise ValueError(f"it is no YAML: {str(error).splitlines()[0]}") from None


def dump_yaml(value: object) -> str:
    """The text of a value, with the items of mappings in their order."""
    import yaml

    dump: Any = yaml.safe_dump
    return str(dump(value, sort_keys=False, allow_unicode=True))
