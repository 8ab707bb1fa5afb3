"""`python -m antumbra` is the program `antumbra`."""

import sys

from ._antumbra import run


def main() -> int:
    """Runs the program on the command line of this process and returns its exit code."""
    sys.stdout.flush()
    sys.stderr.flush()
    return run(["antumbra", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
