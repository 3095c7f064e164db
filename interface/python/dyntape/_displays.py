# SPDX-License-Identifier: BSD-3-Clause
"""What notebooks show of results without pages: facts, curves over time, tables."""

from __future__ import annotations

import collections
import html
from collections.abc import Callable
from typing import Any

import numpy as np

from ._pictures import table

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")


def curves(t: Any, rows: Any, title: str) -> str:
    """(times,) and (times, n) as an SVG picture of n curves; its range is written at the left."""
    width, height = 480, 120
    t, rows = np.asarray(t, float)[: len(rows)], np.asarray(rows, float)
    if rows.size == 0 or not np.isfinite(rows).any():
        return ""
    low, high = float(np.nanmin(rows)), float(np.nanmax(rows))
    x = width * (t - t[0]) / max(t[-1] - t[0], 1e-300)
    y = height * (high - rows) / max(high - low, 1e-300)
    lines = ""
    for k in range(rows.shape[1]):
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y[:, k]) if np.isfinite(b))
        lines += f'<polyline points="{points}" fill="none" stroke="{COLORS[k % len(COLORS)]}" stroke-width="1.5"/>'
    caption = f"{title}: {low:.4g} to {high:.4g}, {t[0]:.4g} to {t[-1]:.4g} s"
    return (
        f'<figure><svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" style="border:1px solid #888">{lines}</svg>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def facts(result: Any, names: tuple[str, ...]) -> str:
    return f"<p>{html.escape(repr(result))}</p>" + table(("", ""), [(name, getattr(result, name)) for name in names])


def ddp_page(result: Any) -> str:
    """Of a DdpSolution."""
    names = ("verdict", "status", "success", "cost", "iterations", "slope", "integration_error", "seconds")
    return facts(result, names) + curves(result.t, result.x, "states") + curves(result.t, result.u, "controls")


def ddp_batch_page(result: Any) -> str:
    """Of DdpSolutions: how many ended in which way, and the range of their costs and iterations."""
    ended = collections.Counter(map(str, result.status))
    ranges = [
        (name, float(np.min(values)), float(np.median(values)), float(np.max(values)))
        for name, values in (("cost", result.cost), ("iterations", result.iterations))
    ]
    text = f"<p>{html.escape(repr(result))}</p>" + table(("status", "motions"), list(ended.items()))
    return text + table(("", "least", "median", "most"), ranges)


def step_page(step: Any) -> str:
    """Of a MpcStep: the plan."""
    text = facts(step, ("usable", "status", "iterations", "cost", "violation", "seconds"))
    return text + curves(step.t, step.x, "states of the plan") + curves(step.t, step.u, "controls of the plan")


def loop_page(loop: Any) -> str:
    """Of a ClosedLoop: its report and motion."""
    text = f"<pre>{html.escape(loop.text())}</pre>"
    return text + curves(loop.t, loop.x, "states") + curves(loop.t, loop.u, "controls")


def identification_page(found: Any) -> str:
    """Each base parameter with its deviation and the value of the robot's file."""
    rows = [(name, float(a), float(b), float(c)) for name, a, b, c in zip(found.names, found.values, found.deviations, found.nominal)]
    return f"<p>{html.escape(repr(found))}</p>" + table(("base parameter", "value", "+-", "file"), rows)


def scene_page(scene: Any) -> str:
    rows = [(name, getattr(scene, name)) for name in ("name", "integrator", "step", "duration", "nq", "nv", "nu")]
    rows += [("driven", ", ".join(scene.driven)), *(("note", note) for note in scene.notes)]
    return table(("scene", ""), rows)


def task_page(task: Any) -> str:
    return table(("task", ""), [("name", task.name), *(("note", note) for note in task.notes)]) + f"<pre>{html.escape(task.effective)}</pre>"


PAGES: dict[str, Callable[[Any], str]] = {
    "ClosedLoop": loop_page,
    "DdpSolution": ddp_page,
    "DdpSolutions": ddp_batch_page,
    "Identification": identification_page,
    "MpcStep": step_page,
    "Scene": scene_page,
    "Task": task_page,
}


def show_in_notebooks(module: Any) -> None:
    """Gives these classes of the module their pages."""
    for name, page in PAGES.items():
        getattr(module, name)._repr_html_ = page
