"""Random messages of any type, for properties and for the fuzzer."""

from __future__ import annotations

import math
import random
import string
from typing import Any

import robot.interfaces.tutorials  # noqa: F401  # makes the types of the robot and of the tutorials known
from actors.interfaces import Field, Message, get_action, get_message, get_service, known_names
from actors.interfaces.derived import event_message, feedback_message, get_result_service, send_goal_service
from actors.interfaces.fields import INTEGER_RANGES
from actors.interfaces.registry import find_definition

LETTERS = string.ascii_letters + string.digits + " _/äß€漢🤖"
INTERESTING = (0.0, -0.0, 1.0, -1.5, 0.1, 1e-40, 3.4e38, math.inf, -math.inf)


def shipped_types() -> list[type[Message]]:
    """Every message class that ships, with the parts of services and actions and the types derived from them."""
    found: list[type[Message]] = []
    for name in known_names():
        if find_definition(name) is None:  # a class that some module declares, not a definition
            continue
        kind = name.split("/")[1]
        if kind == "msg":
            found.append(get_message(name))
        elif kind == "srv":
            service: Any = get_service(name)
            found += [service.Request, service.Response, event_message(service)]
        else:
            action: Any = get_action(name)
            send: Any = send_goal_service(action)
            result: Any = get_result_service(action)
            found += [action.Goal, action.Result, action.Feedback, feedback_message(action)]
            found += [send.Request, send.Response, result.Request, result.Response]
    return found


def random_message(cls: type[Message], rng: random.Random, *, most: int = 4) -> Message:
    """A message with random fields; sequences without a bound have up to `most` elements."""
    return cls(**{field.name: _random_field(field, rng, most) for field in cls.__ros_fields__})


def _random_field(field: Field, rng: random.Random, most: int) -> Any:
    kind = field.type
    if not kind.is_array:
        return _random_element(field, rng, most)
    count = kind.size if kind.array == "fixed" else rng.randint(0, min(kind.size or most, most))
    return [_random_element(field, rng, most) for _ in range(count)]


def _random_element(field: Field, rng: random.Random, most: int) -> Any:
    base = field.type.base
    if field.message is not None:
        return random_message(field.message, rng, most=most)
    if base == "bool":
        return rng.random() < 0.5
    if base in INTEGER_RANGES:
        low, high = INTEGER_RANGES[base]
        return rng.choice((low, high, 0, rng.randint(low, high)))
    if base in {"float32", "float64"}:
        return rng.choice((*INTERESTING, rng.gauss(0.0, 100.0)))
    return "".join(rng.choice(LETTERS) for _ in range(rng.randint(0, field.type.string_bound or 9)))
