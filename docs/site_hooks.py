"""What the site differs in from the pages as a repository shows them (mkdocs calls these functions)."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Any

_LINK = re.compile(r"\[([^\]]*)\]\(([^)#:\s]+)(#[^)\s]*)?\)")


def on_page_markdown(markdown: str, /, *, page: Any, **_: Any) -> str:
    """Name files of the repository that are no pages of the site instead of linking to them."""
    folder = PurePosixPath(page.file.src_uri).parent

    def shown(match: re.Match[str]) -> str:
        depth = 0
        for part in (folder / match[2]).parts:
            depth += -1 if part == ".." else 1
            if depth < 0:
                return f"{match[1]} (`{re.sub(r'^([.][.]/)+', '', match[2])}`)"
        return match[0]

    return _LINK.sub(shown, markdown)
