"""`doctor`: each check on a graph that is made of values. What it measures is in every finding."""

from __future__ import annotations

import time

import pytest

from actors import QoS, qos
from actors.interfaces import encode
from actors.transport.figures import LeaseFigures, ProcessFigures
from actors.transport.protocol import RemoteEndpoint
from cli.graph.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, Endpoint
from cli.verbs.doctor import Result, examined, lines, tally
from cli.verbs.doctor.clocks import offsets, simulated_time
from cli.verbs.doctor.delays import ages, blocked, queues, restarts, timers
from cli.verbs.doctor.observation import Finding, Listened, Observation
from cli.verbs.doctor.observing import AllDomains, Reports, packages_named
from cli.verbs.doctor.services import node_is_there, polling, service_types, serving, twins
from cli.verbs.doctor.surroundings import domain, leases, packages, processes, security, transport
from cli.verbs.doctor.topics import best_effort_commands, names, quality, sending, types
from tests.cli.doctor_stage import end, figures, graph, handler, node, process, queue, served, timer
from tests.facts import lacks

TWIST = "geometry_msgs/msg/Twist"
SET_BOOL = "std_srvs/srv/SetBool"


def problems(seen: Observation) -> list[tuple[str, str]]:
    """The question and the subject of each problem, in order."""
    return [(title, one.subject) for title, found in examined(seen) for one in found if one.level == "problem"]


def working() -> Observation:
    return graph(
        end("/talker", PUBLISHER, "/chatter"),
        end("/listener", SUBSCRIPTION, "/chatter"),
        end("/listener", SERVER, "/enable", type=SET_BOOL),
        end("/talker", CLIENT, "/enable", type=SET_BOOL),
    )


def test_a_graph_that_works_has_no_problem_and_no_note() -> None:
    levels = {one.level for _, found in examined(working()) for one in found}
    assert levels == {"info"}


# -- topics -------------------------------------------------------------------------------------------------------------


def test_a_topic_without_publisher_is_told_with_similar_names() -> None:
    seen = graph(
        end("/joystick", PUBLISHER, "/cmd_vell", type=TWIST),
        end("/robot", SUBSCRIPTION, "/cmd_vel", type=TWIST),
        asked=("topic", "/cmd_vel"),
    )
    (found,) = names(seen)
    assert found.level == "problem"
    assert found.cause == "nobody publishes it; similar: /cmd_vell"
    assert found.measured == "0 publishers, 1 subscription (/robot); 1 topic published"


def test_a_topic_that_nobody_has_is_told_with_names_that_end_alike() -> None:
    (found,) = names(graph(end("/imu", PUBLISHER, "/left_front/data/imu"), asked=("topic", "/imu")))
    assert found.cause == "there is no such topic; similar: /left_front/data/imu"


def test_two_loose_ends_of_almost_one_name_and_of_one_type_are_a_problem() -> None:
    loose = (end("/talker", PUBLISHER, "/chater"), end("/listener", SUBSCRIPTION, "/chatter"))
    (found,) = names(graph(*loose))
    assert (found.level, found.subject) == ("problem", "/chatter")
    assert found.remedy.endswith("-r /chatter:=/chater")
    assert "/chater has 1 publisher (/talker), 0 subscriptions" in found.measured


def test_topics_that_every_node_has_and_hidden_ones_need_no_publisher() -> None:
    ends = (end("/log", SUBSCRIPTION, "/rosout"), end("/listener", SUBSCRIPTION, "/_hidden"))
    assert list(names(graph(*ends))) == []


def test_a_topic_and_a_service_of_one_name_are_not_mixed_up() -> None:
    ends = end("/a", PUBLISHER, "/state"), end("/b", SERVER, "/state", type=SET_BOOL), end("/c", CLIENT, "/state")
    assert list(service_types(graph(*ends, asked=("topic", "/state")))) == []
    assert [one.subject for one in service_types(graph(*ends, asked=("service", "/state")))] == ["/state"]


