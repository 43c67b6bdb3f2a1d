"""Whether the pages of a built site lead anywhere: python tests/release/built_site.py build/site"""

import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

FETCHED = ('<script src="http', '<link rel="stylesheet" href="http')


class Page(HTMLParser):
    """What a page links to, and the places in it that can be linked to."""

    def __init__(self, file):
        super().__init__()
        self.targets, self.places = set(), set()
        self.feed(file.read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.targets.add(value)
            elif name in ("id", "name") and value:
                self.places.add(value)


@cache
def page(file):
    return Page(file)


def broken_links(folder):
    """Links of all pages to files and places that are not there, as (page, target); none into the network is asked."""
    broken = []
    for file in sorted(Path(folder).rglob("*.html")):
        for target in sorted(page(file).targets):
            if ":" in target.split("/")[0]:  # http:, mailto:, data:
                continue
            path, _, place = unquote(target).partition("#")
            other = (file.parent / path.split("?")[0]).resolve() if path else file
            there = other.is_file() and (not place or other.suffix != ".html" or place in page(other).places)
            if not there:
                broken.append((file.relative_to(folder).as_posix(), target))
    return broken


def from_the_network(folder):
    """Scripts and styles that a page would load from elsewhere, as (page, target): none, so that it works without."""
    found = []
    for file in Path(folder).rglob("*.html"):
        text = file.read_text("utf-8")
        found += [(file.name, begin) for begin in FETCHED if begin in text]
    return found


if __name__ == "__main__":
    wrong = broken_links(sys.argv[1]) + from_the_network(sys.argv[1])
    for where, target in wrong:
        print(f"{where}: {target}")
    sys.exit(bool(wrong))
