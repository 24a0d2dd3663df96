"""What the site differs in from the pages as a repository shows them (mkdocs calls these functions)."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path, PurePosixPath
from typing import Any

_LINK = re.compile(r"\[([^\]]*)\]\(([^)#:\s]+)(#[^)\s]*)?\)")


def on_files(files: Any, /, *, config: Any, **_: Any) -> Any:
    """Add a page for each notebook: its cells and what they showed when it was run."""
    from mkdocs.structure.files import File

    for file in list(files):
        if file.src_uri.endswith(".ipynb"):
            text = Path(file.abs_src_path).read_text(encoding="utf-8")
            name = PurePosixPath(file.src_uri)
            page = f"{notebook_page(text)}\n\n[This notebook]({name.name}) to download.\n"
            files.append(File.generated(config, str(name.with_suffix(".md")), content=page))
    return files


def notebook_page(text: str) -> str:
    """Markdown of a notebook: text as it stands, code fenced, tables and pictures in it."""
    parts = []
    for cell in json.loads(text)["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        parts += [shown for output in cell["outputs"] if (shown := _shown(output))]
    return "\n\n".join(parts)


def _shown(output: dict[str, Any]) -> str:
    """What a cell showed: the richest form of it that a page can hold."""
    if output["output_type"] == "stream":
        return f"```text\n{''.join(output['text']).rstrip()}\n```"
    data = output.get("data", {})
    if "image/png" in data:
        picture = "".join(data["image/png"]).replace("\n", "")
        return f'<img alt="What the cell above draws" src="data:image/png;base64,{picture}">'
    if "text/html" in data:
        # Its own style would be the whole page's; blank lines would end it
        table = re.sub(r"<style.*?</style>", "", "".join(data["text/html"]), flags=re.DOTALL)
        table = table.replace(' border="1" class="dataframe"', "")  # the theme's own, as of other tables
        return re.sub(r"\n\s*\n+", "\n", table).strip()
    plain = "".join(data.get("text/plain", ""))
    return f"<pre>{html.escape(plain)}</pre>" if plain else ""


def on_page_markdown(markdown: str, /, *, page: Any, **_: Any) -> str:
    """Name files of the repository that are no pages of the site instead of linking to them.

    A link to a notebook leads to its page; that page's own link to it is a download.
    """
    folder = PurePosixPath(page.file.src_uri).parent
    own = PurePosixPath(page.file.src_uri).with_suffix(".ipynb").name

    def shown(match: re.Match[str]) -> str:
        depth = 0
        for part in (folder / match[2]).parts:
            depth += -1 if part == ".." else 1
            if depth < 0:
                return f"{match[1]} (`{re.sub(r'^([.][.]/)+', '', match[2])}`)"
        if match[2].endswith(".ipynb") and match[2] != own:
            return f"[{match[1]}]({match[2].removesuffix('.ipynb')}.md{match[3] or ''})"
        return match[0]

    return _LINK.sub(shown, markdown)