@pytest.mark.parametrize(
    "other",
    [
        end("/talker", PUBLISHER, "/chater", type=TWIST),
        end("/talker", PUBLISHER, "/leg_1/state"),
    ],
    ids=["another type", "another name"],
)
def test_a_subscription_that_waits_for_a_publisher_is_only_a_note(other: object) -> None:
    (found,) = names(graph(end("/listener", SUBSCRIPTION, "/chatter"), other))  # type: ignore[arg-type]
    assert (found.level, found.subject) == ("note", "/chatter")


def test_a_similar_topic_that_has_its_own_listener_is_no_reason_for_alarm() -> None:
    legs = [end("/gait", PUBLISHER, "/leg_1/state"), end("/log", SUBSCRIPTION, "/leg_1/state")]
    (found,) = names(graph(*legs, end("/log", SUBSCRIPTION, "/leg_2/state")))
    assert found.level == "note"


def test_quality_that_does_not_match_is_told_with_policy_both_ends_and_remedy() -> None:
    seen = graph(
        end("/camera", PUBLISHER, "/image", qos.SENSOR_DATA), end("/viewer", SUBSCRIPTION, "/image", QoS(depth=10))
    )
    (found,) = quality(seen)
    assert found.subject == "/image"
    assert "nothing reaches /viewer from /camera" in found.cause
    assert "reliability (offered best_effort, requested reliable)" in found.cause
    assert found.measured.startswith("/camera offers QoS(")
    assert "reliability=reliable" in found.remedy
    assert "the same profile" in found.remedy


def test_a_reliable_publisher_serves_a_subscription_of_best_effort() -> None:
    ends = end("/a", PUBLISHER, "/x", QoS(depth=10)), end("/b", SUBSCRIPTION, "/x", qos.SENSOR_DATA)
    assert list(quality(graph(*ends))) == []


def test_types_that_differ_are_told_with_who_uses_which() -> None:
    seen = graph(end("/a", PUBLISHER, "/x"), end("/b", SUBSCRIPTION, "/x", type=TWIST))
    (found,) = types(seen)
    assert found.cause.startswith("its ends have different types")
    assert found.measured == f"std_msgs/msg/String: /a; {TWIST}: /b"


def test_two_definitions_of_one_type_are_told_apart_by_their_hashes() -> None:
    (found,) = types(graph(end("/a", PUBLISHER, "/x"), end("/b", SUBSCRIPTION, "/x", type_hash="RIHS01_2")))
    assert found.measured == "std_msgs/msg/String (RIHS01_1): /a; std_msgs/msg/String (RIHS01_2): /b"
    assert "same version" in found.remedy


def test_a_topic_that_is_not_of_the_type_that_is_asked_for() -> None:
    seen = graph(end("/a", PUBLISHER, "/x"), asked=("topic", "/x"), wanted=TWIST)
    assert [one.cause for one in types(seen)] == [f"it is not of the type {TWIST}"]
    assert list(types(graph(end("/a", PUBLISHER, "/x"), asked=("topic", "/x"), wanted="std_msgs/msg/String"))) == []


def test_a_topic_is_examined_for_quality_then_names_then_data() -> None:
    titles = [title for title, _ in examined(graph(asked=("topic", "/sensor/data")))]
    asked = [title for title in titles if title in ("quality of service", "names of topics", "data")]
    assert asked == ["quality of service", "names of topics", "data"]


def test_a_publisher_that_sends_nothing_is_a_problem_and_one_that_sends_has_its_rate_measured() -> None:
    publisher = end("/sensor", PUBLISHER, "/sensor/data")
    (silent,) = sending(graph(publisher, listened={"/sensor/data": Listened(0, 1.0)}))
    assert (silent.level, silent.measured) == ("problem", "0 messages in 1.0 s, 0.0 Hz")
    assert "/sensor publishes it" in silent.cause
    (heard,) = sending(graph(publisher, listened={"/sensor/data": Listened(10, 2.0)}))
    assert (heard.level, heard.measured) == ("info", "10 messages in 2.0 s, 5.0 Hz")
    assert list(sending(graph(listened={"/sensor/data": Listened(0, 1.0)}))) == [], "names tells that"


