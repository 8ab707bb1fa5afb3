"""What workers are given: something that each makes once, and parts that are answered with it.

In: parts. Out: answers. Invariant: an answer depends on the work and the part, never on who answers. Work and parts are
pickled. Absent here: what is answered, where.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable
from typing import Any, Protocol


class Work(Protocol):
    """Work that is cut into parts."""

    def begin(self, threads: int) -> Any:
        """Makes what answers need, once a worker."""
        ...

    def answer(self, made: Any, part: Any, threads: int) -> Any:
        """Answers a part with what `begin` made."""
        ...


def answers_here(work: Work, parts: Iterable[tuple[int, Any]], threads: int) -> Generator[tuple[int, Any], None, None]:
    """Answers numbered parts in this process, one after another."""
    made = work.begin(threads)
    for number, part in parts:
        yield number, work.answer(made, part, threads)
