"""The passive checker on all kinds of trees: dynamic ones, factories, remapped names, streams and actions."""

from __future__ import annotations

from actors import Action, Child, Done, DynamicSupervisor, Node, Steps, Supervisor, Topic, publishes, qos, subscribes
from actors.check.checker import check_node, check_tree
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String

SCAN = Topic(String, "scan", qos.SENSOR_DATA)
COUNT = Action(Fibonacci, "count")


class Lidar(Node):
    """Publishes scan."""

    out = publishes(SCAN)


class Mapper(Node):
    """Takes scan, when it has time for it."""

    scans = subscribes(SCAN)


class Counter(Node):
    """Serves count."""

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(Fibonacci.Result())


def tree(*children: Child | DynamicSupervisor) -> Supervisor:
    return Supervisor("robot", children=children)


def test_a_stream_counts_as_a_reader_and_remapping_as_what_it_does() -> None:
    (finding,) = check_tree(tree(Child(Mapper)))
    assert "takes /scan, which nobody publishes" in finding.what
    assert check_tree(tree(Child(Mapper), Child(Lidar))) == ()
    (finding,) = check_tree(tree(Child(Mapper), Child(Lidar, remap={"scan": "front/scan"})))
    assert finding.where == "robot/mapper"
    assert (
        check_tree(tree(Child(Mapper, remap={"scan": "front/scan"}), Child(Lidar, remap={"scan": "front/scan"}))) == ()
    )


def test_two_servers_of_an_action_are_an_error() -> None:
    (finding,) = check_tree(tree(Child(Counter), Child(Counter, name="other")))
    assert (finding.level, finding.where) == ("error", "robot/other")
    assert "second server of /count, after robot/counter" in finding.what


def test_the_template_of_a_dynamic_supervisor_is_looked_at_and_a_factory_cannot_be() -> None:
    (finding,) = check_tree(tree(DynamicSupervisor("pool", Child(Mapper))))
    assert (finding.where, finding.what) == ("robot/pool/mapper", "it takes /scan, which nobody publishes")
    assert check_tree(tree(Child(lambda: Mapper(), name="made"))) == ()


def test_a_node_may_publish_one_topic_and_take_another() -> None:
    class Relay(Node):
        """Says again what it hears."""

        out = publishes(Topic(String, "said"))

        @SCAN.on()
        def hear(self, message: String) -> None: ...

    assert check_node(Relay) == ()


def test_the_names_of_streams_and_actions_are_looked_at_too() -> None:
    class Shouting(Node):
        """Takes and serves what is named against the style."""

        loud = subscribes(Topic(String, "LoudTopic"))

        @Action(Fibonacci, "LoudAction").serve()
        async def shout(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(Fibonacci.Result())

    assert [finding.where for finding in check_node(Shouting)] == ["Shouting.loud", "Shouting.shout"]


class Dreamer(Node):
    """Takes scna, which is a slip of the pen."""

    scans = subscribes(Topic(String, "scna", qos.SENSOR_DATA))


class Unsaid(Node):
    out = publishes(SCAN)


def test_the_topic_that_was_meant_is_named() -> None:
    (finding,) = check_tree(tree(Child(Dreamer), Child(Lidar)))
    assert str(finding) == (
        "warning: robot/dreamer: it takes /scna, which nobody publishes; publish it, remap it, or name it as external; "
        "did you mean '/scan'?"
    )


def test_what_concerns_one_class_by_itself_can_be_left_out() -> None:
    (finding,) = check_tree(tree(Child(Unsaid)))
    assert finding.what == "it has no docstring"
    assert check_tree(tree(Child(Unsaid)), each_node=False) == ()


def test_a_node_whose_name_says_little_gets_a_hint() -> None:
    lidars = [Child(Lidar, name=name) for name in ("node1", "FrontLidar", "rear_lidar")]
    hints = {finding.where: finding.what for finding in check_tree(tree(*lidars))}
    assert hints.keys() == {"robot/node1", "robot/FrontLidar"}
    assert "camera_driver" in hints["robot/node1"]
    assert "'front_lidar'" in hints["robot/FrontLidar"]