def test_a_topic_of_commands_with_best_effort_is_flagged_on_either_side() -> None:
    seen = graph(
        end("/joystick", PUBLISHER, "/cmd_vel", QoS(depth=1)),
        end("/robot", SUBSCRIPTION, "/cmd_vel", qos.SENSOR_DATA),
    )
    (found,) = best_effort_commands(seen)
    assert (found.subject, found.measured) == ("/cmd_vel", "best effort: /robot (subscription), of 2 ends")
    (other,) = best_effort_commands(graph(end("/stick", PUBLISHER, "/arm/joint_commands", qos.SENSOR_DATA)))
    assert "/stick (publisher)" in other.measured


@pytest.mark.parametrize("name", ["/image", "/cmd_vel/image", "/commander_state"])
def test_sensor_data_may_be_best_effort(name: str) -> None:
    assert list(best_effort_commands(graph(end("/camera", PUBLISHER, name, qos.SENSOR_DATA)))) == []


# -- services and nodes ---------------------------------------------------------------------------------------------------


def test_a_service_whose_server_does_not_run() -> None:
    seen = graph(end("/ui", CLIENT, "/enable", type=SET_BOOL), asked=("service", "/enable"))
    (found,) = serving(seen)
    assert (found.level, found.cause) == ("problem", "its server is not running")
    assert found.measured == "0 servers, 1 client (/ui); 0 services served"


@pytest.mark.parametrize("there", ["/enabel", "/robot/front/left/enable"])
def test_a_service_that_is_served_under_almost_this_name(there: str) -> None:
    (found,) = serving(graph(end("/robot", SERVER, there, type=SET_BOOL), asked=("service", "/enable")))
    assert found.cause == f"no node serves this name; similar services: {there}"
    assert found.remedy.endswith(f"-r /enable:={there}")


def test_a_service_of_another_type() -> None:
    server = end("/robot", SERVER, "/enable", type="std_srvs/srv/Trigger")
    of_client = graph(server, end("/ui", CLIENT, "/enable", type=SET_BOOL), asked=("service", "/enable"))
    assert list(serving(of_client)) == []
    (found,) = service_types(of_client)
    assert found.measured == "std_srvs/srv/Trigger: /robot; std_srvs/srv/SetBool: /ui"
    (asked,) = service_types(graph(server, asked=("service", "/enable"), wanted=SET_BOOL))
    assert asked.cause == f"it is not of the type {SET_BOOL}"


def test_a_service_that_is_served_as_asked_has_no_problem() -> None:
    server = end("/robot", SERVER, "/enable", type=SET_BOOL)
    assert problems(graph(server, asked=("service", "/enable"), wanted=SET_BOOL)) == []


def test_a_client_that_waits_for_a_server_is_a_note_when_everything_is_examined() -> None:
    assert [one.level for one in serving(graph(end("/ui", CLIENT, "/enable", type=SET_BOOL)))] == ["note"]


def polled(calls: int, seconds: float, *clients: str) -> Observation:
    """A service that was called so often by these clients, of which the first is in another process."""
    told = process(
        [figures("/battery", services=[served("/get_battery", 100)])],
        [figures("/battery", services=[served("/get_battery", 100 + calls, *clients[1:])])],
        seconds,
    )
    ends = [end(client, CLIENT, "/get_battery") for client in clients[:1]]
    return graph(end("/battery", SERVER, "/get_battery"), *ends, told=(told,))


def test_a_client_that_calls_a_service_more_than_five_times_a_second_polls() -> None:
    (found,) = polling(polled(12, 2.0, "/ui"))
    assert found.subject == "/get_battery"
    assert found.cause.startswith("/ui polls it")
    assert lacks(found.measured, "6.0 second 1 client 5") == []
    assert found.remedy == "let /battery publish it as a topic"


