"""The stub fits the binary, and the package passes a strict type check."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy", reason="mypy is not installed: types are not checked")
pytest.importorskip("trimesh", reason="trimesh is not installed: antumbra.ray cannot be imported")


def check(*command: str, folder: Path) -> None:
    # Away from the sources, so that it is the installed package that is checked.
    done = subprocess.run([sys.executable, "-m", *command], cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stub_is_that_of_the_binary(tmp_path: Path) -> None:
    check("mypy.stubtest", "antumbra._antumbra", folder=tmp_path)


def test_the_package_is_typed(tmp_path: Path) -> None:
    # Parts of trimesh have no types.
    check("mypy", "--strict", "--untyped-calls-exclude", "trimesh", "-p", "antumbra", folder=tmp_path)
