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


def table(head: tuple[str, ...], rows: list[tuple[Any, ...]]) -> str:
    def cells(tag: str, row: tuple[Any, ...]) -> str:
        return "".join(f"<{tag}>{html.escape(f'{c:.6g}' if isinstance(c, float) else str(c))}</{tag}>" for c in row)

    return f"<table><tr>{cells('th', head)}</tr>" + "".join(f"<tr>{cells('td', row)}</tr>" for row in rows) + "</table>"


def _pattern_picture(title: str, rows: int, cols: int, pattern: Any) -> str:
    """Non-zeros of a matrix as squares."""
    unit = max(1.0, min(12.0, 240 / max(rows, cols, 1)))
    squares = "".join(
        f'<rect x="{c * unit:.4g}" y="{r * unit:.4g}" width="{unit:.4g}" height="{unit:.4g}"/>' for r, c in zip(*pattern)
    )
    size = f'width="{cols * unit:.4g}" height="{rows * unit:.4g}"'
    caption = f"{title}: {len(pattern[0])} of {rows * cols}"
    return f'<figure style="display:inline-block"><svg xmlns="http://www.w3.org/2000/svg" {size} style="border:1px solid #888" fill="#36c">{squares}</svg><figcaption>{caption}</figcaption></figure>'


def function_page(function: Any) -> str:
    """Sizes of a function, and the non-zeros of its derivatives up to 500 variables and results."""
    text = f"<p>{html.escape(repr(function))}</p>"
    if max(function.n_x, function.n_y) > 500:
        return text
    jacobian = _pattern_picture("Jacobian", function.n_y, function.n_x, function.jacobian_pattern)
    hessian = _pattern_picture("Hessian, lower triangle", function.n_x, function.n_x, function.hessian_pattern)
    return text + jacobian + hessian


def robot_page(robot: Any) -> str:
    """The joints of a robot with their limits; joints of several degrees of freedom have none."""
    sizes = {"spherical": 3, "planar": 3, "free-flyer": 6}
    rows, k = [], 0
    for name, kind in zip(robot.joints, robot.joint_types):
        n = sizes.get(kind, 1)
        limits = [float(a[k]) for a in (robot.lower_limits, robot.upper_limits, robot.velocity_limits, robot.effort_limits)]
        rows.append((name, kind, *(limits if n == 1 else [""] * 4)))
        k += n
    head = ("joint", "type", "lower", "upper", "speed", "effort")
    return f"<p>{html.escape(repr(robot))}</p>" + table(head, rows)


def problem_page(problem: Any) -> str:
    """The states with their bounds and ends, the controls and the terms of a Problem."""

    def number(value: float) -> str:
        return "free" if np.isnan(value) else f"{value:.6g}"

    (lower, upper), (u_lower, u_upper) = problem.state_bounds, problem.control_bounds
    states = [
        (name, number(start), number(goal), *map(number, bounds))
        for name, start, goal, *bounds in zip(problem.states, problem.start, problem.goal, lower, upper)
    ]
    controls = [(name, *map(number, bounds)) for name, *bounds in zip(problem.controls, u_lower, u_upper)]
    return (
        f"<p>{html.escape(repr(problem))}</p>"
        + table(("state", "start", "goal", "lower", "upper"), states)
        + table(("control", "lower", "upper"), controls)
        + table(("term", "where", "role"), problem.terms)
    )
