"""The bridges to and from Python's `logging`."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator

import pytest

from actors import Node
from actors.logs import NodeHandler, logging_sink
from actors.testing import Rig


@pytest.fixture
def library() -> Iterator[logging.Logger]:
    logger = logging.getLogger("some_library")
    logger.setLevel(logging.DEBUG)
    yield logger
    for handler in list(logger.handlers):
        logger.removeHandler(handler)


async def test_lines_of_nodes_reach_the_logger_of_their_name(rig: Rig, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG, "robactor")
    await rig.start(Node)
    rig.system.observe(lines=logging_sink())
    rig.me.log.warning("low battery", percent=12)
    rig.me.log.fatal("gone")
    try:
        raise OSError("bus")
    except OSError:
        rig.me.log.exception("read failed")
    low, gone, failed = [one for one in caplog.records if one.name == "robactor.rig"]
    assert (low.levelname, low.getMessage(), vars(low)["fields"]) == (
        "WARNING",
        "low battery percent=12",
        {"percent": 12},
    )
    assert gone.levelname == "CRITICAL"
    assert failed.levelname == "ERROR" and failed.exc_info is not None and isinstance(failed.exc_info[1], OSError)


async def test_the_root_may_be_another_name_or_none(rig: Rig, caplog: pytest.LogCaptureFixture) -> None:
    await rig.start(Node)
    rig.system.observe(lines=logging_sink("robots.one"))
    rig.system.observe(lines=logging_sink(""))
    rig.me.log.warning("here")
    assert [one.name for one in caplog.records if one.getMessage() == "here"] == ["robots.one.rig", "rig"]


async def test_records_of_a_library_become_lines_of_a_node(rig: Rig, library: logging.Logger) -> None:
    await rig.start(Node)
    rig.me.log.set_level("debug")
    library.addHandler(NodeHandler(rig.me))
    library.info("%d bytes", 7)
    library.log(35, "between")
    library.log(5, "below all")
    try:
        raise OSError("bus")
    except OSError:
        library.exception("read failed")
    lines = [one for one in rig.logs if one.node == "/rig"]
    assert [(one.level, one.event, one.fields["logger_name"]) for one in lines] == [
        (20, "7 bytes", "some_library"), (30, "between", "some_library"), (40, "read failed", "some_library"),
    ]  # fmt: skip
    assert lines[2].traceback.endswith("OSError: bus")
    library.setLevel(1)
    library.log(5, "below all")
    assert [(one.level, one.event) for one in rig.logs if one.node == "/rig"][3:] == [(10, "below all")]


async def test_a_record_of_another_thread_comes_by_way_of_the_loop(rig: Rig, library: logging.Logger) -> None:
    await rig.start(Node)
    library.addHandler(NodeHandler(rig.me))
    thread = threading.Thread(target=library.warning, args=("from beside",))
    thread.start()
    thread.join()
    assert [one for one in rig.logs if one.event == "from beside"] == []
    await rig.until(lambda: any(one.event == "from beside" for one in rig.logs))


async def test_both_bridges_together_make_no_circle(rig: Rig, library: logging.Logger) -> None:
    await rig.start(Node)
    rig.system.observe(lines=logging_sink("some_library"))
    library.addHandler(NodeHandler(rig.me))
    rig.me.log.warning("once")
    library.warning("and once")
    assert [one.event for one in rig.logs if one.node == "/rig"] == ["once", "and once"]
