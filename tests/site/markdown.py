"""What the site and the tests of the documents need to know of Markdown: code, headlines with their anchors, links."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

FENCE = re.compile(r"^( *)(```+)(.*?)\n(.*?)^\1\2 *$\n?", re.MULTILINE | re.DOTALL)
HEADLINE = re.compile(r"^(#{1,6}) +(.+?) *$", re.MULTILINE)
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
CODE = re.compile(r"(`+)(?!`)(.+?)(?<!`)\1(?!`)", re.DOTALL)


def in_prose(text: str, change: Callable[[str], str]) -> str:
    """The text with the change made to what is not in a block of code."""
    parts: list[str] = []
    end = 0
    for block in FENCE.finditer(text):
        parts += [change(text[end : block.start()]), block[0]]
        end = block.end()
    return "".join([*parts, change(text[end:])])


def fenced(text: str, change: Callable[[str, str], str | None]) -> str:
    """The text with other blocks of code: `change` is given the language and the code of each, and keeps it by returning None."""

    def changed(block: re.Match[str]) -> str:
        found = change(block[3].strip(), block[4])
        return block[0] if found is None else found

    return FENCE.sub(changed, text)


def blocks(text: str) -> Iterator[tuple[str, str]]:
    """Language and code of each block of code."""
    for block in FENCE.finditer(text):
        yield block[3].strip(), block[4]


def headlines(text: str) -> Iterator[tuple[int, str, str]]:
    """Level, words and anchor of each headline, as GitHub makes them: the second of one anchor gets a number."""
    seen: dict[str, int] = {}
    for marks, words in HEADLINE.findall(FENCE.sub("", text)):
        slug = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
        count = seen[slug] = seen.get(slug, -1) + 1
        yield len(marks), words, f"{slug}-{count}" if count else slug


def anchored(text: str) -> str:
    """The text with the anchor of each headline written behind it, so that every generator makes the same."""
    anchors = iter([anchor for _, _, anchor in headlines(text)])
    return in_prose(text, lambda prose: HEADLINE.sub(lambda line: f"{line[0].rstrip()} {{#{next(anchors)}}}", prose))


def links(text: str) -> Iterator[str]:
    """The targets of the links and images of a text."""
    for _, _, target in LINK.findall(CODE.sub("`code`", FENCE.sub("", text))):
        yield target


def relinked(text: str, moved: Callable[[str, str], tuple[str, str | None]]) -> str:
    """The text with other links: `moved` is given words and target of each; one without a target is only its words."""

    def changed(link: re.Match[str]) -> str:
        words, target = moved(link[2], link[3])
        return words if target is None else f"{link[1]}[{words}]({target})"

    return in_prose(text, lambda prose: LINK.sub(changed, prose))
