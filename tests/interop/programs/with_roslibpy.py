"""roslibpy against our server: PORT. Prints what it has seen as JSON."""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

import roslibpy
from roslibpy.core import RosTimeoutError


def main() -> None:
    ros: Any = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]), transport="asyncio")
    ros.run(timeout=15)
    seen: dict[str, Any] = {}
    library: Any = roslibpy
    arrived = threading.Event()

    def take(message: Any) -> None:
        seen["message"] = message["data"]
        arrived.set()

    library.Topic(ros, "/words", "std_msgs/String").subscribe(take)
    out = library.Topic(ros, "/words", "std_msgs/String")
    for _ in range(200):
        out.publish({"data": "hallo"})
        if arrived.wait(0.05):
            break
    add = library.Service(ros, "/add", "example_interfaces/AddTwoInts")
    seen["sum"] = add.call(library.ServiceRequest({"a": 2, "b": 40}), timeout=15)["sum"]

    def multiply(request: Any, response: Any) -> bool:
        response["sum"] = request["a"] * request["b"]
        return True

    own = library.Service(ros, "/of_python", "example_interfaces/AddTwoInts")
    own.advertise(multiply)
    other = library.Service(ros, "/of_python", "example_interfaces/AddTwoInts")
    seen["product"] = other.call(library.ServiceRequest({"a": 6, "b": 7}), timeout=15)["sum"]

    ended = threading.Event()

    def result(found: Any) -> None:
        seen["result"] = found["values"]["sequence"] if "values" in found else found
        ended.set()

    seen["feedback"] = []
    client = library.ActionClient(ros, "/count", "example_interfaces/Fibonacci")
    client.send_goal(
        library.Goal({"order": 4}), result, lambda feedback: seen["feedback"].append(dict(feedback)), print
    )
    ended.wait(15)

    speed = library.Param(ros, "/talker:speed")
    seen["speed"] = speed.get(timeout=15)
    speed.set(1.5, timeout=15)
    seen["changed"] = speed.get(timeout=15)
    seen["nodes"] = ros.get_nodes()
    seen["type"] = ros.get_topic_type("/chatter")
    seen["time"] = ros.get_time()["secs"]
    print(json.dumps(seen), flush=True)
    try:
        ros.close(timeout=5)
    except RosTimeoutError:
        pass


if __name__ == "__main__":
    main()
