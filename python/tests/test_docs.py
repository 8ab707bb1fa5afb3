"""The code blocks of the documentation run, page by page, in the order in which they stand."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = ["README.md", "python/README.md", *sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs/site/pages").rglob("*.md"))]
BLOCK = re.compile(r"^```(python|console)\n(.*?)^```", re.MULTILINE | re.DOTALL)

# What makes no picture and is not Python: how the package and the program are built.
NOT_RUN = ("pip install", "cargo ")

# Packages that a page uses beside trimesh.
NEEDED = {"sun.md": ("pandas", "pvlib", "xarray", "zarr", "matplotlib", "pyvista")}

pytest.importorskip("trimesh", reason="trimesh is not installed: the tutorial that uses it cannot run")


def run_command(line: str) -> None:
    words = shlex.split(line)
    assert words[0] == "antumbra", line
    command = [sys.executable, "-m", "antumbra", *words[1:]]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in NEEDED.get(page.rpartition("/")[2], ()):
        pytest.importorskip(package, reason=f"{package} is not installed: {page} cannot run")
    monkeypatch.chdir(tmp_path)
    text = (ROOT / page).read_text(encoding="utf-8")
    names: dict[str, Any] = {"__name__": page}
    for block in BLOCK.finditer(text):
        kind, code = block.groups()
        if kind == "python":
            # Lines of the page, in tracebacks.
            first_line = text[: block.start(2)].count("\n")
            exec(compile("\n" * first_line + code, str(ROOT / page), "exec"), names)
        elif page != "README.md":
            for line in code.splitlines():
                line = line.removeprefix("$ ")
                if not line.startswith(NOT_RUN):
                    run_command(line)


def test_the_tutorials_have_code() -> None:
    """A page whose blocks are not found would pass in silence."""
    for name, least in (("picture", 8), ("visibility", 10), ("cookbook", 8), ("sun", 11)):
        text = (ROOT / f"docs/site/pages/tutorials/{name}.md").read_text(encoding="utf-8")
        assert len(BLOCK.findall(text)) >= least, name
    assert any(kind == "python" for kind, _ in BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8")))
    assert os.path.exists(ROOT / "docs/site/mkdocs.yml")
