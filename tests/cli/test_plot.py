"""`plot`: a field over time as dots, as CSV and as PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from actors import Node, QoS, Topic, every, publishes
from actors.interfaces.geometry_msgs.msg import Vector3Stamped
from actors.interfaces.sensor_msgs.msg import JointState
from cli.command import CommandFailed
from cli.verbs.plot.plotting import Series, braille, split
from tests.cli.conftest import Command, SystemOf

VECTORS = Topic(Vector3Stamped, "imu/data", QoS(depth=100))
JOINTS = Topic(JointState, "joints", 10)


class Ramp(Node):
    """The x of its vectors is 0, 1, 2 ... at 100 Hz."""

    vectors = publishes(VECTORS)
    joints = publishes(JOINTS)

    async def on_start(self) -> None:
        self.count = 0

    @every(hz=100)
    def tick(self) -> None:
        vector = Vector3Stamped().vector.replace(x=float(self.count))
        self.vectors(Vector3Stamped(vector=vector))
        self.joints(JointState(name=["hip"], position=[0.5, -0.5]))
        self.count += 1


class Bursts(Node):
    """The x of its vectors is 0, 1, 2 ... in bursts of 100."""

    vectors = publishes(VECTORS)
    count = 0

    @every(hz=5)
    def tick(self) -> None:
        for _ in range(100):
            self.vectors(Vector3Stamped(vector=Vector3Stamped().vector.replace(x=float(self.count))))
            self.count += 1


def test_a_rising_line_goes_from_the_lower_left_to_the_upper_right() -> None:
    lines = list(braille(Series("/x", [0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0]), 8, 2))
    name, upper, lower, figures = lines
    assert name == "/x"
    assert (upper[0:1], lower[0:1]) == ("3", "0")
    assert (upper[2], lower[-1]) == ("\u2800", "\u2800"), "nothing at the upper left and the lower right"
    assert lower[2] == chr(0x2800 + 0x40), "the first sample is the dot at the lower left"
    assert upper[-1] == chr(0x2800 + 0x08), "the last one that at the upper right"
    assert figures.strip() == "3 s, 4 samples, 1 Hz, mean 1.5"


def test_a_constant_lies_in_the_middle_and_an_empty_series_says_so() -> None:
    _, *rows, _ = braille(Series("/x", [0.0, 1.0], [5.0, 5.0]), 20, 3)
    drawn = [set(row[2:]) - {"\u2800"} for row in rows]
    assert [bool(dots) for dots in drawn] == [False, True, False]
    assert list(braille(Series("/x", [], []), 20, 3)) == ["/x", "(no samples yet)"]


def test_the_window_keeps_the_newest_seconds() -> None:
    series = Series("/x", [0.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0])
    assert series.last(1.5).values == [3.0, 4.0]
    assert series.last(10).values == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("text", "topic", "path"),
    [
        ("/imu/data/angular_velocity/z", "/imu/data", "angular_velocity.z"),
        ("imu/data/x", "/imu/data", "x"),
        ("/joints/position[1]", "/joints", "position.[1]"),
        ("/imu/x", "/imu", "x"),
    ],
)
def test_the_longest_topic_that_fits_is_meant(text: str, topic: str, path: str) -> None:
    assert split(text, ["/imu", "/imu/data", "/joints"]) == (topic, path)
    with pytest.raises(CommandFailed, match="no topic of the graph begins so"):
        split("/nothing/x", ["/imu"])


async def test_samples_are_written_and_drawn(system_of: SystemOf, command: Command, tmp_path: Path) -> None:
    table, image = tmp_path / "x.csv", tmp_path / "x.png"
    async with system_of(Ramp):
        files = ("--csv", str(table), "--png", str(image))
        plotted = await command("plot", "/imu/data/vector/x", "/joints/position[1]", "--duration", "1", *files)
    assert (plotted.code, plotted.err) == (0, "")
    assert "/imu/data/vector/x\n" in plotted.out
    header, *rows = table.read_text().splitlines()
    assert header == "time,field,value"
    ramp = [float(row.split(",")[2]) for row in rows if row.split(",")[1] == "/imu/data/vector/x"]
    assert len(ramp) > 10
    assert ramp == [ramp[0] + step for step in range(len(ramp))], "no sample is lost"
    assert {row.split(",")[2] for row in rows if "position" in row} == {"-0.5"}
    drawn = imread(image)
    assert drawn.shape[:2] == (480, 900)
    ink = (drawn[:, :, 2] - drawn[:, :, 0] > 0.3).nonzero()  # the curves are blue
    rising = ink[0] < 240
    assert np.corrcoef(ink[1][rising], ink[0][rising])[0, 1] < -0.95, "the ramp goes up, which is towards row 0"
    assert np.ptp(ink[0][~rising]) < 5, "the joint stands still"


async def test_without_matplotlib_a_picture_is_refused_before_anything_is_collected(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cli.verbs.plot.plotting.find_spec", lambda name: None)
    refused = await command("plot", "/imu/data/vector/x", "--png", "x.png")
    assert (refused.code, refused.out) == (1, "")
    assert "pip install 'robactor[plots]'" in refused.err


@pytest.mark.parametrize(
    ("field", "error"),
    [
        ("/imu/data/vector", "/imu/data/vector is no number but a geometry_msgs/msg/Vector3: name one of x, y, z"),
        ("/joints/position", "/joints/position is no number but an array: name an item, as in NAME[0]"),
        ("/joints/name[0]", "/joints/name[0] is no number but a text"),
        ("/imu/data/vector/w", "Invalid field 'vector.w': there is no 'w'; it has x, y, z"),
        ("/imu/dat/vector/x", "/imu/dat/vector/x: no topic of the graph begins so"),
    ],
)
async def test_what_is_no_number_is_one_line(field: str, error: str, system_of: SystemOf, command: Command) -> None:
    async with system_of(Ramp):
        refused = await command("plot", field, "--duration", "5")
    assert (refused.code, refused.out) == (1, "")
    assert refused.err.startswith(error)
    assert refused.err.count("\n") == 1


async def test_no_sample_of_a_burst_is_lost(system_of: SystemOf, command: Command) -> None:
    async with system_of(Bursts):
        plotted = await command("plot", "/imu/data/vector/x", "--duration", "1", "--csv", "-")
    assert (plotted.code, plotted.err) == (0, "")
    drawn = [float(row.split(",")[2]) for row in plotted.out.splitlines()[1:]]
    assert len(drawn) > 10
    assert drawn == [drawn[0] + step for step in range(len(drawn))]
