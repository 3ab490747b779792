"""The robot's commands of `robactor`: entry points of the group ``robactor.verbs``. Each is loaded when it is used."""

from __future__ import annotations

TYPE_CHECKING = False  # as that of `typing`, which takes a while to import
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from actors import System
    from cli.command import Exit


class Run:
    """`run`: the whole robot in a world; or, if the words name one, an executable."""

    name = "run"
    help = "the whole robot in a world; or an executable,\nrun PACKAGE EXECUTABLE, run MODULE:NODE"

    def main(self, argv: Sequence[str]) -> int | Exit:
        """The exit code: 0 done, 2 not understood, 3 a supervisor gave up, 130 Ctrl-C."""
        if argv and (not argv[0].startswith("-") or argv[0] in ("--prefix", "--package-path")):
            from cli.verbs.run import COMMAND

            return COMMAND.main(argv)
        from robot.run.command import main

        return main(argv, _serve_web)


class Picture:
    """`picture`: the walking robot, drawn."""

    name = "picture"
    help = "render robot, map and path to PNG"

    def main(self, argv: Sequence[str]) -> int:
        """The exit code; see `robot.picture.command`."""
        from cli.starting import interruptible
        from robot.picture import main

        interruptible()
        return main(argv)


class MapSaver:
    """`map_saver_cli`: the map of the graph, as files."""

    name = "map_saver_cli"
    help = "the map, as a file for map_server"

    def main(self, argv: Sequence[str]) -> int | Exit:
        """The exit code; see `robot.commands.map_saver`."""
        from robot.commands.map_saver import COMMAND

        return COMMAND.main(argv)


class Check:
    """`check`: whether this machine and a map are good enough."""

    name = "check"
    help = "whether this machine can run the robot"

    def main(self, argv: Sequence[str]) -> int | Exit:
        """The exit code: 1 if there is a problem."""
        from robot.commands.check import COMMAND

        return COMMAND.main(argv)


async def _serve_web(system: System, **options: Any) -> None:
    from cli.web.beside import serve_beside

    await serve_beside(system, **options)


RUN, CHECK, PICTURE, MAP_SAVER = Run(), Check(), Picture(), MapSaver()
