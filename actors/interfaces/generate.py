"""Writes typed Python modules for a folder of definitions, so that editors and type checkers know the messages.

    python -m actors.interfaces.generate FOLDER [--out OUT] [--home HOME] [--check]

FOLDER holds `<package>/<msg|srv|action>/<Name>.<kind>`; OUT (by default the folder above FOLDER) receives `<package>/msg.py`
and so on. HOME is the Python package that OUT is, "" where OUT itself is on the module search path; by default it is what can be
seen from where OUT lies (`home_of`). The modules are for reading as much as for running. Nothing needs them: a type can be loaded from
its file.
"""

from __future__ import annotations

import argparse
import keyword
import os
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

from actors.interfaces import registry
from actors.interfaces.errors import BadDeclaration, InterfaceError
from actors.interfaces.loading import read_file
from actors.interfaces.module_text import Module, shipped
from actors.interfaces.naming import KINDS, Kind, closest
from actors.interfaces.parse import Definition, DefinitionError

COMMAND = "python -m actors.interfaces.generate"
LAYOUT = "<package>/<msg|srv|action>/<Name>.<msg|srv|action|idl>"
GENERATED = "Generated."
"""How the first line of a package that was written here ends; a package of the user's own is left as it is."""


def read_folder(path: Path, wrong: list[InterfaceError] | None = None) -> dict[tuple[str, Kind], list[Definition]]:
    """The definitions of a folder by package and kind, each list sorted by name. Errors of files that cannot be read are added to `wrong`.

    Raises:
        DefinitionError: a file cannot be read, and there is no `wrong`.
    """
    found: dict[tuple[str, Kind], list[Definition]] = {}
    for package, kind in product(sorted(os.listdir(path)), KINDS):
        for file in registry.definition_files(path / package, kind):
            try:
                found.setdefault((package, kind), []).append(read_file(file, package))
            except DefinitionError as error:
                _note(error, wrong)
    for definitions in found.values():
        definitions.sort(key=lambda one: one.name)
    return {key: definitions for key, definitions in found.items() if definitions}


def generate(path: Path, home: str, source: str = "share", wrong: list[InterfaceError] | None = None) -> dict[str, str]:
    """The text of every module, by its path below the output folder.

    `home` is the Python package they will be in ("": each ROS package is a package at the top), `source` how the folder is called in the
    headers. A type that ships with `actors.interfaces` is left out: it is used from there. So is, with its error in `wrong`, a definition
    that cannot be read, or uses a type that is neither in the folder nor ships, or has a field whose name Python cannot spell.

    Raises:
        DefinitionError, BadDeclaration: such a definition, if there is no `wrong`.
        BadDeclaration: types or packages contain each other.
    """
    ours = {
        key: kept
        for key, definitions in read_folder(path, wrong).items()
        if (kept := [one for one in definitions if not _ships(one.name, home)])
    }
    _leave_out(ours, path, wrong)
    _check_packages(ours)
    modules: dict[str, str] = {}
    homes = {definition.name: home for definitions in ours.values() for definition in definitions}
    for (package, kind), definitions in ours.items():
        modules[f"{package}/{kind}.py"] = Module(package, kind, definitions, homes, source).text()
        kinds = [k for k in KINDS if (package, k) in ours]
        modules[f"{package}/__init__.py"] = f'"""ROS 2 package {package}: {", ".join(kinds)}. {GENERATED}"""\n'
    return modules


def left_out(path: Path, home: str) -> list[str]:
    """The packages of a folder of which types are not generated, because they ship with `actors.interfaces`."""
    found = read_folder(path, []).items()
    return sorted({package for (package, _), all in found if any(_ships(one.name, home) for one in all)})


def _note(error: InterfaceError, wrong: list[InterfaceError] | None) -> None:
    if wrong is None:
        raise error
    wrong.append(error)


def _ships(name: str, home: str) -> bool:
    folder = shipped(name)
    return folder is not None and folder != home


def _used(definition: Definition) -> Iterator[tuple[str, int]]:
    """The messages that a definition contains, by full name, and the line of each."""
    for part in definition.parts:
        for field in part.fields:
            if field.type.is_message:
                yield field.type.base, field.line


def _leave_out(ours: dict[tuple[str, Kind], list[Definition]], path: Path, wrong: list[InterfaceError] | None) -> None:
    """Remove the definitions of which no class can be made, and those that use them."""
    found = True
    while found:
        found = False
        names = {definition.name for definitions in ours.values() for definition in definitions}
        for key, definitions in list(ours.items()):
            for definition in list(definitions):
                if (error := _flaw(definition, names, path)) is not None:
                    _note(error, wrong)
                    definitions.remove(definition)
                    found = True
            if not definitions:
                del ours[key]


def _flaw(definition: Definition, names: set[str], path: Path) -> InterfaceError | None:
    """Why there can be no class of a definition."""
    for used, line in _used(definition):
        if used not in names and shipped(used) is None:
            hint = closest(used, [*names, *registry.known_names("msg")])
            return DefinitionError(
                "invalid_type_name",
                f"no message {used} is known: it is neither in {path} nor ships with actors.interfaces.{hint}",
                line,
                definition.file,
            )
    for part in definition.parts:
        for field in part.fields:
            if keyword.iskeyword(field.name):
                return BadDeclaration(
                    f"{definition.file}: field {field.name!r} is a Python keyword, which a class body cannot spell; "
                    "load this package at run time instead (actors.interfaces.load_folder)"
                )
    return None


