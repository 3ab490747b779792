"""YAML whose plain scalars have the types that ROS 2 gives them: the one reader and the one writer of values for parameters.

General YAML differs: to it, ``1e3`` is a text, ``12:30`` a number and ``2001-01-01`` a date; to ROS 2, ``y`` is a boolean and ``0x10`` an integer.
"""

from __future__ import annotations

import re
from base64 import b64encode
from functools import lru_cache
from typing import Any, Final, cast

from actors.parameters.files import plain_scalar
from actors.yaml_bounds import check_yaml, safe_loader

PLAIN: Final = "tag:robactor,2026:plain"
"""The tag of the nodes that are scalars without quotes and without a tag of their own."""
_TEXT: Final = "tag:yaml.org,2002:str"
_BINARY: Final = "tag:yaml.org,2002:binary"
_UNPRINTABLE: Final = re.compile("[\x7f-\x9f\u2028\u2029\ufeff]")
_WIDE: Final = 2**31
"""No line is wrapped."""


def load_yaml(text: str) -> Any:
    """The value in a text; keys of mappings are texts. Raises ``yaml.YAMLError`` for what is no YAML, and ValueError for a wrong tag."""
    check_yaml(text)
    reader = loader()(text)
    try:
        return reader.get_single_data()
    finally:
        reader.dispose()


def dump_yaml(value: object) -> str:
    """Plain data in block style, from which `load_yaml` and ROS 2 read the same values: a text that reads as another type is quoted."""
    import yaml

    dump: Any = yaml.dump  # its stubs do not type it
    options: dict[str, object] = {
        "sort_keys": False,
        "allow_unicode": True,
        "width": _WIDE,
        "default_flow_style": False,
    }
    return str(dump(value, Dumper=_dumper(), **options))


@lru_cache(maxsize=1)
def loader() -> Any:
    """The loader class of PyYAML that reads so."""
    import yaml  # late: few programs read YAML

    library: Any = yaml

    class Loader(safe_loader()):  # type: ignore[misc]  # PyYAML has no types
        def resolve(self, kind: Any, value: object, implicit: Any) -> Any:
            if kind is library.ScalarNode and implicit[0] and value != "<<":
                return PLAIN
            return library.SafeLoader.resolve(self, kind, value, implicit)

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[str, Any]:
            if not isinstance(node, library.MappingNode):
                raise library.constructor.ConstructorError(None, None, "a map was expected", node.start_mark)
            self.flatten_mapping(node)
            for key, _ in node.value:
                if not isinstance(key, library.ScalarNode):
                    raise library.constructor.ConstructorError(None, None, "a key is a name", key.start_mark)
            return {key.value: self.construct_object(value, deep=deep) for key, value in node.value}

    def plain(reader: object, node: Any) -> Any:
        return plain_scalar(node.value) if node.value else None

    Loader.add_constructor(PLAIN, plain)
    return Loader


@lru_cache(maxsize=1)
def _dumper() -> Any:
    import yaml

    library: Any = yaml

    class Dumper(library.SafeDumper):  # type: ignore[misc]  # PyYAML has no types
        def ignore_aliases(self, data: object) -> bool:
            return True  # parameter files have none

    def text(writer: Any, value: str) -> Any:
        quoted = value == "" or not isinstance(cast("object", plain_scalar(value)), str)
        style = '"' if _UNPRINTABLE.search(value) else "'" if quoted else None  # in double quotes they are escaped
        return writer.represent_scalar(_TEXT, value, style=style)

    Dumper.add_representer(str, text)

    def array(writer: Any, value: tuple[Any, ...]) -> Any:
        if value and all(isinstance(item, bytes) for item in value):
            return writer.represent_scalar(_BINARY, b64encode(b"".join(value)).decode())
        return writer.represent_list(value)

    Dumper.add_representer(tuple, array)
    return Dumper
