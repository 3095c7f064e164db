# SPDX-License-Identifier: BSD-3-Clause
"""Default batches become machine code after some thousand states: with the bits of the plain code, whatever the states are."""

import os
import subprocess
import sys
import time

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, FINGERS

ENOUGH = 40_000
ROBOTS = {
    "arm_2r": {},
    "cart_pole": {},
    "ur5": {},
    "panda": {"lock": FINGERS},
    "iiwa14": {"base": "floating"},
    "solo12": {"base": "floating"},
    "quadrotor": {"base": "floating"},
    "turning": {},
    "simple_humanoid": {"base": "floating"},
}
FUNCTIONS = """rnea aba crba minverse nonlinear_effects gravity energy energy_gradients id_derivatives fd_derivatives gravity_derivatives
nonlinear_effects_derivatives frame_placement frame_velocity frame_acceleration frame_jacobian com com_jacobian centroidal_momentum
centroidal_momentum_rate centroidal_matrix""".split()


def load(name):
    """"turning": an arm whose joints are pairs (cos, sin)."""
    if name == "turning":
        text = (CONFIG / "robots" / "ur5.urdf").read_text()
        return dyntape.load_text(text.replace('type="revolute"', 'type="continuous"'))
    return dyntape.load(CONFIG / "robots" / f"{name}.urdf", **ROBOTS[name])


def bits(robot, function, arguments, **options):
    """(states, numbers) as integers; all NaN are one."""
    result = getattr(robot, function)(*arguments, **options)
    blocks = result if isinstance(result, tuple) else (result,)
    n = len(arguments[0])
    y = np.concatenate([np.reshape(block, (n, -1)) for block in blocks], axis=1)
    assert not np.signbit(y[y == 0]).any()  # zeros are positive
    return np.where(np.isnan(y), np.nan, y).view(np.int64)


def drawn(robot, function, count, seed):
    """States of all sizes; among them zeros, negative zeros, huge ones, and ones that are not finite."""
    random = np.random.default_rng(seed)
    size = dict(robot.inputs(function))
    arguments = [robot.random(count, seed=seed)]
    for name in list(size)[1:]:
        arguments.append(random.normal(size=(count, size[name])) * 10.0 ** random.integers(-3, 4, size=(count, 1)))
    chosen = random.permutation(count)[:60]
    for k, state in enumerate(chosen):
        for values in arguments[k % 2 if len(arguments) > 1 else 0 :]:
            entry = random.integers(values.shape[1])
            if k < 20:
                values[state] = [0.0, -0.0][k % 2]
            elif k < 40:
                values[state, entry] = [0.0, -0.0, 1e-320, np.pi, -1e31][k % 5]
            else:
                values[state, entry] = [np.nan, np.inf, -np.inf, 1e160, 1e300][k % 5]
    return arguments


def warm(robot, function):
    """After these states machine code serves, where it does."""
    size = robot.inputs(function)
    random = np.random.default_rng(0)
    q = np.resize(robot.random(500), (ENOUGH, robot.nq))
    arguments = [q] + [random.normal(size=(ENOUGH, n)) for n in list(size.values())[1:]]
    getattr(robot, function)(*arguments)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_bits_are_those_of_the_plain_code(name):
    new, used = load(name), load(name)
    for k, function in enumerate(FUNCTIONS):
        arguments = drawn(new, function, 1000, seed=k)
        before = bits(new, function, arguments)  # packs
        warm(used, function)
        after = bits(used, function, arguments)
        assert (before == after).all(), f"{function}: {(before != after).any(axis=1).sum()} states differ"
        plain = bits(new, function, arguments, route="analytic")
        assert (plain == after).all(), function
        rows = np.arange(3, 1000, 97)  # alone, and in another company
        assert (bits(used, function, [x[rows] for x in arguments]) == after[rows]).all(), function
        assert (bits(used, function, [x[500:501] for x in arguments]) == after[500]).all(), function


def test_any_number_of_threads_has_the_same_bits():
    code = """
import dyntape, hashlib, numpy as np
robot = dyntape.load("config/robots/ur5.urdf")
random = np.random.default_rng(1)
q, v = robot.random(60_000, seed=2), random.normal(size=(60_000, 6))
hashes = hashlib.sha256()
for _ in range(2):
    hashes.update(robot.rnea(q, v, v).tobytes() + robot.aba(q, v, v).tobytes())
print(hashes.hexdigest())
"""
    hashes = set()
    for threads in "1", "2", "5":
        run = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "DYNTAPE_THREADS": threads}, check=True
        )
        hashes.add(run.stdout)
    assert len(hashes) == 1


def test_many_states_take_less_than_packs():
    """The least of several alternating runs; packs take 2 to 4 times as long on an idle machine."""
    robot, new = load("ur5"), [load("ur5") for _ in range(8)]
    random = np.random.default_rng(3)
    q, v = robot.random(8192, seed=3), random.normal(size=(8192, 6))
    warm(robot, "aba")
    times = {"packs": [], "machine code": []}
    for fresh in new:  # a new robot's first states are evaluated in packs
        fresh.aba(q[:128], v[:128], v[:128])
        for what, of in ("packs", fresh), ("machine code", robot):
            begin = time.perf_counter()
            of.aba(q, v, v)
            times[what].append(time.perf_counter() - begin)
    print({what: f"{min(of) / 8192 * 1e6:.3f} us a state" for what, of in times.items()})
    assert min(times["machine code"]) < min(times["packs"])


@pytest.mark.parametrize("name", ["ur5", "solo12"])
def test_default_batches_are_nearly_as_quick_as_machine_code_that_is_asked_for(name):
    """What is looked at in the results of machine code once took longer than the results."""
    robot = load(name)
    slow = {}
    for function in "rnea", "crba", "gravity", "energy_gradients", "id_derivatives", "centroidal_matrix":
        warm(robot, function)
        random = np.random.default_rng(0)
        arguments = [robot.random(128)] + [random.normal(size=(128, n)) for n in list(robot.inputs(function).values())[1:]]
        call = getattr(robot, function)
        times = {None: [], "machine-code": []}
        for _ in range(300):
            for route, of in times.items():
                begin = time.perf_counter()
                call(*arguments, **({"route": route} if route else {}))
                of.append(time.perf_counter() - begin)
        slow[function] = min(times[None]) / min(times["machine-code"])
    print({function: round(ratio, 2) for function, ratio in slow.items()})
    assert max(slow.values()) < 1.6, slow