def _check_packages(ours: dict[tuple[str, Kind], list[Definition]]) -> None:
    """Two packages whose messages need each other would be modules that import each other."""
    needs: dict[str, set[str]] = {}
    for (package, kind), definitions in ours.items():
        if kind == "msg":
            used = {name.split("/")[0] for definition in definitions for name, _ in _used(definition)}
            needs[package] = used - {package}
    for package in needs:
        reached: set[str] = set()
        waiting = [package]
        while waiting:
            for other in needs.get(waiting.pop(), set()) - reached:
                reached.add(other)
                waiting.append(other)
        if package in reached:
            back = sorted(other for other in reached if package in needs.get(other, ()))
            raise BadDeclaration(
                f"the packages {package} and {back[0]} need each other's messages, which ROS 2 does not build and Python cannot import: "
                "move what both need into a third package"
            )


def home_of(out: Path) -> str:
    """The Python package that a folder is, as far as can be seen: its name among packages with an `__init__.py` that it lies in, or else
    its place below the working folder; "" where it is the working folder itself, or lies elsewhere.
    """
    out = out.resolve()
    inner = [] if (out / "__init__.py").is_file() else [out.name]
    top = out if not inner else out.parent
    names = list(inner)
    while (top / "__init__.py").is_file():
        names.insert(0, top.name)
        top = top.parent
    if names != inner and _is_dotted(names):
        return ".".join(names)
    below = Path(os.path.relpath(out)).parts
    return ".".join(below) if _is_dotted(below) else ""


def _is_dotted(names: Sequence[str]) -> bool:
    return bool(names) and all(name.isidentifier() and not keyword.iskeyword(name) for name in names)


def main(arguments: Sequence[str] | None = None, command: str = COMMAND) -> int:
    """The command, called `command` in what it says.

    Exit code 1 if `--check` finds a module that is missing or old, or a definition is wrong, which is left out; 2 for wrong usage.
    """
    parser = _parser(command)
    options = parser.parse_args(arguments)
    folder: Path = options.folder
    out: Path = options.out or folder.resolve().parent
    home: str = home_of(out) if options.home is None else options.home
    if (misuse := _wrong_usage(folder, out, home)) is not None:
        parser.error(misuse)
    wrong: list[InterfaceError] = []
    try:
        modules = generate(folder, home, Path(os.path.relpath(folder, out)).as_posix(), wrong)
        left = left_out(folder, home)
    except InterfaceError as error:
        parser.exit(1, f"{error}\n")
    if left:
        print(f"left out, because they ship with actors.interfaces and are used from there: {', '.join(left)}")
    elif not modules and not wrong:
        parser.error(_nothing_in(folder))
    stale = {name: text for name, text in modules.items() if not _same(out / name, text)}
    if options.check:
        again = f"{command} {folder}" + (f" --out {out}" if options.out else "")
        for name in stale:
            print(f"{out / name} is missing or old; run {again}")
        return 1 if stale else _ended(parser, wrong)
    try:
        _write(out, stale)
    except OSError as error:
        parser.exit(1, f"the modules cannot be written: {error}\n")
    print(f"{len(modules)} modules, {len(stale)} written, in {out}")
    for name in [name for name in modules if not name.endswith("__init__.py")][:1]:
        module = name.removesuffix(".py").replace("/", ".")
        path = f", with {out} on the module search path (PYTHONPATH={out})"
        print(f"import them as {home}.{module}" if home else f"import them as {module}{path}")
    return _ended(parser, wrong)


def _ended(parser: argparse.ArgumentParser, wrong: Sequence[InterfaceError]) -> int:
    """0, or an exit with the definitions that are left out."""
    if wrong:
        parser.exit(1, "".join(f"left out: {error}\n" for error in wrong))
    return 0


def _parser(command: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=command, description="Write typed modules for a folder of definitions.")
    parser.add_argument("folder", metavar="FOLDER", type=Path, help=f"folder of definitions, {LAYOUT}")
    parser.add_argument("--out", type=Path, help="where the modules go (default: the folder above)")
    parser.add_argument("--home", help='Python package that OUT is, "" for none (default: by where OUT lies)')
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where a module is missing or old")
    return parser


def _wrong_usage(folder: Path, out: Path, home: str) -> str | None:
    """The fault in the arguments, in a line that says what to do; None if there is none."""
    if not folder.exists():
        known = [one.name for one in folder.parent.iterdir()] if folder.parent.is_dir() else []
        return f"there is no folder {folder}.{closest(folder.name, known)}"
    if not folder.is_dir():
        return f"{folder} is a file: give the folder that holds {LAYOUT}"
    if out.exists() and not out.is_dir():
        return f"--out {out} is a file: give a folder"
    if home and not _is_dotted(home.split(".")):
        return f"--home {home!r} is not the name of a Python package, such as my_robot.interfaces"
    return None


def _nothing_in(folder: Path) -> str:
    """Why nothing was found in a folder, as far as can be seen."""
    found = [file for kind in (*KINDS, "idl") for file in sorted(folder.glob(f"**/*.{kind}"))]
    if any(file.parent.parent == folder for file in found if file.parent.name in KINDS):
        return (
            f"no definition in {folder}: it looks like one package; give the folder above it, {folder.resolve().parent}"
        )
    if found:
        return f"no definition in {folder}; there is {found[0].relative_to(folder)}, expected {LAYOUT}"
    return f"no definition in {folder}; expected {LAYOUT}"


def _same(path: Path, text: str) -> bool:
    if not path.is_file():
        return False
    there = path.read_text(encoding="utf-8")
    return there == text or (path.name == "__init__.py" and bool(there.strip()) and GENERATED not in there)


def _write(out: Path, modules: dict[str, str]) -> None:
    for name, text in modules.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
