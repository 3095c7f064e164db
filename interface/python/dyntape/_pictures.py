# SPDX-License-Identifier: BSD-3-Clause
"""Results in notebooks: pages that play motions, pictures."""

from __future__ import annotations

import html
import os
import pathlib
import tempfile
from typing import Any


def frame(page: str, height: int = 480) -> str:
    """A page within another."""
    return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="{height}" frameborder="0"></iframe>'


class Pictures(dict[str, str]):
    """Pictures by name, each the text of an SVG file; a notebook shows them."""

    def _repr_html_(self) -> str:
        return "\n".join(self.values())

    def __repr__(self) -> str:
        return f"<dyntape.Pictures: {', '.join(self) or 'none'}>"

    def save(self, folder: str | os.PathLike[str]) -> list[pathlib.Path]:
        """Writes NAME.svg for each into the folder; returns their paths."""
        to = pathlib.Path(folder)
        to.mkdir(parents=True, exist_ok=True)
        paths = [to / f"{name}.svg" for name in self]
        for path, picture in zip(paths, self.values()):
            path.write_text(picture)
        return paths


def pictures_of(result: Any) -> Pictures:
    """Those that writing a result makes."""
    with tempfile.TemporaryDirectory() as folder:
        unwritten = result.write(folder)
        found = {path.stem: path.read_text() for path in sorted(pathlib.Path(folder).glob("*.svg"))}
    if not found:
        raise RuntimeError("; ".join(unwritten) or "nothing was drawn")
    return Pictures(found)