def test_of_several_clients_one_polls_only_if_there_is_no_other_explanation() -> None:
    assert list(polling(polled(10, 2.0, "/ui"))) == [], "5 a second are not above 5"
    assert list(polling(polled(12, 2.0, "/ui", "/log"))) == [], "3 each"
    assert list(polling(polled(100, 1.0))) == [], "whoever called has gone"
    (found,) = polling(polled(12, 1.0, "/ui", "/log"))
    assert found.cause.startswith("one of /log, /ui polls it")


def test_two_nodes_of_one_name_are_counted_with_their_processes() -> None:
    seen = Observation(nodes=(node("/talker"), node("/talker", session="b" * 32), node("/listener")))
    (found,) = twins(seen)
    assert (found.subject, found.measured) == ("/talker", "2 nodes in 2 processes")
    assert list(twins(Observation(nodes=seen.nodes, asked=("node", "/listener")))) == []


def test_a_node_that_is_not_there_is_told_with_its_nearest_name_or_its_domain() -> None:
    near = Observation(nodes=(node("/talker"),), asked=("node", "/taker"))
    (found,) = node_is_there(near)
    assert lacks(found.cause, "node '/talker'") == []
    far = Observation(nodes=(node("/talker", domain=3),), asked=("node", "/talker"))
    (found,) = node_is_there(far)
    assert lacks(found.cause, "node domain 3") == []
    assert found.remedy == "export ROS_DOMAIN_ID=3"
    assert list(node_is_there(Observation(nodes=(node("/talker"),), asked=("node", "/talker")))) == []
    hidden = Observation(nodes=(node("/_hidden"),), asked=("node", "/_hidden"))
    assert list(node_is_there(hidden)) == []


def test_a_node_is_examined_with_all_its_ends_and_without_those_of_others() -> None:
    seen = graph(
        end("/camera", PUBLISHER, "/image", qos.SENSOR_DATA),
        end("/viewer", SUBSCRIPTION, "/image"),
        end("/ui", SUBSCRIPTION, "/chatter", type=TWIST),
        end("/talker", PUBLISHER, "/chatter"),
        asked=("node", "/viewer"),
    )
    assert problems(seen) == [("quality of service", "/image")]


# -- figures --------------------------------------------------------------------------------------------------------------


def slow(**more: object) -> Observation:
    """30 Hz, 50 ms callback, depth 60."""
    told = process(
        [figures("/viewer", queues=[queue("/image", 20, 59, 60, 400)], inbox_age=1.9)],
        [
            figures(
                "/viewer",
                queues=[queue("/image", 30, 60, 60, 430)],
                handlers=[handler("Eye.see", 0.05, 0.061)],
                inbox_age=1.97,
                waiting=60,
            )
        ],
    )
    ends = end("/camera", PUBLISHER, "/image", QoS(depth=60)), end("/viewer", SUBSCRIPTION, "/image", QoS(depth=60))
    return graph(*ends, told=(told,), **more)


def test_a_slow_handler_is_told_with_topic_age_fill_and_its_time() -> None:
    (found,) = ages(slow())
    assert found.subject == "/image"
    assert lacks(found.measured, "1.93 s 30.0 Hz 60 Eye.see 50 ms 61") == []
    assert "depth 1" in found.remedy


@pytest.mark.parametrize(
    ("waited", "waits", "came"),
    [(1, 1, 1), (0, 30, 30), (6, 6, 30), (60, 60, 0)],
    ids=["one of a slow topic", "a burst that has just come", "0.17 s", "nothing comes"],
)
def test_messages_that_wait_for_a_moment_are_not_old(waited: int, waits: int, came: int) -> None:
    told = process(
        [figures("/viewer", queues=[queue("/image", 0, waited, 60, 100)])],
        [figures("/viewer", queues=[queue("/image", 0, waits, 60, 100 + came)], inbox_age=0.034)],
    )
    assert list(ages(graph(told=(told,)))) == []


