"""What mkdocs does to a page besides what is written there: the parts that are made while the site is built.

A line of its own says where: `<!-- commands -->`, `<!-- api -->`, or `<!-- include PATH -->` for a file in the tree.
"""

from __future__ import annotations

import re
from typing import Any

import api_reference
import command_reference
import included

PART = re.compile(r"^<!-- (commands|api|include (\S+)) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """The page with all its parts."""
    return expanded(markdown, page.file.src_uri)


def expanded(markdown: str, name: str) -> str:
    """The text of the page called `name`, such as `howto/plan.md`, with all its parts."""

    def part(found: re.Match[str]) -> str:
        if found[2]:
            return included.included(found[2], name)
        return api_reference.markdown() if found[1] == "api" else command_reference.markdown()

    return PART.sub(part, markdown)
