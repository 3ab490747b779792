"""A bag without a journal is played to a node by its topics; what the bag lacks is said first, and the verdict says what it can say."""

from __future__ import annotations

from pathlib import Path

import pytest

from actors import (
    Child,
    DeclarationError,
    LifecycleNode,
    Node,
    Service,
    Topic,
    background,
    every,
    execute,
    parameter,
    publishes,
    run,
)
from actors.bag import BagReader, BagTopic, BagWriter, Recorder, RecordOptions, Selection, topic_of
from actors.interfaces import encode
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.std_msgs.msg import Header, Int32, String
from actors.interfaces.std_srvs.srv import SetBool, SetBool_Request, SetBool_Response
from actors.logs import LogRecord
from actors.replay import ReplayError, TopicsVerdict, replay_topics
from tests.actors.replay.story import HERO, NUMBERS, OTHERS, Others, Visitor, lived

SUMS = Topic(Int32, "sums", 100)
STAMPED = Topic(Header, "stamped", 100)
SHOUTED = Topic(String, "shouted", 100)
FLIP = Service(SetBool, "flip")


class Adder(Node):
    """Adds numbers, and tells the sum and when it was told."""

    sums = publishes(SUMS)
    stamped = publishes(STAMPED)
    most = parameter(1000)

    async def on_start(self) -> None:
        self.total = 0

    @NUMBERS.on()
    def add(self, message: Int32) -> None:
        self.total = min(self.most, self.total + message.data)
        self.sums(Int32(data=self.total))
        self.stamped(Header(stamp=Time(sec=self.clock.wall_ns() // 1_000_000_000), frame_id=str(self.total)))


class Twice(Adder):
    """With a fault in it."""

    @NUMBERS.on()
    def add(self, message: Int32) -> None:
        super().add(Int32(data=message.data * (2 if message.data == 7 else 1)))


class Mute(Adder):
    """Does not tell the last of it."""

    @NUMBERS.on()
    def add(self, message: Int32) -> None:
        if message.data < 20:
            super().add(message)


class Chatty(Adder):
    """Tells more, and on a topic that nobody has recorded."""

    shouted = publishes(SHOUTED)

    async def on_start(self) -> None:
        await super().on_start()
        self.shouted(String(data="here"))
        self.sums(Int32(data=0))

    @every(hz=2)
    def shout(self) -> None:
        self.shouted(String(data="still here"))


class Slow(Adder):
    """Tells it a little later."""

    @NUMBERS.on()
    async def add(self, message: Int32) -> None:  # type: ignore[override]
        await self.clock.sleep(0.005)
        super().add(message)


class Breaking(Adder):
    """Crashes."""

    @NUMBERS.on()
    def add(self, message: Int32) -> None:
        raise ZeroDivisionError("at the first number")


class Unable(Adder):
    """Cannot start."""

    async def on_start(self) -> None:
        raise OSError("no such device")


class Flipped(Node):
    """Tells what it was asked for."""

    shouted = publishes(SHOUTED)
    introspection = parameter("off", name="service_configure_introspection", choices=("off", "metadata", "contents"))

    @FLIP.serve()
    async def flip(self, request: SetBool_Request) -> SetBool_Response:
        self.shouted(String(data=f"asked for {request.data}"))
        return SetBool.Response(success=True)


class Flipping(Node):
    """Asks for it."""

    @background
    async def asks(self) -> None:
        await self.clock.sleep(0.1)
        for data in (True, False):
            await self.call(FLIP, SetBool.Request(data=data))


def bag_of(path: Path, *nodes: Child | type[Node], seconds: float = 0.3, **selection: object) -> Path:
    selected = Selection(**(selection or {"all_topics": True}))  # type: ignore[arg-type]

    async def main() -> None:
        async with run(Child(Recorder, args=(path, RecordOptions(selection=selected))), *nodes, sinks=()) as system:
            await system.clock.sleep(seconds)

    execute(main, clock="virtual")
    return path


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Numbers and their sums."""
    return bag_of(tmp_path_factory.mktemp("bags") / "walk", Adder, Others)


def first(verdict: TopicsVerdict) -> tuple[str, object, object]:
    (found,) = [one for one in verdict.differences if one.name == "/sums"]
    return found.field, found.recorded, found.replayed


def test_a_node_is_fed_the_topics_that_it_hears_and_told_to_do_no_otherwise(walk: Path) -> None:
    verdict = replay_topics(walk, Adder)
    with BagReader(walk) as bag:
        counts = {topic.name: count for topic, count in bag.metadata.topics.items()}
    assert verdict.equal
    assert verdict.node == "/adder"
    assert counts["/numbers"] > 25
    assert dict(verdict.fed) == {"/numbers": counts["/numbers"]}
    assert dict(verdict.compared) == {"/sums": counts["/sums"], "/stamped": counts["/stamped"]}
    assert verdict.lacking == (
        "parameters (most): their defaults are taken",
        "its state where the bag begins: it has just started",
    )


def test_a_changed_node_differs_at_its_first_effect_by_topic_number_and_field(walk: Path) -> None:
    verdict = replay_topics(walk, Twice, parameters={"most": 1000})
    found = next(one for one in verdict.differences if one.name == "/sums")
    with BagReader(walk) as bag:
        arrived = [one.received_ns for one in bag.messages({"/sums"})]
        begin = bag.metadata.start_ns
    assert not verdict.equal
    assert found.recorded - sum(range(8)) == found.replayed - sum(range(8)) - 7
    assert found.field == "data"
    assert found.time == pytest.approx((arrived[found.number] - begin) / 1e9, abs=1e-6)
    assert "their defaults" not in " ".join(verdict.lacking)


def test_a_parameter_shows_where_the_node_would_have_done_otherwise(walk: Path) -> None:
    assert first(replay_topics(walk, Adder, parameters={"most": 10})) == ("data", 15, 10)


@pytest.mark.parametrize(
    ("parameters", "text"),
    [({"mots": 1}, "there is no parameter 'mots'; did you mean 'most'?"), ({"most": "much"}, "most")],
)
def test_a_parameter_that_the_node_cannot_have_is_refused_in_one_line(
    walk: Path, parameters: dict[str, object], text: str
) -> None:
    lines: list[LogRecord] = []
    with pytest.raises(ReplayError) as refused:
        replay_topics(walk, Adder, parameters=parameters, sinks=(lines.append,))
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)
    assert lines == []


def test_what_the_node_does_not_send_any_more_and_what_it_sends_beyond_the_bag_are_told(walk: Path) -> None:
    assert first(replay_topics(walk, Mute))[2] == "nothing"
    chatty = replay_topics(walk, Chatty)
    assert first(chatty) == ("data", 1, 0)  # it sends one more, before the others
    assert "/shouted" not in {one.name for one in chatty.differences}  # the bag has no such topic
    assert "phase of its timers (shout): they begin with the replay" in chatty.lacking


def test_a_message_too_many_is_a_difference_within_the_bag_and_none_after_its_end(walk: Path) -> None:
    with BagReader(walk) as bag:
        count = sum(1 for _ in bag.messages({"/numbers"}))

    class Again(Adder):
        heard = at = 0
        late = 0.0

        @NUMBERS.on()
        async def add(self, message: Int32) -> None:  # type: ignore[override]
            super().add(message)
            self.heard += 1
            if self.heard == self.at:
                await self.clock.sleep(self.late)
                self.sums(Int32(data=-1))

    class Within(Again):
        at = count - 3
        late = 0.001

    class Afterwards(Again):
        at = count
        late = 0.5

    assert first(replay_topics(walk, Within))[2] == -1
    assert replay_topics(walk, Afterwards).equal


def test_what_a_node_was_still_doing_when_the_bag_ended_is_waited_for_and_no_more_is_asked(walk: Path) -> None:
    assert replay_topics(walk, Slow).equal


def test_a_node_that_crashes_is_not_restarted_and_its_error_is_told(walk: Path) -> None:
    verdict = replay_topics(walk, Breaking)
    assert verdict.failure == "ZeroDivisionError: at the first number"
    assert not verdict.equal
    assert first(verdict)[1:] == (Int32(data=1), "nothing")


def test_a_node_that_cannot_start_or_run_alone_is_refused_with_the_reason(walk: Path) -> None:
    class Device:
        no_replay = "is a device"

    with pytest.raises(ReplayError, match="unable did not start: it raised OSError: no such device"):
        replay_topics(walk, Unable)
    with pytest.raises(ReplayError, match="its argument Device is a device"):
        replay_topics(walk, Child(Adder, args=(Device(),)))
    with pytest.raises(DeclarationError):
        replay_topics(walk, "adder")  # type: ignore[arg-type]


def test_all_inputs_that_a_bag_of_topics_cannot_have_are_listed(tmp_path: Path) -> None:
    async def main() -> None:
        recorder = Child(Recorder, args=(tmp_path / "walk", RecordOptions(selection=Selection(topics=["/told"]))))
        async with run(recorder, OTHERS, HERO, Visitor, sinks=(), seed=5) as system:
            await lived(system, 0.1)

    execute(main, clock="virtual")
    verdict = replay_topics(tmp_path / "walk", HERO)
    assert verdict.lacking == (
        "topic /map: the bag does not have it",
        "topic /numbers: the bag does not have it",
        "topic /slowly: the bag does not have it",
        "topic /streamed: the bag does not have it",
        "requests of service /ask_many",
        "requests of service /switch",
        "goals of action /climb",
        "answers of action /count",
        "answers of service /ask",
        "answers of service /failing",
        "phase of its timers (tick): they begin with the replay",
        "parameters (factor): their defaults are taken",
        "its state where the bag begins: it has just started",
    )
    assert not verdict.fed
    assert set(verdict.compared) == {"/told"}


def test_a_lifecycle_node_is_said_to_wait_for_requests(walk: Path) -> None:
    class Machine(LifecycleNode):
        @NUMBERS.on()
        def hear(self, message: Int32) -> None:
            pass

    verdict = replay_topics(walk, Machine)
    assert "requests to change its lifecycle state" in verdict.lacking
    assert not verdict.equal, "nothing was compared"


def test_recorded_requests_are_sent_again(tmp_path: Path) -> None:
    told = {"service_configure_introspection": "contents"}
    path = bag_of(tmp_path / "walk", Child(Flipped, parameters=told), Flipping, all_topics=True, all_services=True)
    verdict = replay_topics(path, Flipped)
    assert verdict.equal
    assert dict(verdict.compared) == {"/shouted": 2}
    assert not any("/flip" in text for text in verdict.lacking)


def test_a_topic_on_which_the_node_and_others_have_published_is_neither_fed_nor_compared(tmp_path: Path) -> None:
    class Echo(Node):
        numbers = publishes(NUMBERS.replace(qos=7) if hasattr(NUMBERS, "replace") else Topic(Int32, "numbers", 7))

        @NUMBERS.on()
        def hear(self, message: Int32) -> None:
            if message.data == 3:
                self.numbers(Int32(data=-1))

    verdict = replay_topics(bag_of(tmp_path / "walk", Echo, Others), Echo)
    assert dict(verdict.fed) == dict(verdict.compared) == {}
    assert "topic /numbers: what others have sent there, where the node publishes itself" in verdict.lacking
    assert "which of several publishers has sent what on /numbers: it is not compared" in verdict.lacking


def test_a_debugger_stops_where_the_message_is_published(walk: Path) -> None:
    stops: list[str] = []
    assert replay_topics(walk, Adder, pause=("/sums", 3), debugger=lambda: stops.append("here")).equal
    assert stops == ["here"]


def test_time_is_that_of_the_bag(walk: Path) -> None:
    seen: list[int] = []

    class Looking(Adder):
        @NUMBERS.on()
        def add(self, message: Int32) -> None:
            seen.append(self.clock.wall_ns())
            super().add(message)

    with BagReader(walk) as bag:
        arrived = [one.received_ns for one in bag.messages({"/numbers"})]
    assert replay_topics(walk, Looking).equal
    assert seen == pytest.approx(arrived, abs=1000)


def test_what_comes_beyond_the_last_recorded_message_but_within_the_bag_is_told(tmp_path: Path) -> None:
    class Brief(Adder):
        @NUMBERS.on()
        def add(self, message: Int32) -> None:
            if message.data < 10:
                super().add(message)

    path = bag_of(tmp_path / "brief", Child(Brief, name="adder"), Others)
    (sums, stamped) = replay_topics(path, Adder).differences
    assert (sums.name, sums.recorded, sums.replayed) == ("/sums", "nothing", Int32(data=sum(range(11))))
    assert stamped.name == "/stamped"


def written(path: Path, *messages: tuple[BagTopic, bytes]) -> Path:
    with BagWriter(path) as bag:
        for number, (topic, data) in enumerate(messages):
            at = 1_700_000_000_000_000_000 + number * 10_000_000
            bag.write(topic, data, received_ns=at, published_ns=at)
    return path


def test_topics_of_types_of_which_nothing_is_known_are_not_offered_to_the_node(tmp_path: Path) -> None:
    three = encode(Int32(data=3))
    unknown = BagTopic("/strange", "strange_msgs/msg/Strange")
    requests = BagTopic("/flip/_service_event", "strange_srvs/srv/Strange_Event", schema="int32 data\n")
    numbers, sums = topic_of("/numbers", Int32), topic_of("/sums", Int32)
    messages = ((unknown, three), (requests, three), (numbers, three), (sums, three))
    path = written(tmp_path / "walk", *messages)
    verdict = replay_topics(path, Adder)
    assert (verdict.equal, dict(verdict.fed), dict(verdict.compared)) == (True, {"/numbers": 1}, {"/sums": 1})
    assert "requests of service /flip" in replay_topics(path, Flipped).lacking


def test_a_topic_of_which_the_bag_does_not_tell_the_publishers_is_compared(tmp_path: Path) -> None:
    told = BagTopic("/sums", "std_msgs/msg/Int32", offered_qos_profiles="- history: nonsense")
    three, four = encode(Int32(data=3)), encode(Int32(data=4))
    path = written(tmp_path / "walk", (topic_of("/numbers", Int32), three), (told, four))
    assert first(replay_topics(path, Adder)) == ("data", 4, 3)
