"""What the package reports of what may not be what the caller meant."""

from __future__ import annotations

import sys
import warnings


class AntumbraWarning(UserWarning):
    """What may not be what the caller meant: a part of a file that was ignored or guessed, a sun from below."""


def warn(message: str) -> None:
    """Warns at the line of the caller's own that led here."""
    level, frame = 1, sys._getframe()
    package = __name__.partition(".")[0]
    while frame.f_back is not None and str(frame.f_globals.get("__name__", "")).partition(".")[0] == package:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, AntumbraWarning, stacklevel=level)


def warn_of_surfaces(name: str, share: tuple[int, int] | None, remedy: str) -> None:
    """Warns that many points of space lie on surfaces; of how many, if `share` says so."""
    if share is None:
        return
    on_surface, looked_at = share
    percent = 100 * on_surface // looked_at
    verb = "Call" if remedy.startswith("occluded") else "Give"
    warn(
        f"{name}: {on_surface} of {looked_at} that were looked at ({percent} %) lie on surfaces, but are answered as "
        "points of space: rounding may put them into the shadow of the surface that they lie on. "
        f"{verb} {remedy} for points of surfaces"
    )