def test_the_age_of_what_is_no_message_is_that_of_the_node() -> None:
    told = process([figures("/viewer")], [figures("/viewer", inbox_age=0.5, waiting=1)])
    (found,) = ages(graph(told=(told,)))
    assert found.subject == "/viewer"
    assert lacks(found.measured, "0.50 s 1 inbox no handler") == []


def test_lost_messages_are_counted_with_queue_handler_and_the_quality_of_both_ends() -> None:
    (found,) = queues(slow())
    assert (found.level, found.subject) == ("problem", "/image")
    assert found.measured.startswith(
        "10 dropped in 1.0 s, 30 so far; 60 of 60 waiting, Eye.see takes 50 ms, at most 61 ms; "
    )
    assert found.measured.endswith(
        "offered QoS(keep_last 60, reliable, volatile), requested QoS(keep_last 60, reliable, volatile)"
    )


@pytest.mark.parametrize(("before", "after", "depth"), [(7, 7, 10), (0, 9, 1)], ids=["earlier", "depth 1"])
def test_messages_that_were_lost_earlier_or_by_choice_are_a_note(before: int, after: int, depth: int) -> None:
    told = process(
        [figures("/viewer", queues=[queue("/image", before, 0, depth)])],
        [figures("/viewer", queues=[queue("/image", after, 0, depth)])],
    )
    (found,) = queues(graph(told=(told,)))
    assert (found.level, f"{after} so far" in found.measured) == ("note", True)


def test_a_topic_is_examined_with_the_figures_of_its_ends_only() -> None:
    other = process([figures("/arm", inbox_age=3.0)], [figures("/arm", inbox_age=4.0, queues=[queue("/x", 5)])])
    seen = slow(asked=("topic", "/image"))
    both = graph(*seen.ends, told=(*seen.told, other), asked=("topic", "/image"))
    assert [one.subject for one in (*ages(both), *queues(both))] == ["/image", "/image"]


def late(fired: int, missed: int, blocked: int) -> Observation:
    nodes = [[figures("/gait", timers=[timer("step", 50, 100, 1, 1)])],
             [figures("/gait", timers=[timer("step", 50, 100 + fired, 1 + missed, 1 + blocked)],
                      handlers=[handler("Gait.step", 0.001, 0.2), handler("Gait.hear", 0.001, 0.002)])]]  # fmt: skip
    return graph(end("/gait", PUBLISHER, "/x"), told=(process(*nodes),))


def test_a_timer_that_loses_ticks_is_told_with_its_rate_and_the_slowest_handler() -> None:
    (found,) = timers(late(40, 10, 0))
    assert found.level == "problem"
    assert lacks(found.cause, "timer step ticks node busy") == []
    assert lacks(found.measured, "10 50 1.0 s Hz Gait.step 1 ms 200") == []
    assert list(timers(late(50, 0, 0))) == []
    (partly,) = timers(late(40, 10, 3))
    assert partly.cause == found.cause, "most of them are not the event loop's"


def test_a_handler_that_blocks_the_event_loop_is_told_for_its_process() -> None:
    seen = late(40, 10, 10)
    (found,) = blocked(seen)
    assert (found.level, found.subject) == ("problem", "process 7 of base")
    assert found.measured.startswith(
        "10 ticks of 50 of its timers lost by that in 1.0 s; slowest: Gait.step 1 ms, at most 200 ms"
    )
    (beside,) = timers(seen)
    assert lacks(beside.cause, "timer step ticks event loop late") == []
    assert list(blocked(late(40, 10, 0))) == []


def test_one_lost_tick_of_twenty_is_only_noted() -> None:
    levels = [one.level for seen in (late(19, 1, 1), late(18, 2, 2)) for one in (*timers(seen), *blocked(seen))]
    assert levels == ["note", "note", "problem", "problem"]


