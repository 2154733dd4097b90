"""Files of the repository that are pages of the site, too: their text, with links that lead to the right page."""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = {
    "firmware/README.md": "firmware.md",
    "firmware/dongle/README.md": "dongle.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
"""Where in the site a file of the repository is shown."""
LINK = re.compile(r"(\]\()([^)#:\s]+)((?:#[^)\s]*)?\))")


def included(source: str, page: str) -> str:
    """The text of a Markdown file of the repository as a part of the page named `page`, or code as a block.

    Its first heading is left out, for the page has one. ValueError for a link that leads out of the site.
    """
    text = (ROOT / source).read_text(encoding="utf-8")
    if not source.endswith(".md"):
        return f"```{Path(source).suffix.removeprefix('.').replace('py', 'python')}\n{text}```\n"
    body = re.sub(r"\A# .*\n", "", text)
    return LINK.sub(lambda found: found[1] + _target(source, found[2], page) + found[3], body)


def _target(source: str, link: str, page: str) -> str:
    """A link that is right in the file `source`, as one that is right in `page`."""
    file = os.path.normpath(os.path.join(os.path.dirname(source), link))
    if file not in PAGES and not file.startswith("docs/"):
        raise ValueError(f"{source} links to {link}, which is no page of the site")
    shown = PAGES.get(file) or file.removeprefix("docs/")
    return os.path.relpath(shown, os.path.dirname(page) or ".")
