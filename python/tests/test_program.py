"""`python -m antumbra` and the command `antumbra` are the program."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import antumbra
import pytest

MODULE = [sys.executable, "-m", "antumbra"]
COMMAND = [str(Path(sysconfig.get_path("scripts")) / "antumbra")]


def program(*arguments: str, how: list[str] = MODULE) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*how, *arguments], capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("how", [MODULE, COMMAND])
def test_it_says_its_version_and_help(how: list[str]) -> None:
    version = program("--version", how=how)
    assert (version.returncode, version.stdout) == (0, f"antumbra {antumbra.__version__}\n")
    helped = program("--help", how=how)
    assert helped.returncode == 0 and "Usage: antumbra" in helped.stdout and "render" in helped.stdout


def test_exit_codes_have_their_meaning(tmp_path: Path) -> None:
    unknown = program("dance")
    assert unknown.returncode == 2 and "dance" in unknown.stderr
    absent = program("inspect", str(tmp_path / "none.nff"))
    assert absent.returncode == 2 and "none.nff" in absent.stderr


def test_a_scene_is_made_converted_and_looked_at(tmp_path: Path) -> None:
    made = program("scene", "tetra", "--size", "1", "-o", str(tmp_path / "tetra.nff"))
    assert made.returncode == 0, made.stderr
    converted = program("convert", str(tmp_path / "tetra.nff"), str(tmp_path / "tetra.glb"))
    assert converted.returncode == 0, converted.stderr
    scene = antumbra.Scene.load(tmp_path / "tetra.glb")
    assert scene.triangle_count == antumbra.Scene.load(tmp_path / "tetra.nff").triangle_count > 0


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
def test_ctrl_c_leaves_the_partial_picture(tmp_path: Path) -> None:
    assert program("scene", "tetra", "--size", "5", "-o", str(tmp_path / "tetra.nff")).returncode == 0
    picture = tmp_path / "picture.png"
    arguments = ["--verbose", "render", str(tmp_path / "tetra.nff"), "--spp", "65536", "-o", str(picture)]
    child = subprocess.Popen([*MODULE, *arguments], stderr=subprocess.PIPE, text=True)
    assert child.stderr is not None
    try:
        # The last line before pixels are made.
        while "prepared in" not in (line := child.stderr.readline()):
            assert line, "the program ended"
        time.sleep(0.5)
        os.kill(child.pid, signal.SIGINT)
        assert child.wait(timeout=60) == 130
        assert picture.read_bytes().startswith(b"\x89PNG")
    finally:
        child.kill()
        child.wait()
        child.stderr.close()
