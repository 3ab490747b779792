"""The answer of the service `get_type_description`, by which other processes learn a type that they do not know."""

from __future__ import annotations

from actors.interfaces.errors import InterfaceError
from actors.interfaces.hashes import type_description, type_hash
from actors.interfaces.lookup import find
from actors.interfaces.message import Message
from actors.interfaces.naming import full_name
from actors.interfaces.plain import from_plain
from actors.interfaces.text import definition_text
from actors.interfaces.type_description_interfaces.msg import TypeDescription, TypeSource
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription, GetTypeDescription_Request


def described(request: GetTypeDescription_Request) -> GetTypeDescription.Response:
    """Describe a type of this process, and all that it contains, with the text of each definition if that is wanted.

    The answer says why, if the type is not known here or has another hash. A hash that is empty is not compared.
    """
    try:
        found = find(full_name(request.type_name))
    except InterfaceError as error:
        return _failed(str(error))
    if found is None:
        return _failed(f"{request.type_name} is not known here")
    if request.type_hash not in ("", type_hash(found)):
        return _failed(f"{request.type_name} has the hash {type_hash(found)} here, not {request.type_hash}")
    description = from_plain(TypeDescription, type_description(found))
    names = [found.__ros_type__, *(each.type_name for each in description.referenced_type_descriptions)]
    sources = [_source(name) for name in names if "_" not in name.rpartition("/")[2]]
    return GetTypeDescription.Response(
        successful=True, type_description=description, type_sources=sources if request.include_type_sources else ()
    )


def _failed(reason: str) -> GetTypeDescription.Response:
    return GetTypeDescription.Response(failure_reason=reason)


def _source(name: str) -> TypeSource:
    kind = find(name)
    assert kind is not None
    encoding = "msg" if issubclass(kind, Message) else name.split("/")[1]
    return TypeSource(type_name=name, encoding=encoding, raw_file_contents=definition_text(kind))
