"""The pages of docs/start/: what a reader types there works, and prints what stands there."""

from __future__ import annotations

import re
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest

from tests.tools.tutorial_pages import ELSEWHERE, FOLDER, PAGES, Reader, blocks, commands_of, earlier, masked, played

REMEDY = "run python -m tests.tools.tutorial_pages"


def text_of(page: str) -> str:
    return (FOLDER / page).read_text(encoding="utf-8")


def test_each_page_leads_to_the_next() -> None:
    for page, after in pairwise(PAGES):
        assert f"]({after})" in text_of(page)


@pytest.mark.parametrize("page", PAGES)
def test_its_links_lead_to_pages_and_sections_that_exist(page: str) -> None:
    links = re.findall(r"\]\(([^)#]+)(?:#([^)]*))?\)", text_of(page))
    assert links
    for file, section in links:
        target = (FOLDER / file).resolve()
        assert target.is_file(), file
        titles = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
        assert not section or section in {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES)
def test_it_is_short_and_nothing_on_it_fails_by_mistake(page: str) -> None:
    text = text_of(page)
    outputs = sum(len(shown) for kind, body in blocks(text) if kind == "text" for _, shown in commands_of(body))
    assert len(text.splitlines()) - outputs <= 120
    assert "Traceback" not in text


@pytest.mark.parametrize("page", PAGES[1:5])
def test_its_programs_print_on_the_virtual_clock_what_stands_there(page: str, tmp_path: Path) -> None:
    tried = 0
    with ExitStack() as stack:
        reader = Reader(tmp_path, stack)
        for body in earlier(page):
            reader.save(body)
        for kind, body in blocks(text_of(page)):
            if kind != "text":
                reader.save(body)
                continue
            for command, shown in commands_of(body):
                if re.match(r"\$ (python (\w+\.py|-m pytest)|robactor launch .*--clock virtual)", command):
                    printed = reader.typed(command.removeprefix("$ "), shown)
                    assert masked("\n".join(printed)) == masked("\n".join(shown)), f"{command}: {REMEDY}"
                    tried += 1
    assert tried >= 1


@pytest.mark.realtime
@pytest.mark.parametrize("page", PAGES)
def test_every_command_of_it_prints_what_stands_there(page: str) -> None:
    assert masked(played(text_of(page), earlier(page))) == masked(text_of(page)), REMEDY


def test_a_page_is_read_as_files_and_commands_with_their_outputs() -> None:
    page = "words\n```python\n# a.py\nprint(1)\n```\n```text\n$ python a.py\n1\n\n$ ls\n(another terminal) $ b\n```\n"
    (file, (kind, terminal)) = blocks(page)
    assert file == ("python", "# a.py\nprint(1)\n")
    assert (kind, list(commands_of(terminal))) == (
        "text",
        [("$ python a.py", ["1"]), ("$ ls", []), (f"{ELSEWHERE}$ b", [])],
    )


def test_what_a_program_prints_is_put_below_its_command_with_its_exit_code(tmp_path: Path) -> None:
    page = "```python\n# a.py\nimport sys\nprint('one'); print('two')\nsys.exit(3)\n```\n```text\n$ python a.py\nold\n```\n"
    assert played(page).endswith("$ python a.py\none\ntwo\n(exit code 3)\n```\n")
    slow = page.replace("sys.exit(3)", "sys.stdout.flush(); import time; time.sleep(60)").replace("old\n", "old\n^C\n")
    assert played(slow).endswith("$ python a.py\none\n^C\n```\n")


def test_only_what_differs_from_run_to_run_is_masked() -> None:
    assert masked("$ x topic hz /a\nrate: 1.5\n$ x node list\n/node_1\n") == masked(
        "$ x topic hz /a\nrate: 1.7\n$ x node list\n/node_1\n"
    )
    assert masked("$ x node list\n/node_1\n") != masked("$ x node list\n/node_2\n")
    assert (
        masked("    0.631 [info ] 5 done") == masked("    0.700 [info ] 5 done") != masked("    0.631 [info ] 6 done")
    )
    assert masked("2 passed in 1.04s") == masked("2 passed in 9.99s") != masked("1 passed in 1.04s")
