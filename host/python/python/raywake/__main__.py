"""The program ``raywake``: ``python -m raywake --help``."""

import sys

from ._raywake import main as _main


def main() -> int:
    """Carries out the command line. Returns the exit code."""
    return _main(["raywake", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
