"""Pages of the repository inside of the site.

A line `--8<-- "docs/cli.md"` becomes that file, and `--8<-- "README.md#Rust"` its part of that heading. A link to a file
that is a page here leads to the page; what links to other files of the repository becomes plain text.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]

# Files of the repository, and the pages that hold them.
PAGES = {
    "EXACTNESS.md": "exactness.md",
    "docs/cli.md": "cli.md",
    "docs/fog.md": "fog.md",
    "docs/formats.md": "formats.md",
    "docs/glass.md": "glass.md",
    "docs/curved.md": "curved.md",
    "docs/bumps.md": "bumps.md",
    "docs/glossary.md": "glossary.md",
    "docs/lights.md": "lights.md",
    "docs/performance.md": "performance.md",
    "docs/statistics.md": "formats.md",
    "docs/sun.md": "sun.md",
}

PICTURES = ["sphereflake.png", "sphereflake-occlusion.png", "soft.png", "soft-occlusion.png", "window.png", "bumps.png", "no-bumps.png", "offsets.svg", "sun.png", "teapot.png", "gyroid.png"]

INCLUDE = re.compile(r'^--8<-- "([^"#]+)(?:#([^"]+))?"$', re.MULTILINE)
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)#:]+)(#[^)]*)?\)")
PICTURE = re.compile(r"\]\((?:docs/|\.\./\.\./)?images/")


def on_files(files: Any, config: Any) -> Any:
    """Adds the pictures of the README."""
    for name in PICTURES:
        source = str(ROOT / "docs/images" / name)
        files.append(File.generated(config, f"images/{name}", abs_src_path=source))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Puts files where a page names them; pictures are those that `on_files` adds."""
    whole = INCLUDE.sub(lambda found: included(found[1], found[2]), markdown)
    return PICTURE.sub("](images/", whole)


def included(path: str, heading: str | None) -> str:
    """Returns a file, or its part of a heading of the second level without that heading, with links that lead somewhere."""
    text = (ROOT / path).read_text(encoding="utf-8")
    if heading is not None:
        _, _, text = text.partition(f"\n## {heading}\n")
        if not text:
            raise ValueError(f"{path} has no heading {heading}")
        text, _, _ = text.partition("\n## ")

    def link(found: re.Match[str]) -> str:
        name, target, anchor = found.groups()
        page = PAGES.get(posixpath.normpath(posixpath.join(posixpath.dirname(path), target)))
        return name if page is None else f"[{name}]({page}{anchor or ''})"

    return LINK.sub(link, text)
