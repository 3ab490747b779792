"""The words of `python -m robot run`, with what `--help` says of them."""

from __future__ import annotations

from typing import Any

from robot.run.arguments import LEVELS, parse_seed, seconds, whole
from robot.scenes.worlds import WORLDS


def declare(add: Any) -> None:
    """Declare every word by `add`, the `add_argument` of a parser."""
    _add_circumstances(add)
    _add_body(add)
    _add_hardware(add)
    _add_ground(add)
    _add_network(add)
    _add_task(add)
    _add_output(add)


def _add_circumstances(add: Any) -> None:
    """How long, where and with what body."""
    add(
        "--duration",
        type=seconds,
        metavar="S",
        help="end after S seconds, on the real clock of real time (default: run until Ctrl-C; 120 on the virtual clock)",
    )
    add("--battery", type=float, default=90.0, metavar="PERCENT", help="charge at the start (default 90)")
    add(
        "--crash",
        action="append",
        default=[],
        metavar="NODE@T",
        help="make NODE fail at T seconds; may be given several times",
    )
    add(
        "--hang",
        action="append",
        default=[],
        metavar="NODE@T",
        help="with --processes: make the process of NODE stand still at T seconds; may be given several times",
    )
    add(
        "--processes",
        action="store_true",
        help="run the body and each concern of the robot (control, safety, perception, ...) in a process of its own; a process that dies is "
        "restarted",
    )
    add(
        "--clock",
        choices=("real", "virtual"),
        default="real",
        help="real time, or as fast as the machine can (default real)",
    )
    add("--world", default=WORLDS[0], metavar="NAME", help=f"{', '.join(WORLDS)} (default {WORLDS[0]})")
    add(
        "--map",
        metavar="FILE",
        help="the map that the robot is given, a YAML file of map_server's, instead of one made of the world",
    )
    add("--seed", type=parse_seed, default=0, metavar="N", help="of all noise and randomness (default 0)")
    add(
        "--sensors",
        choices=("ideal", "real"),
        default="real",
        help="real: a LiDAR that turns and tilts with the body, with bias and drop-outs, an IMU, encoders and contacts with theirs; "
        "ideal: white noise only (default real)",
    )
    add(
        "--sight",
        action="store_true",
        help="depth cameras and an elevation map: walk round low things, holes and what hangs low, no faster than the floor is seen",
    )


def _add_body(add: Any) -> None:
    """Which robot it is, and how it is simulated."""
    add(
        "--robot",
        default="spot",
        metavar="NAME|FILE",
        help="spot, go2, a2, b2, anymal_c, or a MJCF or URDF file of a quadruped (default spot)",
    )
    add(
        "--backend",
        choices=("physics", "kinematic"),
        default="physics",
        help="MuJoCo, or numpy only, which cannot fall",
    )


def _add_hardware(add: Any) -> None:
    """A robot that exists."""
    add(
        "--hardware",
        choices=("unitree",),
        help="a real robot instead of a simulated one: unitree, a Go2 by DDS (docs/howto/unitree.md)",
    )
    add(
        "--interface",
        metavar="NAME",
        help="the network interface that the real robot is on, such as eth0; a simulator: lo",
    )
    add("--domain", type=whole(0, 232), default=0, metavar="N", help="its DDS domain (default 0)")
    add(
        "--enable",
        action="store_true",
        help="command the real robot's motors; without it nothing is sent to the robot. First steps hang on a stand",
    )


def _add_ground(add: Any) -> None:
    """What drives the robot has, what it stands on and carries, and what hits it: in physics, and told to no controller."""
    add(
        "--actuators",
        choices=("real", "ideal"),
        help="drives whose torque falls with speed and heat, on a bus that gives so much; or drives with their torque limit always (default real, in physics)",
    )
    add("--friction", type=float, metavar="MU", help="between feet and floor (default 0.8; wet tiles 0.4, ice 0.1)")
    add(
        "--payload",
        type=float,
        nargs="+",
        metavar="KG",
        help="KG [X Y]: a load on the back, its centre X and Y metres forward and left of the body's",
    )
    add("--slope", type=float, nargs="+", metavar="DEG", help="X [Y]: the floor rises by so many degrees along x and y")
    add(
        "--push",
        action="append",
        default=[],
        metavar="FORWARD,LEFT@T",
        help="push the body by so many newton seconds along its heading at T seconds, such as 0,40@10 or -30,0@10; may be given several times",
    )


