"""The names of rclpy's `Node` that are missing here, and old names: reading one raises an error that says what to write instead."""

from __future__ import annotations

from typing import Final, NoReturn

_TIMER: Final = "write @every(hz=10) above the method, or call self.create_timer(0.1, callback)"
_PARAMETER: Final = "write `speed = parameter(0.5)` in the class body and read it as self.speed"
_READ: Final = "read the parameter as an attribute, self.speed"
_SET: Final = "call self.set_parameter('speed', 1.0), or self.set_parameters({...}) for several, all or none"
_CALLBACK: Final = (
    "write @speed.validate or @speed.changed above a method; for whole sets there are pre_set, on_set and post_set"
)
_SPIN: Final = "handlers run by themselves; await what you wait for. A whole program is spin(Talker), of actors"
_DESTROY: Final = "what a node has ends with it; self.stop() ends the node itself"
_GRAPH: Final = "graph_of(self) has it; system.snapshot() shows all nodes, topics, services and actions"
_COUNT: Final = "call it on graph_of(self); self.subscription(TOPIC).publisher_count counts those that match"
_CALL: Final = "no client is made: `answer = await self.call(SERVICE, request)`"
_GOAL: Final = "no client is made: `async with self.send_goal(ACTION, goal) as goal`"
_GROUPS: Final = "a node's handlers run one after another; write concurrent=n on those that wait"
_SERVE: Final = "write @SERVICE.serve() above an async method, or call self.serve(SERVICE, handler)"

_REMEDIES: Final[dict[str, str]] = {
    "create_publisher": "write `cmd = publishes(TOPIC)` in the class body, or call self.publisher(TOPIC)",
    "create_subscription": "write @TOPIC.on() above the method, or call self.on(TOPIC, handler)",
    "create_service": _SERVE,
    "create_action_server": "write @ACTION.serve() above an async generator",
    "create_guard_condition": "call the method; from another thread, self.threadsafe(function)",
    "get_logger": "log by self.log, as in self.log.info('ready', speed=0.5)",
    "logger": "log by self.log, as in self.log.info('ready', speed=0.5)",
    "get_clock": "the clock is self.clock: .now(), .stamp() for headers, `await self.clock.sleep(1.0)`",
    "get_name": "it is self.name",
    "get_namespace": "it is self.namespace",
    "get_fully_qualified_name": "it is self.fqn",
    "set_parameters_atomically": _SET,
    "undeclare_parameter": _PARAMETER,
    "set_descriptor": "give ge=, le=, step=, choices=, description= and read_only= to parameter(...)",
    "resolve_topic_name": "self.publisher(TOPIC) and self.subscription(TOPIC) show the full name",
    "default_callback_group": _GROUPS,
    "executor": _SPIN,
    "context": "run(tree) makes the system and ends it; there is nothing to initialize",
    "wait_for_service": "call `await self.wait_for(SERVICE, timeout=5.0)`; a call waits for its server, too",
    "wait_for_server": "call `await self.wait_for(ACTION, timeout=5.0)`; a goal waits for its server, too",
    "call_async": "call `await self.call(SERVICE, request)`",
    "send_goal_async": _GOAL,
    "publish": "publish by the attribute of `cmd = publishes(TOPIC)`: self.cmd(message)",
    "destroy_node": _DESTROY,
    "trigger_configure": "call `await self.change_state('configure')`, or bring_up(system) for all",
    "trigger_activate": "call `await self.change_state('activate')`, or bring_up(system) for all",
    "create_lifecycle_publisher": "write `cmd = publishes(TOPIC)` in the class body: it delivers while the node is active",
    "create_wall_timer": _TIMER,
    **dict.fromkeys(("create_client",), _CALL),
    **dict.fromkeys(("create_action_client",), _GOAL),
    **dict.fromkeys(("declare_parameters",), _PARAMETER),
    **dict.fromkeys(
        (
            "get_parameters",
            "get_parameter_or",
            "get_parameter_type",
            "get_parameter_types",
            "describe_parameter",
            "describe_parameters",
            "list_parameters",
        ),
        _READ,
    ),
    **dict.fromkeys(
        (
            "add_on_set_parameters_callback",
            "add_pre_set_parameters_callback",
            "add_post_set_parameters_callback",
            "remove_on_set_parameters_callback",
            "remove_pre_set_parameters_callback",
            "remove_post_set_parameters_callback",
        ),
        _CALLBACK,
    ),
    **dict.fromkeys(("spin", "spin_once", "spin_until_future_complete", "init", "shutdown", "ok"), _SPIN),
    **dict.fromkeys(
        (
            "destroy_timer",
            "destroy_publisher",
            "destroy_subscription",
            "destroy_service",
            "destroy_client",
            "destroy_rate",
            "destroy_guard_condition",
        ),
        _DESTROY,
    ),
    **dict.fromkeys(("count_publishers", "count_subscribers"), _COUNT),
    **dict.fromkeys(
        (
            "count_clients",
            "count_services",
            "get_topic_names_and_types",
            "get_service_names_and_types",
            "get_node_names",
            "get_node_names_and_namespaces",
            "get_publishers_info_by_topic",
            "get_subscriptions_info_by_topic",
            "get_publisher_names_and_types_by_node",
            "get_subscriber_names_and_types_by_node",
            "get_service_names_and_types_by_node",
            "get_client_names_and_types_by_node",
            "wait_for_node",
        ),
        _GRAPH,
    ),
}
"""Name in rclpy -> the text that says what to write here."""


class NotHere(AttributeError):
    """A name of rclpy, or an old one, that an object does not have; the text says what to write instead."""


class Missing:
    """A descriptor for a missing name: reading it raises `NotHere`, ``hasattr`` is False, and a class below may define the name."""

    __slots__ = ("name", "remedy")

    def __init__(self, name: str, remedy: str) -> None:
        self.name = name
        self.remedy = remedy

    def __get__(self, instance: object, owner: type) -> NoReturn:
        raise NotHere(f"{owner.__name__} has no {self.name!r}{self.remedy}", name=self.name)


class Habits:
    """The base of `Node` with rclpy's names. Descriptors, because a `__getattr__` would slow down every attribute of every node."""

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not isinstance(vars(Habits).get(name), Missing)]


for _name, _remedy in _REMEDIES.items():
    setattr(Habits, _name, Missing(_name, f", which is rclpy's: {_remedy}; see docs/start/from-rclpy.md"))
for _name, _remedy in {
    "spawn": ": a task of the node is made by `self.create_task(work())`",
    "start": ": a goal is sent by `async with self.send_goal(ACTION, goal) as goal`",
}.items():
    setattr(Habits, _name, Missing(_name, _remedy))
