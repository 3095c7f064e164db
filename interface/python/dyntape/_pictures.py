# SPDX-License-Identifier: BSD-3-Clause
"""Results in notebooks: pages that play motions, pictures."""

from __future__ import annotations

import html
import os
import pathlib
import tempfile
from typing import Any

import numpy as np


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


def meshes_of(solution: Any) -> str:
    """The verdict of a Problem's solution, and a table of its meshes."""
    columns = ("intervals", "iterations", "cost", "status", "defect", "passed", "cost_error", "seconds")
    head = "".join(f"<th>{c}</th>" for c in columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{m[c]:.6g}</td>" if isinstance(m[c], float) else f"<td>{m[c]}</td>" for c in columns) + "</tr>"
        for m in solution.meshes
    )
    return f"<p>{html.escape(solution.verdict)}</p><table><tr>{head}</tr>{rows}</table>"


def plot_of(solution: Any) -> Any:
    """States above controls over time, a matplotlib Figure; points of the mesh are marked."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("plot: matplotlib is not installed; pip install matplotlib") from error
    t = np.linspace(0, solution.t[-1], 1000)
    between = solution.at(t)
    parts = [p for p in (("x", solution.states), ("u", solution.controls)) if p[1]]
    figure = Figure(figsize=(8, 3 * len(parts)), layout="constrained")
    for axes, (name, labels) in zip(figure.subplots(len(parts), sharex=True, squeeze=False)[:, 0], parts):
        curves, points = getattr(between, name), getattr(solution, name)
        for k, label in enumerate(labels):
            (line,) = axes.plot(t, curves[:, k], label=label)
            axes.plot(solution.t, points[:, k], ".", markersize=3, color=line.get_color())
        axes.set_ylabel("states" if name == "x" else "controls")
        if len(labels) <= 12:
            axes.legend(fontsize="small")
        axes.grid(alpha=0.3)
    axes.set_xlabel("time [s]")
    figure.suptitle(solution.verdict, fontsize="small")
    return figure


def pictures_of(result: Any) -> Pictures:
    """Those that writing a result makes."""
    with tempfile.TemporaryDirectory() as folder:
        unwritten = result.write(folder)
        found = {path.stem: path.read_text() for path in sorted(pathlib.Path(folder).glob("*.svg"))}
    if not found:
        raise RuntimeError("; ".join(unwritten) or "nothing was drawn")
    return Pictures(found)