def _add_network(add: Any) -> None:
    """Where other processes are."""
    add(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="take part in the graph of another machine, tcp/HOST:7447; processes of this one find each other by themselves",
    )
    add(
        "--listen",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="let other machines connect to tcp/0.0.0.0:PORT",
    )
    add("--security", metavar="FILE", help="TLS, and who may do what (docs/howto/security.md)")
    add(
        "--host",
        action="append",
        default=[],
        metavar="CONCERN=HOST[@ADDRESS[:PORT]][,SPARE...]",
        help="run perception, navigation or mission on another machine, where `robactor agent` waits, or on the next one if it is lost, such as "
        "navigation=base@192.168.1.6,spare@192.168.1.7; may be given several times (docs/howto/machines.md)",
    )
    add("--no-web", action="store_true", help="without the web page and what else its port offers (docs/howto/web.md)")
    add(
        "--web",
        type=whole(0, 65535),
        metavar="PORT",
        help="the port of the web page, or the next one that is free (default 8765; 0: any)",
    )
    add("--web-host", metavar="HOST", help="let others than this machine see the page; needs ROBACTOR_WEB_TOKEN")
    add(
        "--web-origin",
        action="append",
        default=[],
        metavar="URL",
        help="let pages of this origin connect, such as https://lichtblick.example",
    )
    add(
        "--bags",
        metavar="DIR",
        help="let the web page record bags into this folder, and show those in it (docs/howto/bags.md)",
    )


def _add_task(add: Any) -> None:
    """What is to be done, and by which nodes."""
    add(
        "--goal",
        type=float,
        nargs="+",
        metavar="X",
        help="X Y [THETA]: walk there once (m, m, rad) instead of the patrol, then sit and end",
    )
    add(
        "--only",
        nargs="+",
        metavar="NODE",
        help="run just these nodes of the robot (names divided by spaces or commas). Each one starts without the others and takes "
        "up work with those that come later, in this process or another",
    )
    add("--arm", action="store_true", help="carry an arm of 6.2 kg, and all that belongs to it")
    add(
        "--fetch",
        nargs="+",
        metavar="NAME",
        help="NAME [X Y [Z]]: fetch that thing of the world instead of walking the patrol, and carry it to X Y Z (m; Z is 0 unless "
        "given); with an arm, of course. In the kitchen: --world kitchen --fetch cup 1.9 -1 0.4",
    )


def _add_output(add: Any) -> None:
    """Parameters, and what is written down."""
    add("--params", metavar="FILE", help="a ROS 2 parameter file (YAML)")
    add("--log-format", choices=("console", "json"), default="console")
    add("--log-level", type=str.lower, choices=LEVELS, default="info")
    add("--report", metavar="FILE", help="write a report of the run as JSON")
    add(
        "--replay",
        action="extend",
        nargs="+",
        metavar="NODE",
        help="keep journals of these nodes, and of subtrees by their path (robot/navigation), for `bag record --replay` and `bag replay`",
    )
    add(
        "--journals",
        metavar="DIR",
        help="where the journals of --replay are written, as NODE.journal, for `bag replay`",
    )
    add(
        "--spans",
        action="store_true",
        help="give spans of calls and goals to OpenTelemetry (pip install robactor[otel])",
    )
    add(
        "--flight-record",
        metavar="FILE",
        help="keep the last 30 s of all messages, log lines and supervisor events, and write them to FILE (MCAP) when the "
        "run ends or a supervisor gives up; after a fall, those that led to it",
    )
    add(
        "--trace",
        action="store_true",
        help="print one hash over all messages, log lines and supervisor events: equal for equal runs on the virtual clock",
    )
    add(
        "--publish-clock",
        type=float,
        nargs="?",
        const=40.0,
        metavar="HZ",
        help="publish the run's time on /clock for nodes with use_sim_time, HZ times a second (default 40)",
    )
    add(
        "--motor-delay",
        type=float,
        default=4.0,
        metavar="MS",
        help="delay of the motor drives in milliseconds, 0 to 20 (default 4)",
    )
