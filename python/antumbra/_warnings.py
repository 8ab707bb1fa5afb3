"""What is said beside answers: the category of all warnings of the package."""

from __future__ import annotations

import warnings


class AntumbraWarning(UserWarning):
    """Something was answered or read as documented, and most likely is not what was meant."""


def warn_of_surfaces(name: str, share: tuple[int, int] | None, remedy: str) -> None:
    """Warns the caller's caller that many points of space lie on surfaces; of how many, if `share` says so."""
    if share is None:
        return
    on_surface, looked_at = share
    warnings.warn(
        f"{name}: {on_surface} of {looked_at} that were looked at lie on surfaces, but are answered as points of space: "
        f"rounding may put them into the shadow of the surface that they lie on. Give {remedy} for points of surfaces",
        AntumbraWarning,
        stacklevel=3,
    )
