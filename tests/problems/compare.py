#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Solves problems with known optima by several solvers, and counts what is right, refused, and called solved with a wrong cost.

    PYTHONPATH=build/python build/python_environment/bin/python tests/problems/compare.py [--sets published,closed,drawn]
        [--solvers riccati,ipopt,casadi-ipopt,casadi-fatrop] [--count 40] [--seed N] [--table FILE.md] [--profile FILE.svg] [--only TEXT]
        [--limit 120]

Sets: published and closed are fixed; drawn has --count problems by --seed, by default of the clock, which is printed.
dyntape solves each as a user writes it, without mesh, guess or option; CasADi by 100 intervals of Runge-Kutta 4, right to 1 %.
--by-kind sums the rows of a name.  The profile has one curve a solver: the share of all problems that it solves rightly within a factor
of the least time.  The exit status is 1 if a solve of dyntape's is false, or more than 3 in 100 of a solver of dyntape's are refused.
"""

import argparse
import collections
import importlib.util
import math
import multiprocessing
import sys
import time

from closed import CLOSED
from description import Answer
from drawn import drawn
from published import PUBLISHED
from solvers import SOLVERS


def solve(connection, name, k):
    begin = time.perf_counter()
    try:
        connection.send(SOLVERS[name](k))
    except Exception as error:  # an error is a refusal
        connection.send(Answer(False, math.nan, -1, time.perf_counter() - begin, f"{type(error).__name__}: {error}"))


def answer_of(name, k, limit):
    """In a process of its own: a solve may go on, or end the process."""
    here, there = multiprocessing.Pipe()
    worker = multiprocessing.get_context("fork").Process(target=solve, args=(there, name, k))
    begin = time.perf_counter()
    worker.start()
    there.close()
    try:
        answer = here.recv() if here.poll(limit) else Answer(False, math.nan, -1, limit, f"no end within {limit:g} s")
    except EOFError:
        answer = Answer(False, math.nan, -1, time.perf_counter() - begin, "the process ended")
    worker.kill()
    worker.join()
    return answer


def answers_of(problems, solvers, limit):
    rows = []
    for k in problems:
        row = {}
        for name in solvers:
            a = row[name] = answer_of(name, k, limit)
            word = a.word(k)
            print(f"{k.name[:34]:34} {name:13} {word:7} {a.cost:14.8g} of {min(k.optima) if hasattr(k.optima, '__len__') else k.optima:14.8g}"
                  f" {a.iterations:5d} {a.seconds:7.2f} s" + ("" if word == "right" else "  " + a.verdict[:110].replace("\n", " ")), flush=True)  # fmt: skip
        rows.append((k, row))
    return rows


def row_table(rows, solvers):
    yield ["problem", "source", "optimum"] + [f"{name}: {what}" for name in solvers for what in ("iterations", "s")]
    for k, row in rows:
        cells = []
        for name in solvers:
            a = row[name]
            word = a.word(k)
            cells += [str(a.iterations) if word == "right" else word, f"{a.seconds:.2f}"]
        yield [k.name, k.source, f"{k.optima:.7g}", *cells]


def kind_table(rows, solvers):
    counts = collections.defaultdict(collections.Counter)
    seconds = collections.Counter()
    for k, row in rows:
        for name in solvers:
            for kind in (k.name, "all"):
                counts[kind, name][row[name].word(k)] += 1
            seconds[name] += row[name].seconds
    yield ["kind", *solvers]
    for kind in [*sorted({k.name for k, _ in rows}), "all"]:
        yield [kind] + [", ".join(f"{counts[kind, name][word]} {word}" for word in ("right", "refused", "false")) for name in solvers]
    yield ["seconds"] + [f"{seconds[name]:.0f}" for name in solvers]


def draw_profile(rows, solvers, path):
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, value, label in ((axes[0], lambda a: a.seconds, "time"), (axes[1], lambda a: a.iterations, "iterations")):
        for name in solvers:
            ratios = []
            for k, row in rows:
                right = {n: max(value(a), 1e-9) for n, a in row.items() if a.word(k) == "right" and value(a) > 0}
                if name in right:
                    ratios.append(right[name] / min(right.values()))
            ratios.sort()
            axis.step([1, *ratios, 1e3], [0, *((i + 1) / len(rows) for i in range(len(ratios))), len(ratios) / len(rows)], where="post", label=name)
        axis.set(xscale="log", xlim=(1, 1000), ylim=(0, 1.02), xlabel=f"factor of the least {label}")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel(f"share of {len(rows)} problems solved rightly")
    axes[0].legend(loc="lower right", fontsize=8)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def quantile(values, share):
    values = sorted(values)
    return values[min(int(share * len(values)), len(values) - 1)] if values else -1


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--sets", default="published,closed,drawn")
    options.add_argument("--solvers", default="riccati,ipopt", help=", ".join(SOLVERS))
    options.add_argument("--count", type=int, default=40, help="of drawn problems")
    options.add_argument("--seed", type=int, default=int(time.time()))
    options.add_argument("--limit", type=float, default=120, help="seconds of one solve")
    options.add_argument("--only", default="", help="problems whose name contains this")
    options.add_argument("--by-kind", action="store_true", help="a row of the table for each name, not each problem")
    options.add_argument("--table", help="write the table there, Markdown")
    options.add_argument("--profile", help="write the performance profile there, a picture")
    given = options.parse_args()
    solvers, sets = given.solvers.split(","), given.sets.split(",")
    if unknown := [s for s in solvers if s not in SOLVERS] + [s for s in sets if s not in ("published", "closed", "drawn")]:
        options.error(f"unknown: {', '.join(unknown)}; solvers are {', '.join(SOLVERS)}, sets published, closed and drawn")
    if "drawn" in sets:
        print(f"seed {given.seed}", flush=True)
    if importlib.util.find_spec("dyntape") is None:
        print("compare: the package dyntape is not in reach, which tools/build --python makes")
        return 77
    of_sets = {"published": PUBLISHED, "closed": CLOSED, "drawn": list(drawn(given.seed, given.count)) if "drawn" in sets else []}
    rows = answers_of([k for s in sets for k in of_sets[s] if given.only in k.name], solvers, given.limit)
    table = list((kind_table if given.by_kind else row_table)(rows, solvers))
    lines = ["| " + " | ".join(row) + " |" for row in (table[0], ["---"] * len(table[0]), *table[1:])]
    if given.table:
        with open(given.table, "w") as file:
            file.write("\n".join(lines) + "\n")
    if given.profile:
        draw_profile(rows, solvers, given.profile)
    failed = False
    for name in solvers:
        words = collections.Counter(row[name].word(k) for k, row in rows)
        right = [row[name].iterations for k, row in rows if row[name].word(k) == "right"]
        print(f"{name}: {words['right']} right, {words['refused']} refused, {words['false']} false of {len(rows)}; iterations: median "
              f"{quantile(right, 0.5)}, nine in ten {quantile(right, 0.9)}; {sum(row[name].seconds for _, row in rows):.0f} s")  # fmt: skip
        if not name.startswith("casadi"):
            failed |= words["false"] > 0 or words["refused"] > 0.03 * len(rows)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
