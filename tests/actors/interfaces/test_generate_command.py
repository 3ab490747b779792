"""The command that generates modules: whatever FOLDER and OUT are, what it wrote can be imported; what is wrong is told in a line."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from actors.interfaces import BadDeclaration, registry
from actors.interfaces.generate import generate, home_of, main
from tests import warm

FILES = {
    "demo_msgs/msg/Reading.msg": "float64 volts\nstd_msgs/Header header\n",
    "demo_msgs/srv/Ask.srv": "string q\n---\nReading answer\n",
    "demo_msgs/action/Watch.action": "Reading goal\n---\nReading[] all\n---\nReading now\n",
    "other_msgs/msg/Pair.msg": "demo_msgs/Reading left\ndemo_msgs/Reading right\n",
    "other_msgs/srv/Join.srv": "Pair pair\n---\ndemo_msgs/Reading reading\n",
}
USE = (
    "from {0}demo_msgs.srv import Ask; from {0}demo_msgs.action import Watch; from {0}other_msgs.srv import Join; "
    "from actors.interfaces import encode, decode, type_name; "
    "reply = Ask.Response(answer=__import__('{0}demo_msgs.msg', fromlist=['x']).Reading(volts=2.5)); "
    "assert decode(Ask.Response, encode(reply)) == reply; "
    "assert type(Join.Request().pair.left) is type(reply.answer) is type(Watch.Goal().goal); "
    "print(type_name(Join))"
)


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


STRICT = "import warnings; warnings.simplefilter('error'); "
GENERATE = "import sys; from actors.interfaces.generate import main; sys.exit(main(sys.argv[1:]))"


def python(where: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return warm.run("-c", code, *arguments, cwd=where, timeout=60)


def wrote(where: Path, *arguments: str) -> str:
    done = python(where, GENERATE, *arguments)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def works(path: Path, package: str = "") -> None:
    """Everything that was written can be imported and used by an interpreter that starts in `path`."""
    done = python(path, STRICT + USE.format(package))
    assert (done.returncode, done.stdout, done.stderr) == (0, "other_msgs/srv/Join\n", "")


def test_by_default_the_modules_stand_beside_the_folder(tmp_path: Path) -> None:
    write(tmp_path / "defs", FILES)
    told = wrote(tmp_path, "defs")
    works(tmp_path)
    assert "import them as demo_msgs.msg, with" in told
    header = (tmp_path / "demo_msgs/msg.py").read_text().splitlines()[0]
    assert header == '"""demo_msgs/msg. Generated from its definitions in defs; do not edit."""'


def test_a_folder_below_gives_modules_below(tmp_path: Path) -> None:
    write(tmp_path / "proj/defs", FILES)
    assert "import them as proj.demo_msgs.msg\n" in wrote(tmp_path, "proj/defs")
    works(tmp_path, "proj.")


@pytest.mark.parametrize("out", ["gen", "gen/inner", "./gen"])
def test_out_below_the_working_folder_is_a_package_by_its_place(tmp_path: Path, out: str) -> None:
    write(tmp_path / "defs", FILES)
    package = Path(out).as_posix().replace("/", ".")
    assert f"import them as {package}.demo_msgs.msg\n" in wrote(tmp_path, "defs", "--out", out)
    works(tmp_path, f"{package}.")
    header = (tmp_path / out / "demo_msgs/msg.py").read_text().splitlines()[0]
    assert f"in {'../' * len(Path(out).parts)}defs;" in header


def test_an_absolute_out_below_the_working_folder_is_the_same(tmp_path: Path) -> None:
    write(tmp_path / "defs", FILES)
    wrote(tmp_path, str(tmp_path / "defs"), "--out", str(tmp_path / "gen"))
    works(tmp_path, "gen.")


@pytest.mark.parametrize("out", ["../elsewhere", "absolute", "../odd-name"])
def test_out_elsewhere_is_a_folder_for_the_search_path(tmp_path: Path, out: str) -> None:
    write(tmp_path / "here/defs", FILES)
    given = str(tmp_path / "elsewhere") if out == "absolute" else out
    told = wrote(tmp_path / "here", "defs", "--out", given)
    assert f"import them as demo_msgs.msg, with {given} on the module search path (PYTHONPATH={given})" in told
    works((tmp_path / "here" / given).resolve())


def test_a_folder_whose_name_is_no_package_name_is_for_the_search_path(tmp_path: Path) -> None:
    write(tmp_path / "defs", FILES)
    wrote(tmp_path, "defs", "--out", "build-1/gen")
    works(tmp_path / "build-1/gen")


@pytest.mark.parametrize("inner", ["interfaces", "interfaces/__init__.py"])
def test_a_package_in_a_source_tree_is_called_as_it_will_be_installed(tmp_path: Path, inner: str) -> None:
    write(tmp_path, {f"src/my_pkg/{inner}" if inner.endswith(".py") else "src/my_pkg/other.py": ""})
    write(tmp_path, {"src/my_pkg/__init__.py": "", **{f"share/{name}": text for name, text in FILES.items()}})
    told = wrote(tmp_path, "share", "--out", "src/my_pkg/interfaces")
    assert "import them as my_pkg.interfaces.demo_msgs.msg\n" in told
    works(tmp_path / "src", "my_pkg.interfaces.")


def test_home_says_otherwise(tmp_path: Path) -> None:
    write(tmp_path / "defs", FILES)
    wrote(tmp_path, "defs", "--out", "gen", "--home", "")
    works(tmp_path / "gen")
    (tmp_path / "x").mkdir()
    wrote(tmp_path, "defs", "--out", "x/y", "--home", "y")
    works(tmp_path / "x", "y.")


def test_a_folder_is_named_after_its_place_only_if_it_can_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, {"src/my_pkg/__init__.py": ""})
    places = [".", "a/b", "a/class", "a-b", "..", "/", "src/my_pkg", "src/my_pkg/inner"]
    assert [home_of(Path(out)) for out in places] == ["", "a.b", "", "", "", "", "my_pkg", "my_pkg.inner"]


def test_packages_that_ship_are_left_out_and_used_from_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "defs", {"std_msgs/msg/Header.msg": "uint8 x\n"})
    assert main(["defs"]) == 0
    assert (
        "left out, because they ship with actors.interfaces and are used from there: std_msgs\n"
        in capsys.readouterr().out
    )
    assert not (tmp_path / "std_msgs").exists()
    write(tmp_path / "defs", FILES)
    assert main(["defs"]) == 0
    assert "from actors.interfaces.std_msgs.msg import Header" in (tmp_path / "demo_msgs/msg.py").read_text()


def test_a_package_of_the_users_own_is_not_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, {"demo_msgs/__init__.py": "MINE = 1\n", "other_msgs/__init__.py": ""})
    write(tmp_path / "defs", FILES)
    assert main(["defs"]) == 0
    assert main(["defs", "--check"]) == 0
    assert (tmp_path / "demo_msgs/__init__.py").read_text() == "MINE = 1\n"
    assert (tmp_path / "other_msgs/__init__.py").read_text() == '"""ROS 2 package other_msgs: msg, srv. Generated."""\n'


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["dfs"], 2, "error: there is no folder dfs. Did you mean 'defs'?"),
        (["nowhere/defs"], 2, "error: there is no folder nowhere/defs."),
        (["note.txt"], 2, "error: note.txt is a file: give the folder that holds <package>/<msg|srv|action>/<Name>"),
        (
            ["defs/demo_msgs"],
            2,
            "error: no definition in defs/demo_msgs: it looks like one package; give the folder above it, ",
        ),
        (
            ["flat"],
            2,
            "error: no definition in flat; there is pkg/Note.msg, expected <package>/<msg|srv|action>/<Name>",
        ),
        (
            ["empty"],
            2,
            "error: no definition in empty; expected <package>/<msg|srv|action>/<Name>.<msg|srv|action|idl>",
        ),
        (["defs", "--out", "note.txt"], 2, "error: --out note.txt is a file: give a folder"),
        (["defs", "--home", "my-robot"], 2, "error: --home 'my-robot' is not the name of a Python package"),
        (["defs", "--out", "note.txt/x"], 1, "the modules cannot be written: "),
        (
            ["typo"],
            1,
            "Ask.srv, line 3: no message demo_msgs/msg/Redaing is known: it is neither in typo nor ships with",
        ),
        (["latin"], 1, "N.msg: this is no UTF-8 text"),
        (["round"], 1, "a message cannot contain itself: a_msgs/msg/A -> a_msgs/msg/B -> a_msgs/msg/A"),
        (["ring"], 1, "the packages a_msgs and b_msgs need each other's messages"),
    ],
)
def test_what_is_wrong_is_told_in_a_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "defs", FILES)
    write(tmp_path / "typo", {"demo_msgs/msg/Reading.msg": "", "demo_msgs/srv/Ask.srv": "string q\n---\nRedaing a\n"})
    write(tmp_path / "round", {"a_msgs/msg/A.msg": "B b\n", "a_msgs/msg/B.msg": "A a\n"})
    write(
        tmp_path / "ring",
        {"a_msgs/msg/A.msg": "b_msgs/B b\n", "b_msgs/msg/B.msg": "", "b_msgs/msg/C.msg": "a_msgs/A a\n"},
    )
    write(tmp_path, {"note.txt": "", "flat/pkg/Note.msg": "", "empty/readme": "", "latin/l_msgs/msg/N.msg": ""})
    (tmp_path / "latin/l_msgs/msg/N.msg").write_bytes(b"# gr\xfc\xdfe\n")
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == code
    out, err = capsys.readouterr()
    assert told in err
    assert "Traceback" not in out + err


def test_a_typo_is_told_with_what_is_near(tmp_path: Path) -> None:
    write(tmp_path, {"demo_msgs/msg/Reading.msg": "", "demo_msgs/srv/Ask.srv": "---\nRedaing a\n"})
    with pytest.raises(ValueError, match=r"Did you mean 'demo_msgs/msg/Reading'"):
        generate(tmp_path, "")


def test_a_bad_file_is_named_with_what_needs_it_and_the_others_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "defs", FILES)
    bad = {"msg/Torn.msg": "int33 x\n", "msg/Half.msg": "Torn torn\n", "srv/Odd.srv": "---\nint32 class\n", "idl/x": ""}
    write(tmp_path / "defs/bad_msgs", bad | {"msg/Good.msg": "int32 x\n", "msg/Broken.idl": "module bad_msgs {"})
    (tmp_path / "defs/demo_msgs/msg/Latin.msg").write_bytes(b"# gr\xfc\xdfe\n")
    (tmp_path / "defs/worse_msgs/msg").mkdir(parents=True)
    (tmp_path / "defs/worse_msgs/msg/Only.msg").write_text("x")
    for check, code in (([], 1), (["--check"], 1)):
        with pytest.raises(SystemExit) as ended:
            main(["defs", *check])
        assert ended.value.code == code
        told = capsys.readouterr().err.splitlines()
        assert [re.search(r"(\w+)\.(msg|srv|idl)", line)[1] for line in told] == [  # type: ignore[index]
            "Torn", "Broken", "Latin", "Only", "Half", "Odd"
        ]  # fmt: skip
        assert all(line.startswith("left out: ") for line in told)
    works(tmp_path)
    assert "class Good(" in (tmp_path / "bad_msgs/msg.py").read_text()
    assert not (tmp_path / "bad_msgs/srv.py").exists()
    assert not (tmp_path / "worse_msgs").exists()


def test_a_type_that_a_shipped_package_lacks_is_supplied(tmp_path: Path) -> None:
    plane = "# On a plane.\nfloat64 x\nfloat64 y\nfloat64 theta\n"
    write(tmp_path / "defs", {"geometry_msgs/msg/Pose2D.msg": plane, "geometry_msgs/msg/Point.msg": "uint8 x\n"})
    write(tmp_path / "defs", {"geometry_msgs/msg/Poses2D.msg": "Pose2D[] poses\nPoint point\n"})
    write(tmp_path / "defs", {"geometry_msgs/srv/Locate.srv": "Pose2D near\n---\n", "slam_msgs/msg/Guess.msg": "geometry_msgs/Pose2D at\n"})  # fmt: skip
    for home in ("", "my_robot"):
        (tmp_path / home).mkdir(exist_ok=True)
        assert "left out, because they ship" in wrote(tmp_path, "defs", "--out", home or ".", "--home", home)
        package = f"{home}." if home else ""
        use = (
            f"from {package}geometry_msgs.msg import Pose2D, Poses2D; from {package}geometry_msgs.srv import Locate; "
            f"from {package}slam_msgs.msg import Guess; from actors.interfaces.geometry_msgs.msg import Point; "
            "from actors.interfaces import get_message, type_name; "
            "assert type(Guess().at) is type(Locate.Request().near) is Pose2D; assert type(Poses2D().point) is Point; "
            "assert get_message('geometry_msgs/Pose2D') is Pose2D; print(type_name(Pose2D))"
        )
        done = python(tmp_path, STRICT + use)
        assert (done.stdout, done.stderr) == ("geometry_msgs/msg/Pose2D\n", "")


IDL = """
#include "demo_msgs/msg/Lid.idl"
module demo_msgs { module msg {
  typedef float float__4[4];
  module Box_Constants { const long SIDES = 6; };
  @verbatim (language="comment", text="A box.")
  struct Box {
    @verbatim (language="comment", text="How wide") @unit (value="m") @default (value=0.5) double width;
    @default (value="a b") string name; demo_msgs::msg::Lid lid; float__4 corners; @default (value=TRUE) boolean open;
    @default (value="a#b") string odd;
  };
}; };
"""


def test_idl_files_are_generated_and_loaded_as_those_of_ros_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(
        tmp_path / "defs",
        {"demo_msgs/msg/deep/Box.idl": IDL, "demo_msgs/msg/Lid.msg": "uint8 x\n", "demo_msgs/msg/Lid.idl": "$"},
    )
    write(tmp_path / "defs", {"demo_msgs/srv/Close.idl": "module demo_msgs { module srv { struct Close_Response { boolean ok; };"
                              "struct Close_Request { demo_msgs::msg::Box box; }; }; };"})  # fmt: skip
    wrote(tmp_path, "defs")
    use = (
        "from demo_msgs.msg import Box; from demo_msgs.srv import Close; from actors.interfaces import definition_text, show, add_folder;"
        "add_folder('defs'); print(Box.SIDES, Box().width, len(Box().corners), Close.Request().box.name, Close.Response().ok);"
        "print(definition_text(Box)); print(show(Close, comments='none'))"
    )
    done = python(tmp_path, STRICT + use)
    assert done.stderr == ""
    first, _, shown = done.stdout.partition("\n")
    assert first == "6 0.5 4 a b False"
    box = (
        '# A box.\n\nint32 SIDES=6\n# How wide\n# [m]\nfloat64 width 0.5\nstring name "a b"\ndemo_msgs/Lid lid\n'
        "float32[4] corners\nbool open true\nstring odd\n"
    )
    assert shown.startswith(box)
    assert "demo_msgs/Box box\n\tint32 SIDES=6\n\tfloat64 width 0.5\n" in shown
    assert shown.endswith("---\nbool ok\n\n")
    loaded = python(tmp_path, "from actors.interfaces import load_folder, type_hash, definition_text as t; load_folder('defs');"
                    "print(type_hash('demo_msgs/msg/Box')); print(t('demo_msgs/msg/Box'))")  # fmt: skip
    write(tmp_path / "same/demo_msgs/msg", {"Box.msg": box, "Lid.msg": "uint8 x\n"})
    same = python(tmp_path, "from actors.interfaces import load_folder, type_hash, definition_text as t; load_folder('same');"
                  "print(type_hash('demo_msgs/msg/Box')); print(t('demo_msgs/msg/Box'))")  # fmt: skip
    assert (loaded.stdout, loaded.stderr) == (same.stdout, same.stderr)


def test_a_type_that_was_only_loaded_in_this_process_cannot_be_imported_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, {"loaded/far_msgs/msg/Far.msg": "", "defs/demo_msgs/msg/Near.msg": "far_msgs/Far far\n"})
    monkeypatch.setattr(registry, "_folders", [*registry.folders(), registry.Folder(str(tmp_path / "loaded"), None)])
    with pytest.raises(ValueError, match="no message far_msgs/msg/Far is known"):
        generate(tmp_path / "defs", "")


def test_a_message_in_itself_is_refused(tmp_path: Path) -> None:
    write(tmp_path, {"a_msgs/msg/A.msg": "A[] more\n"})
    with pytest.raises(BadDeclaration, match="a_msgs/msg/A -> a_msgs/msg/A"):
        generate(tmp_path, "")


def test_the_command_of_the_docs_does_what_the_docs_say(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs/howto/messages.md").read_text(encoding="utf-8")
    section = page.partition("## From definition files")[2].partition("\n## ")[0]
    layout = re.search(r"```text\n(.*?)```", section, re.DOTALL)
    command = re.search(r"```sh\npython (.*?)\n```", section)
    imported, beside = re.findall(r"`(from \S+ import Reading)`", section)
    assert layout is not None
    assert command is not None
    write(tmp_path, {path: FILES[path.partition("/")[2]] for path in layout[1].split()})

    started = [sys.executable, *command[1].split()]
    assert subprocess.run(started, cwd=tmp_path, capture_output=True, text=True, timeout=60).stderr == ""
    wrote(tmp_path, "share")

    for line in (imported, beside):
        done = python(tmp_path, f"{STRICT}{line}; print(Reading(volts=1.5).volts)")
        assert (done.stdout, done.stderr) == ("1.5\n", "")
