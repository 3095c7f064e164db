# SPDX-License-Identifier: BSD-3-Clause
"""The package: examples in docstrings, types, the command line, and whatever may be passed to a function."""

import doctest
import pathlib
import subprocess
import sys

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, FINGERS

HERE = pathlib.Path(__file__).resolve().parent
PROGRAMS = sorted((HERE.parents[1] / "examples/python").glob("*.py"))
TEMPLATE = HERE.parents[1] / "examples/template_python/my_robot.py"


def documented():
    yield "dyntape", dyntape.__doc__
    for name in dyntape.__all__:
        value = getattr(dyntape, name)
        yield name, value.__doc__
        if isinstance(value, type):
            for member, entry in vars(value).items():
                yield f"{name}.{member}", getattr(entry, "__doc__", None)


EXAMPLES = {name: doc for name, doc in documented() if doc and ">>>" in doc}


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_examples_in_docstrings(name, panda):
    q = panda.random(4, seed=6)
    names = {"dyntape": dyntape, "np": np, "robot": panda, "q": q, "v": q + 1, "a": q - 1, "tau": 2 * q, "mu": -q}
    test = doctest.DocTestParser().get_doctest(EXAMPLES[name], names, name, None, None)
    output = []
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test, out=output.append)
    assert result.failed == 0, "".join(output)


def test_examples_are_there():
    assert {"dyntape", "load", "record", "where", "Problem", "Scene", "Robot.rnea"} <= set(EXAMPLES)


def test_types_of_the_examples():
    mypy = [sys.executable, "-m", "mypy", "--strict", "--no-incremental", "--cache-dir=/dev/null"]
    run = subprocess.run([*mypy, *map(str, [*PROGRAMS, TEMPLATE])], capture_output=True, text=True)
    if "No module named mypy" in run.stderr:
        pytest.skip("mypy is not installed")
    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize("example", PROGRAMS, ids=lambda path: path.stem)
def test_examples_run(example, tmp_path):
    run = subprocess.run([sys.executable, str(example), str(CONFIG)], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr


def test_the_template_runs():
    run = subprocess.run([sys.executable, TEMPLATE, CONFIG / "robots/ur5.urdf"], capture_output=True, text=True)
    assert run.returncode == 0 and "6 degrees of freedom" in run.stdout, run.stdout + run.stderr
    run = subprocess.run([sys.executable, TEMPLATE, "none.urdf"], capture_output=True, text=True)
    assert run.returncode == 1 and "none.urdf" in run.stderr


def command(*arguments, cwd):
    return subprocess.run([sys.executable, "-m", "dyntape", *map(str, arguments)], cwd=cwd, capture_output=True, text=True)


def test_the_command_line(tmp_path):
    assert command("--version", cwd=tmp_path).stdout.strip() == f"dyntape {dyntape.__version__}"
    help_text = command("--help", cwd=tmp_path).stdout
    assert "solve" in help_text and "demo" in help_text
    info = command("info", CONFIG / "robots" / "panda.urdf", cwd=tmp_path)
    assert info.returncode == 0 and "panda_joint1" in info.stdout
    wrong = command("solve", "none.info", cwd=tmp_path)
    assert wrong.returncode == 1 and "none.info" in wrong.stderr


def test_the_demo(tmp_path):
    run = command("demo", tmp_path / "first", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "first" / "motion.html").stat().st_size > 30000
    assert command("demo", "--fast", cwd=tmp_path).returncode == 2


ODD = [
    None, True, 3, -1.5, "q", b"q", [], [[]], [1, [2, 3]], {}, object(), np.nan, np.array(None), np.zeros(()),
    np.zeros(7), np.zeros((7, 1)), np.zeros((2, 7)), np.zeros((3, 7))[:, ::-1], np.zeros((2, 0)), np.zeros((0, 7)),
    np.zeros((1,) * 31 + (7,)), np.zeros(7, dtype=np.float32), np.zeros(7, dtype=int), np.zeros(7, dtype=bool),
    np.zeros(7, dtype=complex), np.zeros(7, dtype=">f8"), np.array(["a"] * 7), np.array([None] * 7), np.full(7, np.nan),
    np.full((2, 7), np.inf), np.zeros(28)[::4], np.lib.stride_tricks.as_strided(np.zeros(1), (10**6, 7), (0, 0))[:3],
    np.frombuffer(bytes(57), dtype=np.uint8)[1:].view(np.float64), range(7), np.ma.zeros(7), memoryview(np.zeros(7)),
]  # fmt: skip


def test_whatever_is_passed(panda):
    """1e5 calls with odd arguments: a result or an exception, and the robot is as it was."""
    random = np.random.default_rng(11)
    f = dyntape.record(lambda x, p: np.sin(x) * p[0], 7, 1)
    calls = [
        lambda a, b, c: panda.rnea(a, b, c),
        lambda a, b, c: panda.crba(a),
        lambda a, b, c: panda.id_derivatives(a, b, c),
        lambda a, b, c: panda.frame_jacobian(a, frame=b),
        lambda a, b, c: panda.aba(a, b, c, route=c if isinstance(c, str) else "lanes"),
        lambda a, b, c: panda.integrate(a, b),
        lambda a, b, c: f(a, b),
        lambda a, b, c: f.jacobian(a, b),
        lambda a, b, c: f.hessian(a, b, c),
    ]
    scene = dyntape.Scene(CONFIG / "scenes" / "pendulum.info")
    calls += [
        lambda a, b, c: scene.rollout(a, b, steps=2),
        lambda a, b, c: scene.rollout(np.zeros((2, 2)), a),
        lambda a, b, c: dyntape.record(lambda x: dyntape.where(x > 0, x, b), 2)(a),
    ]
    q = np.full((3, 7), 0.3)
    before = panda.rnea(q, q, q)
    results = 0
    for _ in range(100_000):
        a, b, c = (ODD[k] if k < len(ODD) else np.full((2, 7), 0.1) for k in random.integers(0, 2 * len(ODD), size=3))
        try:
            calls[random.integers(len(calls))](a, b, c)
            results += 1
        except (ValueError, TypeError, ArithmeticError):
            pass
    assert results > 5000
    assert np.array_equal(panda.rnea(q, q, q), before)


def test_memory_of_calls_is_given_back(panda):
    import gc
    import resource

    q = np.zeros((1000, 7))
    for _ in range(20):
        panda.id_derivatives(q, q, q)
    gc.collect()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(300):  # 350 MB if they stayed
        panda.id_derivatives(q, q, q)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 60_000


def test_locks():
    assert dyntape.load(CONFIG / "robots" / "panda.urdf", lock=FINGERS).nv == 7
    with pytest.raises(dyntape.ArgumentError, match="no joint"):
        dyntape.load(CONFIG / "robots" / "panda.urdf", lock=["panda_finger_joint3"])


def test_what_is_kept_to_the_end_is_no_line_on_the_terminal():
    """An exception that something keeps, as pytest does, keeps the frames of a failed recording."""
    program = (
        "import ctypes, dyntape\n"
        "def f(x):\n    raise ValueError('mine')\n"
        "try:\n    dyntape.record(f, 2)\n"
        "except ValueError as error:\n    ctypes.pythonapi.Py_IncRef(ctypes.py_object(error))\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
