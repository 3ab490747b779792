"""The files of the page: light, from here only, and with the names and versions of what others wrote."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.tools.page_weight import PAGE, weights

OURS = [path for path in sorted(PAGE.rglob("*.js")) if path.parent.name != "vendor"]
MEGABYTE = 1_000_000


def test_the_page_weighs_less_than_a_megabyte_compressed_and_opens_with_a_twentieth_of_that() -> None:
    found = {one.name: one.packed for one in weights()}
    assert sum(found.values()) < MEGABYTE
    at_once = [name for name in found if not name.startswith(("vendor/", "panes/", "robot/", "graph/", "plot/"))]
    assert {"index.html", "main.js", "style.css", "core/cdr.js", "core/foxglove.js"} <= set(at_once)
    assert sum(found[name] for name in at_once) < MEGABYTE / 20


def test_nothing_is_loaded_from_elsewhere() -> None:
    """The namespace of SVG is a name, no address that is asked."""
    texts = {path: path.read_text(encoding="utf-8") for path in (*OURS, PAGE / "index.html", *PAGE.glob("*.css"))}
    found = {path.name: re.findall(r"https?://[^\s\"'`]+", text) for path, text in texts.items()}
    assert {name: urls for name, urls in found.items() if urls} == {"dom.js": ["http://www.w3.org/2000/svg"]}


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.relative_to(PAGE).as_posix())
def test_a_module_imports_files_that_are_there_and_what_they_export(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for names, source in re.findall(r"^import (?:(.+?) from )?\"([^\"]+)\";", text, re.MULTILINE):
        target = (path.parent / source).resolve()
        assert target.is_file(), source
        if target.parent.name == "vendor" or not names.startswith("{"):
            continue
        exported = set(
            re.findall(r"^export (?:async )?(?:function\*?|class|const) (\w+)", target.read_text(), re.MULTILINE)
        )
        assert {name.strip() for name in names.strip("{} ").split(",")} <= exported, source
    assert len(text.splitlines()) <= 800
    assert re.match(r"// \w", text), "a module says in its first line what it is about"


def test_what_others_wrote_is_named_with_its_version_and_its_licence() -> None:
    pins = json.loads((PAGE / "vendor" / "package.json").read_text())["dependencies"]
    notice = (PAGE / "vendor" / "NOTICE").read_text(encoding="utf-8")
    titles = dict(re.findall(r"^== (\S+) (\S+)$", notice, re.MULTILINE))
    assert titles == pins
    assert notice.count("Permission is hereby granted, free of charge") == len(pins)
    assert {path.stem for path in (PAGE / "vendor").glob("*.js")} == {name.rpartition("/")[2] for name in pins}
    revision = pins["three"].split(".")[1]
    assert f'"{revision}"' in (PAGE / "vendor" / "three.js").read_text(encoding="utf-8")