def test_a_node_that_is_restarted_again_and_again_is_a_problem_and_one_that_was_is_a_note() -> None:
    def told(before: int, after: int, state: str = "running") -> list[Finding]:
        pair = process([figures("/arm", restarts=before)], [figures("/arm", restarts=after, state=state)])
        return list(restarts(graph(told=(pair,))))

    assert [one.level for one in told(1, 2)] == ["problem"]
    assert [one.measured for one in told(1, 3)] == ["2 restarts in 1.0 s, 3 so far"]
    assert [one.level for one in told(2, 2)] == ["note"]
    assert [one.cause for one in told(0, 0, "stopped")] == ["it is stopped"]
    assert told(0, 0) == []


# -- surroundings -----------------------------------------------------------------------------------------------------------


def test_nodes_that_are_all_in_another_domain_are_told_with_the_variable_that_mends_it() -> None:
    (found,) = domain(Observation(domain=1, nodes=(node("/talker", domain=2),)))
    assert (found.level, found.cause) == ("problem", "all nodes are in another domain")
    assert found.measured == "ROS_DOMAIN_ID=1: 0 nodes; 1 node in domain 2"
    assert found.remedy == "export ROS_DOMAIN_ID=2"


def test_the_domain_is_told_with_others_that_are_seen_and_an_empty_graph_is_a_problem() -> None:
    (here,) = domain(Observation(nodes=(node("/a"), node("/_tool"), node("/b", domain=4))))
    assert (here.level, here.measured) == ("info", "ROS_DOMAIN_ID=0: 1 node; 1 node in domain 4")
    (empty,) = domain(Observation())
    assert (empty.level, empty.cause) == ("problem", "no nodes are found")


def test_each_process_is_told_with_its_domain_and_transport() -> None:
    told = process([figures("/a")], [figures("/a")])
    seen = Observation(
        nodes=(node("/a"), node("/b", number=1), node("/_tool", number=2), node("/c", session="b" * 32, domain=4)),
        processes=(told.last,),
    )
    assert [(one.subject, one.cause, one.measured) for one in processes(seen)] == [
        ("process 7 of base, robot", "domain 0, rmw_zenoh_cpp", "2 nodes"),
        ("process with session bbbbbbbb", "domain 4, rmw_zenoh_cpp", "1 node"),
    ]


def test_an_empty_rmw_implementation_is_the_default_transport_and_no_error() -> None:
    (found,) = transport(Observation())
    assert found.level == "info"
    assert (found.cause, found.measured) == ("rmw_zenoh_cpp, the default transport", "RMW_IMPLEMENTATION is empty")


def test_nodes_of_fast_dds_are_told_with_the_remedy_where_their_services_cannot_be_called() -> None:
    ends = tuple(
        Endpoint(RemoteEndpoint(node(name), SERVER, f"{name}/add", "pkg/srv/Add", "RIHS01_0", QoS(depth=10), gid))
        for name, gid in (("/fast", b"\x01\x0f" + bytes(14)), ("/cyclone", b"\x01\x10" + bytes(14)))
    )
    _, found = transport(Observation(implementation="rmw_cyclonedds_cpp", ends=ends))
    assert (found.level, found.measured) == ("note", "1 node: /fast")
    assert "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in found.remedy
    assert len(list(transport(Observation(implementation="rmw_zenoh_cpp", ends=ends)))) == 1
    assert len(list(transport(Observation(implementation="rmw_cyclonedds_cpp", ends=ends[1:])))) == 1


def test_the_transport_in_use_is_told() -> None:
    (found,) = transport(Observation(implementation="rmw_zenoh_cpp"))
    assert (found.cause, found.measured) == ("rmw_zenoh_cpp", "RMW_IMPLEMENTATION=rmw_zenoh_cpp")


