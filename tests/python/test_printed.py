# SPDX-License-Identifier: BSD-3-Clause
"""Controllers as one C file: what generate() writes, and what steps of its text plan."""
import subprocess

import numpy as np
import pytest

import dyntape


def lift(limit=20.0):
    p = dyntape.Problem("lift", ["z", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0] - 9.81])
    p.add_squares("height", lambda s: 3 * (s.x[0] - 1))
    p.add_squares("effort", lambda s: 0.1 * (s.u - 9.81))
    p.start = [0, 0]
    p.bound_controls(0, limit)
    return p


def test_printed_steps_plan_as_usual_ones():
    usual = dyntape.Mpc(lift(12.0), scheme="runge-kutta-4", tolerance=1e-9).step(0.0, [0, 0])
    printed = dyntape.Mpc(lift(12.0), scheme="runge-kutta-4", tolerance=1e-9, printed=True).step(0.0, [0, 0])
    assert printed.usable and printed.status == usual.status
    assert usual.u.max() == pytest.approx(12, abs=1e-4)
    assert printed.x == pytest.approx(usual.x, abs=1e-4)
    assert printed.cost == pytest.approx(usual.cost, rel=1e-6)


@pytest.mark.parametrize("single", [False, True])
def test_generate_writes_text_that_compiles_alone(tmp_path, single):
    report = dyntape.Mpc(lift(), scheme="runge-kutta-4").generate(tmp_path, single=single)
    assert report["name"] == "lift" and report["state_bytes"] < 16000
    for file in report["files"]:
        assert ("float" if single else "double") in open(file).read()
    subprocess.run(["cc", "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-c", report["files"][0],
                    "-o", tmp_path / "lift.o"], check=True)


def test_generate_refuses_by_name(tmp_path):
    with pytest.raises(dyntape.ArgumentError, match="trapezoid"):
        dyntape.Mpc(lift()).generate(tmp_path)
    with pytest.raises(dyntape.ArgumentError, match="1 000"):
        dyntape.Mpc(lift(), scheme="euler").generate(tmp_path, target_bytes=1000)
    assert not list(tmp_path.iterdir())
    mpc = dyntape.Mpc(lift(), scheme="euler", printed=True)
    mpc.step(0.0, np.zeros(2))
    with pytest.raises(dyntape.ArgumentError, match="printed"):
        mpc.sensitivities()
