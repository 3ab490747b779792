"""What must not be on a built site: links that lead nowhere, pictures without a text, and anything that a browser would fetch from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}
"""The attributes whose addresses a browser opens by itself."""


class Links(HTMLParser):
    """The anchors of a page, the addresses that it names, and those that a browser opens by itself."""

    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.named: list[str] = []
        self.fetched: list[str] = []
        self.without_text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.anchors |= {found[name] for name in ("id", "name") if name in found}
        if tag == "img" and not found.get("alt"):
            self.without_text.append(found.get("src", ""))
        if tag == "a" and "href" in found:
            self.named.append(found["href"])
        elif found.get(FETCHED.get(tag, ""), "") and found.get("rel") not in ("canonical", "prev", "next"):
            self.fetched.append(found[FETCHED[tag]])


def faults(site: Path) -> Iterator[str]:
    """A line for each fault of the site in this folder."""
    read: dict[Path, Links] = {}
    for path in sorted(site.rglob("*.html")):
        read[path] = Links()
        read[path].feed(path.read_text(encoding="utf-8"))
    for path, links in read.items():
        page = path.relative_to(site)
        if page.name == "404.html":  # it is shown for any address, so its links are absolute
            continue
        yield from (f"{page}: the picture {address} has no text" for address in links.without_text)
        yield from (
            f"{page}: fetched from elsewhere: {address}" for address in links.fetched if urlsplit(address).netloc
        )
        for address in [*links.named, *links.fetched]:
            if not leads_somewhere(path, address, read):
                yield f"{page}: {address} leads nowhere"


def leads_somewhere(path: Path, address: str, read: dict[Path, Links]) -> bool:
    """Whether a link of the page `path` leads to a file of the site, and to an anchor there; what is elsewhere is not looked at."""
    parts = urlsplit(address)
    if parts.scheme or parts.netloc:
        return True
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    target = target / "index.html" if target.is_dir() else target
    if not target.is_file():
        return False
    anchor = unquote(parts.fragment)
    return not anchor or target not in read or anchor in read[target].anchors
