"""Reporting how far a long call is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeAlias

Reporter: TypeAlias = Callable[[str, int, int], object]
"""What is called with the name of a stage, its steps that are done, and all of them."""

Progress: TypeAlias = bool | Reporter | None
"""`True` for a line on the standard error stream, or what to call instead; `None` or `False` for silence."""


class _Line:
    """A line that is written over until its stage is done."""

    def __init__(self) -> None:
        self._shown = ""

    def __call__(self, stage: str, done: int, count: int) -> None:
        share = 100 * done // max(count, 1)
        text = f"{stage}: {share} %"
        if text == self._shown:
            return
        # What was there may be longer.
        print(f"\r{text:<{len(self._shown)}}", end="\n" if done >= count else "", file=sys.stderr, flush=True)
        self._shown = "" if done >= count else text


def reporter(progress: Progress) -> Reporter | None:
    """Returns what is to be called, if anybody wants to know."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return _Line()
    if callable(progress):
        return progress
    raise TypeError(f"progress: expected True or a callable, found {type(progress).__name__}")
