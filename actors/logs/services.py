"""The levels of the loggers of a system as services of a node: ``~/get_logger_levels`` and ``~/set_logger_levels``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from actors.interfaces.rcl_interfaces.srv import (
    GetLoggerLevels,
    GetLoggerLevels_Request,
    GetLoggerLevels_Response,
    SetLoggerLevels,
    SetLoggerLevels_Request,
    SetLoggerLevels_Response,
)
from actors.logs.levels import LevelTree


def _get(levels: LevelTree, request: GetLoggerLevels_Request) -> GetLoggerLevels_Response:
    """The level that each logger has been given; 0 for one that has that of the logger above it."""
    found = tuple(LoggerLevel(name=name, level=int(levels.get(name))) for name in request.names)
    return GetLoggerLevels.Response(levels=found)


def _set(levels: LevelTree, request: SetLoggerLevels_Request) -> SetLoggerLevels_Response:
    """Set what can be set; 0 takes back the level of a logger. The answer has a result for each, in order."""
    results: list[SetLoggerLevelsResult] = []
    for one in request.levels:
        try:
            levels.set(one.name, one.level)
        except ValueError as error:
            results.append(SetLoggerLevelsResult(successful=False, reason=str(error)))
        else:
            results.append(SetLoggerLevelsResult(successful=True))
    return SetLoggerLevels.Response(results=tuple(results))


LOGGER_SERVICES: Final[Mapping[str, tuple[type[ServiceType[Any, Any]], Callable[[LevelTree, Any], Message]]]] = (
    MappingProxyType({"get_logger_levels": (GetLoggerLevels, _get), "set_logger_levels": (SetLoggerLevels, _set)})
)
"""The type of each of the two services, and what answers a request, by the last part of its name."""