def test_security_is_told_as_it_is() -> None:
    (off,) = security(Observation())
    assert off.cause.startswith("off")
    (on,) = security(Observation(security=("name         robot", "TLS          mutual")))
    assert (on.cause[:2], on.measured) == ("on", "name robot; TLS mutual")


def test_a_second_package_named_robot_is_found_on_the_path(tmp_path: object) -> None:
    from pathlib import Path

    import robot

    folder = Path(str(tmp_path))
    (folder / "a").mkdir()
    (folder / "a" / "robot.py").write_text("")
    (folder / "b" / "robot").mkdir(parents=True)
    (folder / "b" / "robot" / "__init__.py").write_text("")
    (folder / "b" / "robots.py").write_text("")
    path = [str(folder / name) for name in ("a", "b", "a", "missing")]
    found = packages_named("robot", path)
    assert found == (robot.__file__, f"{folder}/a/robot.py", f"{folder}/b/robot/__init__.py")
    (told,) = packages(Observation(robots=found))
    assert told.measured == f"used: {robot.__file__}; hidden: {folder}/a/robot.py, {folder}/b/robot/__init__.py"
    assert list(packages(Observation(robots=packages_named("robot", [])))) == []
    assert len(list(packages(Observation(robots=packages_named("robot", path[:1]))))) == 1


# -- the report -------------------------------------------------------------------------------------------------------------


def test_the_report_says_what_is_well_and_counts_what_is_not() -> None:
    found = Finding("/x", "nothing comes", "0 messages", "wait")
    info = Finding("domain", "0", "1 node", level="info")
    results = [Result("types", ()), Result("data", (found,)), Result("domain", (info,))]
    assert list(lines(results)) == [
        "ok       types",
        "problem  data: /x: nothing comes",
        "         measured: 0 messages",
        "         remedy: wait",
        "info     domain: 0",
        "         measured: 1 node",
    ]
    assert tally(results) == "1 problem, 0 notes"


def test_figures_of_hidden_nodes_are_not_examined() -> None:
    told = process([figures("/_tool", inbox_age=9.0)], [figures("/_tool", inbox_age=9.0)])
    assert list(ages(Observation(told=(told,)))) == []


# -- clocks -------------------------------------------------------------------------------------------------------------


def test_simulated_time_that_nobody_gives_is_told_with_the_nodes_that_wait_for_it() -> None:
    (found,) = simulated_time(graph(end("/gait", SUBSCRIPTION, "/clock"), end("/planner", SUBSCRIPTION, "/clock")))
    assert (found.level, found.subject) == ("problem", "/clock")
    assert found.cause.startswith("/gait, /planner: use_sim_time is set, and nobody publishes the time")
    assert lacks(found.measured, "0 /clock 2 nodes") == []
    assert "robactor param set /gait use_sim_time false" in found.remedy


def test_a_clock_with_two_publishers_and_nodes_that_do_not_use_it_are_told() -> None:
    given = end("/simulator", PUBLISHER, "/clock"), end("/gait", SUBSCRIPTION, "/clock")
    assert list(simulated_time(graph(*given))) == []
    (twice,) = simulated_time(graph(*given, end("/player", PUBLISHER, "/clock")))
    assert twice.level == "problem"
    assert lacks(twice.cause, "/player /simulator time jumps") == []
    (mixed,) = simulated_time(graph(*given, end("/camera", PUBLISHER, "/image")))
    assert (mixed.level, mixed.cause.split(":")[0]) == ("note", "/camera")
    assert (
        list(simulated_time(graph(end("/simulator", PUBLISHER, "/clock"), end("/camera", PUBLISHER, "/image")))) == []
    )


@pytest.mark.parametrize(
    ("lag", "level"), [(0.02, None), (0.3, "note"), (-0.3, "note"), (2.0, "problem"), (-40.0, "problem")]
)
def test_a_machine_whose_clock_differs_is_told_with_the_measured_time(lag: float, level: str | None) -> None:
    told = process([figures("/a")], [figures("/a")])
    found = list(offsets(graph(told=(told,), processes=(told.last,), lags={told.last.session: lag})))
    assert [one.level for one in found] == ([] if level is None else [level])
    for one in found:
        assert one.subject == "process 7 of base"
        assert one.measured.startswith(f"at least {abs(lag):.3f} s between sending and arrival")
        assert ("ahead" in one.cause) == (lag < 0)


