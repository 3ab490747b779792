"""Blocking programs: functions that take a blocking node, its streams and its goals, by their types."""


from actors import Action, Child, Done, Node, Service, Steps, Supervisor, Topic, blocking, every, publishes
from actors.blocking import BlockingGoal, BlockingNode, BlockingStream, InsideEventLoop, OpenBlockingNode
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String

WORDS = Topic(String, "words")
ADD = Service(AddTwoInts, "add")
COUNT = Action(Fibonacci, "count")


class Adder(Node):
    @ADD.serve(concurrent=3)
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.clock.sleep(1.0)
        return AddTwoInts.Response(sum=request.a + request.b)


class Talker(Node):
    words = publishes(WORDS)

    @every(hz=1)
    async def talk(self) -> None:
        self.words(String(data=self.fqn))


class Counter(Node):
    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Fibonacci.Feedback(sequence=[0, 1])
        yield Done(Fibonacci.Result(sequence=[0, 1]))


def words(node: BlockingNode, count: int) -> list[str]:
    stream: BlockingStream[String] = node.subscribe(WORDS)
    return [stream.next(timeout=5.0).data for _ in range(count)]


def feedback(goal: BlockingGoal[Fibonacci.Result, Fibonacci.Feedback]) -> list[int]:
    return [len(step.sequence) for step in goal]


async def asks_among_nodes(node: BlockingNode) -> str:
    try:
        node.call(ADD, AddTwoInts.Request(a=2, b=3))
    except InsideEventLoop as error:
        return str(error)
    raise AssertionError("it would have stopped the nodes of this loop")


opened: OpenBlockingNode = blocking.open_node("words", tree=Supervisor("demo", Talker, Counter))
with opened as node:
    assert len(words(node, 2)) == 2
    with node.send_goal(COUNT, Fibonacci.Goal(order=2)) as goal:
        assert feedback(goal) == [2] and [*goal.result().sequence] == [0, 1]
    print(node.run(lambda _: asks_among_nodes(node)))
