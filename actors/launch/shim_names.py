"""The modules and names that `actors.launch.shim` offers to launch files, and where each of them is here."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

OPTIONAL: Final = frozenset({"lifecycle_msgs", "nav2_common"})
"""Packages that are not part of launch: where they are installed, they are used."""


def _from(module: str, *names: str) -> dict[str, str]:
    return {name: f"{module}:{name}" for name in names}


_VALUES = _from(
    "substitutions.values",
    "AnonName", "EnvironmentVariable", "ForEachVar", "ForLoopIndex", "LaunchConfiguration", "LaunchLogDir", "LocalSubstitution",
)  # fmt: skip
_LOGIC = _from(
    "substitutions.logic",
    "AllSubstitution", "AndSubstitution", "AnySubstitution", "EqualsSubstitution", "IfElseSubstitution", "NotEqualsSubstitution",
    "NotSubstitution", "OrSubstitution", "PythonExpression", "StringJoinSubstitution",
)  # fmt: skip
_PATHS = _from(
    "substitutions.paths",
    "Command", "FileContent", "FindExecutable", "PathJoinSubstitution", "PathSubstitution", "ThisLaunchFile", "ThisLaunchFileDir",
)  # fmt: skip
_ROS_PATHS = _from("substitutions.paths", "ExecutableInPackage", "FindPackage", "FindPackagePrefix", "FindPackageShare")
_SUBSTITUTIONS = {
    **_VALUES,
    **_LOGIC,
    **_PATHS,
    **_from("substitution", "TextSubstitution"),
    **_from("errors", "SubstitutionFailure"),
}
_CONFIGURATION = _from(
    "actions.configuration",
    "DeclareBooleanLaunchArgument", "DeclareLaunchArgument", "PopLaunchConfigurations", "PushLaunchConfigurations",
    "ResetLaunchConfigurations", "SetLaunchConfiguration", "UnsetLaunchConfiguration",
)  # fmt: skip
_ENVIRONMENT = _from(
    "actions.environment",
    "AppendEnvironmentVariable", "PopEnvironment", "PushEnvironment", "ReplaceEnvironmentVariables", "ResetEnvironment",
    "SetEnvironmentVariable", "UnsetEnvironmentVariable",
)  # fmt: skip
_EVENT_ACTIONS = _from(
    "actions.events",
    "EmitEvent", "Log", "LogDebug", "LogError", "LogInfo", "LogWarning", "RegisterEventHandler", "Shutdown", "TimerAction",
    "UnregisterEventHandler",
)  # fmt: skip
_ACTIONS = {
    **_CONFIGURATION,
    **_ENVIRONMENT,
    **_EVENT_ACTIONS,
    **_from("actions.groups", "ForEach", "ForLoop", "GroupAction", "OpaqueFunction"),
    **_from("loading", "IncludeLaunchDescription"),
    **_from("actions.processes", "ExecuteProcess"),
    "ExecuteLocal": "actions.processes:ExecuteProcess",
}
_CONDITIONS = _from(
    "conditions",
    "IfCondition", "LaunchConfigurationEquals", "LaunchConfigurationNotEquals", "UnlessCondition", "evaluate_condition_expression",
)  # fmt: skip
_HANDLERS = _from(
    "handlers",
    "OnExecutionComplete", "OnIncludeLaunchDescription", "OnProcessExit", "OnProcessIO", "OnProcessStart", "OnShutdown", "event_named",
)  # fmt: skip
_PROCESS_EVENTS = _from(
    "events",
    "ProcessExited", "ProcessIO", "ProcessStarted", "ProcessStderr", "ProcessStdout", "ShutdownProcess", "SignalProcess", "matches_executable",
    "matches_name", "matches_pid",
)  # fmt: skip
_SOURCE = "loading:LaunchDescriptionSource"
_SOURCES = {
    "AnyLaunchDescriptionSource": _SOURCE,
    "FrontendLaunchDescriptionSource": _SOURCE,
    "PythonLaunchDescriptionSource": _SOURCE,
    "load_python_launch_file_as_module": "loading:load_module",
}
_UTILITIES = _from(
    "utilities",
    "ensure_argument_type",
    "normalize_to_list_of_entities",
    "normalize_to_list_of_substitutions",
    "perform_substitutions",
)
_ROS_UTILITIES = _from(
    "utilities", "evaluate_parameters", "make_namespace_absolute", "normalize_parameters", "normalize_remap_rules", "prefix_namespace"
)  # fmt: skip
_PARAMETERS = _from("parameters", "Parameter", "ParameterFile", "ParameterValue")
_ROS_ACTIONS = {
    **_from("actions.composition", "ComposableNodeContainer", "LoadComposableNodes"),
    **_from("actions.nodes", "LifecycleNode", "LifecycleTransition", "Node"),
    **_from(
        "actions.configuration",
        "PushRosNamespace",
        "SetParameter",
        "SetParametersFromFile",
        "SetRemap",
        "SetUseSimTime",
    ),
    **_from("actions.environment", "SetROSLogDir"),
    **_from("actions.events", "RosTimer"),
    "PushROSNamespace": "actions.configuration:PushRosNamespace",
    "ROSTimer": "actions.events:RosTimer",
}
_COMPONENTS = _from("actions.composition", "ComposableLifecycleNode", "ComposableNode")
_ROS_SUBSTITUTIONS = {**_ROS_PATHS, **_from("substitutions.values", "Parameter")}

_TEST_MARKS = _from(
    "testing.marks", "ReadyAggregator", "parametrize", "post_shutdown_test", "ready_to_test_action_timeout"
)
_TEST_RECORDS = {
    **_from("testing.records", "IoHandler", "ProcInfoHandler"),
    "ActiveIoHandler": "testing.records:IoHandler",
    "ActiveProcInfoHandler": "testing.records:ProcInfoHandler",
}
_TEST_ASSERTS = {
    **_from(
        "testing.asserts",
        "EXIT_OK", "EXIT_SIGINT", "EXIT_SIGKILL", "EXIT_SIGQUIT", "EXIT_SIGSEGV", "SequentialTextChecker",
    ),
    "NO_CMD_ARGS": "testing.matching:NO_CMD_ARGS",
    "assertDefaultStream": "testing.asserts:assert_default_stream",
    "assertExitCodes": "testing.asserts:assert_exit_codes",
    "assertInStderr": "testing.asserts:assert_in_stderr",
    "assertInStdout": "testing.asserts:assert_in_stdout",
    "assertInStream": "testing.asserts:assert_in_stream",
    "assertSequentialStdout": "testing.asserts:assert_sequential_stdout",
}  # fmt: skip

_AMENT = _from(
    "packages_api",
    "PackageNotFoundError", "get_package_prefix", "get_package_share_directory", "get_package_share_path", "get_packages_with_prefixes",
)  # fmt: skip

NAMES: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {
        "launch": {
            **_from("entity", "Action", "LaunchDescription", "LaunchDescriptionEntity"),
            **_from("conditions", "Condition"),
            **_from("context", "LaunchContext"),
            **_from("events", "Event"),
            **_from("handlers", "EventHandler"),
            **_from("substitution", "Substitution"),
            **_from("service", "LaunchService"),
            **_from("utilities", "SomeEntitiesType", "SomeSubstitutionsType", "SomeSubstitutionsType_types_tuple"),
            "InvalidLaunchFileError": "errors:LaunchError",
            "LaunchDescriptionSource": _SOURCE,
        },
        "launch.action": _from("entity", "Action"),
        "launch.actions": _ACTIONS,
        "launch.condition": _from("conditions", "Condition"),
        "launch.conditions": {**_CONDITIONS, "InvalidConditionExpressionError": "errors:ConditionError"},
        "launch.event": _from("events", "Event"),
        "launch.event_handler": _from("handlers", "EventHandler"),
        "launch.event_handlers": _HANDLERS,
        "launch.events": _from(
            "events", "ExecutionComplete", "IncludeLaunchDescription", "Shutdown", "TimerEvent", "matches_action"
        ),
        "launch.events.matchers": _from("events", "matches_action"),
        "launch.events.process": _PROCESS_EVENTS,
        "launch.frontend": {},
        "launch.frontend.expose": {},
        "launch.launch_context": _from("context", "LaunchContext"),
        "launch.launch_description": _from("entity", "LaunchDescription"),
        "launch.launch_description_entity": _from("entity", "LaunchDescriptionEntity"),
        "launch.launch_service": _from("service", "LaunchService"),
        "launch.launch_description_source": {"LaunchDescriptionSource": _SOURCE},
        "launch.launch_description_sources": _SOURCES,
        "launch.logging": _from("utilities", "get_logger"),
        "launch.some_entities_type": _from("utilities", "SomeEntitiesType"),
        "launch.some_substitutions_type": _from(
            "utilities", "SomeSubstitutionsType", "SomeSubstitutionsType_types_tuple"
        ),
        "launch.substitution": _from("substitution", "Substitution"),
        "launch.substitutions": _SUBSTITUTIONS,
        "launch.utilities": _UTILITIES,
        "launch.utilities.type_utils": _from(
            "utilities", "is_substitution", "normalize_typed_substitution", "perform_typed_substitution"
        ),
        "launch_ros": {},
        "launch_ros.actions": _ROS_ACTIONS,
        "launch_ros.descriptions": {**_COMPONENTS, **_PARAMETERS},
        "launch_ros.event_handlers": _from("handlers", "OnStateTransition"),
        "launch_ros.events": {},
        "launch_ros.events.lifecycle": _from("events", "ChangeState", "StateTransition", "matches_node_name"),
        "launch_ros.events.matchers": _from("events", "matches_node_name"),
        "launch_ros.parameter_descriptions": _PARAMETERS,
        "launch_ros.substitutions": _ROS_SUBSTITUTIONS,
        "launch_ros.utilities": _ROS_UTILITIES,
        "launch_testing": {**_TEST_MARKS, **_TEST_RECORDS},
        "launch_testing.actions": _from("actions.events", "ReadyToTest"),
        "launch_testing.asserts": _TEST_ASSERTS,
        "launch_testing.event_handlers": _from("testing.marks", "StdoutReadyListener"),
        "launch_testing.legacy": _from("testing.legacy", "LaunchTestService"),
        "launch_testing.io_handler": _TEST_RECORDS,
        "launch_testing.markers": _from("testing.marks", "keep_alive", "retry_on_failure"),
        "launch_testing.proc_info_handler": _TEST_RECORDS,
        "launch_testing.tools": {
            **_from("testing.tools", "ProcessProxy", "basic_output_filter", "expect_output", "launch_process"),
        },
        "launch_testing.util": {
            **_from("testing.matching", "NO_CMD_ARGS", "NoMatchingProcessException"),
            "KeepAliveProc": "testing.marks:keep_alive_process",
            "resolveProcesses": "testing.matching:resolve_processes",
        },
        "launch_xml": {},
        "launch_xml.launch_description_sources": {"XMLLaunchDescriptionSource": _SOURCE},
        "launch_yaml": {},
        "launch_yaml.launch_description_sources": {"YAMLLaunchDescriptionSource": _SOURCE},
        "ament_index_python": {**_AMENT, **_from("packages_api", "has_resource")},
        "ament_index_python.packages": _AMENT,
        "ament_index_python.resources": _from("packages_api", "has_resource"),
        "lifecycle_msgs": {},
        "lifecycle_msgs.msg": _from("lifecycle", "State", "Transition", "TransitionEvent"),
        "nav2_common": {},
        "nav2_common.launch": _from(
            "nav2", "HasNodeParams", "LaunchConfigAsBool", "ParseMultiRobotPose", "ReplaceString", "RewrittenYaml"
        ),
    }
)
"""Module -> name -> MODULE:NAME below `actors.launch`."""