def test_the_times_in_the_messages_of_a_topic_are_compared_unless_they_are_kept_for_who_comes_late() -> None:
    heard = {"/sensor/data": Listened(10, 2.0, 5.0)}
    (found,) = offsets(graph(end("/eye", PUBLISHER, "/sensor/data"), listened=heard))
    assert (found.level, found.subject) == ("problem", "/sensor/data")
    assert list(offsets(graph(end("/eye", PUBLISHER, "/sensor/data", qos.LATCHED), listened=heard))) == []
    assert (
        list(offsets(graph(end("/eye", PUBLISHER, "/sensor/data"), listened={"/sensor/data": Listened(0, 1.0)}))) == []
    )


async def test_the_least_difference_of_the_reports_of_a_process_counts() -> None:
    told, reports = process([figures("/a")], [figures("/a")]), Reports()
    for seconds in (7, 3, 90):
        sent = time.time_ns() - seconds * 10**9
        reports.take((), b"g" * 16, 1, sent, encode(told.last), None)
    assert reports.lags == {told.last.session: pytest.approx(3.0, abs=0.5)}


async def test_what_cannot_be_read_is_no_report() -> None:
    reports = Reports()
    reports.take((), b"g" * 16, 1, 0, b"\x00", None)
    assert reports.twice() == ()


async def test_the_nodes_of_all_domains_are_known_and_the_ends_of_one() -> None:
    graphs = AllDomains(7)
    nodes = [node(name, domain=number) for name, number in (("/a", 7), ("/b", 8))]
    ends = [
        RemoteEndpoint(one, PUBLISHER, "/data", "pkg/msg/T", "RIHS01_0", QoS(depth=1), one.fqn.encode())
        for one in nodes
    ]
    for one, its in zip(nodes, ends, strict=True):
        graphs.node(one, True)
        graphs.appeared(its)
    assert [(one.fqn, one.domain_id) for one in graphs.everywhere()] == [("/a", 7), ("/b", 8)]
    assert (graphs.nodes(), [one.node for one in graphs.endpoints(PUBLISHER)]) == (["/a"], ["/a"])
    for one, its in zip(nodes, ends, strict=True):
        graphs.vanished(its)
        graphs.node(one, False)
    assert (graphs.everywhere(), graphs.nodes(), graphs.endpoints(PUBLISHER)) == ((), [], [])


async def test_a_process_that_has_told_once_has_not_told_twice() -> None:
    told = process([figures("/a")], [figures("/a", handled=5)])
    reports = Reports()
    reports.take((), b"g" * 16, 1, 0, encode(told.before), None)
    assert (reports.twice(), list(reports.last)) == ((), [told.before.session])
    reports.take((), b"g" * 16, 2, 0, encode(told.last), None)
    assert reports.twice() == (told,)


def test_the_machines_that_a_tree_gives_its_parts_to_are_named_and_one_that_cannot_be_reached_is_a_problem() -> None:
    told = [LeaseFigures(host="base", left=2.84, parts=2), LeaseFigures(host="spare", left=0.0, parts=1)]
    of = ProcessFigures(
        host="robot", process=7, session="a", program="robot", at=1.0, cpu=0.0, memory=0, unreadable=0, leases=told
    )
    assert list(leases(Observation(processes=(of,)))) == [
        Finding(
            "host base", "works for process 7 of robot, robot", "2.8 s of its lease are left; 2 parts", level="info"
        ),
        Finding(
            "host spare",
            "cannot be reached by process 7 of robot, robot",
            "its agent holds no lease",
            "start robactor agent there, or look at the network between them",
        ),
    ]
