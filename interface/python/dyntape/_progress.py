# SPDX-License-Identifier: BSD-3-Clause
"""What long work says of itself, in one line that is written over."""

from __future__ import annotations

import sys


class Line:
    """progress=True: shows each word in the place of the last, on stderr; a notebook shows it below the cell."""

    def __init__(self) -> None:
        self._width = 0

    def __call__(self, word: str) -> None:
        sys.stderr.write("\r" + word.ljust(self._width))
        sys.stderr.flush()
        self._width = len(word)

    def erase(self) -> None:
        """Takes it away, so that the results stand in its place."""
        sys.stderr.write("\r" + " " * self._width + "\r" if self._width else "")
        sys.stderr.flush()
