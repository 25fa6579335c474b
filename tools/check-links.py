#!/usr/bin/env python3
"""Says which links in the documents lead nowhere, and which files they name that are not there.

    tools/check-links.py

Of every Markdown file: relative links with their headings, and paths in backticks, which are the
repository's or the page's folder's.
"""

import pathlib
import re
import subprocess
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")
PATH = re.compile(
    r"`((?:benches|boards|cli|docs|examples|fuzz|host|host-sim|src|tests|tools)/[\w./-]+"
    r"\.(?:rs|sh|py|md|txt|toml))`"
)


def anchors(text):
    """The names of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    words = (re.sub(r"[^\w\s-]", "", heading.lower()) for heading in headings)
    return {re.sub(r"\s", "-", word.strip()) for word in words}


def wrong(page):
    """What is wrong with a page, a line each."""
    text = page.read_text()
    bare = re.sub(r"^(```|    ).*$", "", text, flags=re.MULTILINE)
    for link in LINK.findall(bare):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, heading = link.partition("#")
        target = page.parent / place if place else page
        if not target.exists():
            yield f"{page}: {link}: there is no {target}"
        elif heading and target.suffix == ".md" and heading not in anchors(target.read_text()):
            yield f"{page}: {link}: there is no such heading"
    for path in PATH.findall(text):
        # NAME stands for whatever a reader adds.
        places = (pathlib.Path(path), page.parent / path)
        if "NAME" not in path and not any(place.exists() for place in places):
            yield f"{page}: `{path}` is not there"


def main():
    pages = subprocess.check_output(["git", "ls-files", "*.md"], text=True).split()
    found = [line for page in pages for line in wrong(pathlib.Path(page))]
    print("\n".join(found) if found else f"all links of {len(pages)} pages lead somewhere")
    sys.exit(bool(found))


main()
