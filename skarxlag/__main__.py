"""``python -m skarxlag``, the same as the console script ``skarxlag``."""

import sys

from .commands import main

if __name__ == "__main__":
    sys.exit(main())
