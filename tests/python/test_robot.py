# SPDX-License-Identifier: BSD-3-Clause
"""Functions of robots: the bits of the command line, shapes as numpy has them, errors that say what was expected."""

import copy
import inspect
import io
import pickle
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, FINGERS, states

DIRECTORY = {name for name in dir(dyntape.Robot) if not name.startswith("_")}


def table():
    """Names and numbers of arguments of the methods that the table makes, told by their signatures."""
    names = {}
    for name in sorted(DIRECTORY):
        doc = getattr(dyntape.Robot, name).__doc__ or ""
        signature = doc.split("\n", 1)[0]
        if "route: str" in signature:
            names[name] = [word for word in ("q", "v", "a", "tau", "mu") if f" {word}: ArrayLike" in signature]
    return names


def arguments(robot, random, words, *batch):
    q, v, a = states(robot, random, *batch)
    given = {"q": q, "v": v, "a": a, "tau": a + 1, "mu": v - 1}
    return [given[word] for word in words]


def flat(result):
    parts = result if isinstance(result, tuple) else (result,)
    return np.concatenate([np.ravel(part) for part in parts])


def evaluated(tmp_path, function, names, columns, route):
    """The same by the command line."""
    states_file, results = tmp_path / "states.csv", tmp_path / "results.csv"
    with states_file.open("w") as out:
        out.write(",".join(names) + "\n")
        for row in columns:
            out.write(",".join(repr(float(x)) for x in row) + "\n")
    command = [sys.executable, "-m", "dyntape", "eval", CONFIG / "robots" / "panda.urdf", "--lock", ",".join(FINGERS)]
    command += ["--function", function, "--route", route, "--input", states_file, "--output", results]
    subprocess.run(command, check=True, capture_output=True)
    return np.genfromtxt(io.StringIO(results.read_text()), delimiter=",", skip_header=1, ndmin=2)


def test_one_joint_is_locked_by_its_name():
    path = CONFIG / "robots" / "panda.urdf"
    one = dyntape.load(path, lock="panda_finger_joint1")
    assert one.joints == dyntape.load(path, lock=["panda_finger_joint1"]).joints
    assert "panda_finger_joint1" not in one.joints


def test_the_table_is_there():
    assert len(table()) >= 38
    assert table()["rnea"] == ["q", "v", "a"]
    assert table()["aba"] == ["q", "v", "tau"]


@pytest.mark.parametrize("function", ["rnea", "id-derivatives", "minverse", "frame-jacobian"])
@pytest.mark.parametrize("route", ["analytic", "tape", "generated"])
def test_bits_of_the_command_line(panda, random, tmp_path, function, route):
    words = table()[function.replace("-", "_")]
    given = arguments(panda, random, words, 3)
    names = [f"{word}{i}" for word in words for i in range(7)]
    expected = evaluated(tmp_path, function, names, np.concatenate(given, axis=1), route)
    for i in range(3):
        found = getattr(panda, function.replace("-", "_"))(*(x[i] for x in given), route=route)
        assert np.array_equal(flat(found), expected[i])


@pytest.mark.parametrize("name", sorted(table()))
def test_batches_are_states(panda, random, name):
    """A batch by a route has the bits of its states one by one; shapes are batch and result."""
    method, given = getattr(panda, name), arguments(panda, random, table()[name], 2, 3)
    for route in ("analytic", "lanes"):
        batch = method(*given, route=route)
        for part in batch if isinstance(batch, tuple) else (batch,):
            assert part.shape[:2] == (2, 3)
        for i, j in np.ndindex(2, 3):
            alone = method(*(x[i, j] for x in given), route=route)
            parts = [x[i, j] for x in batch] if isinstance(batch, tuple) else [batch[i, j]]
            assert np.array_equal(flat(tuple(parts)), flat(alone))
    default = method(*given)
    assert np.array_equal(flat(default), flat(method(*given, route="lanes")))


def test_defaults_agree_to_rounding(panda, random):
    q, v, a = states(panda, random, 50)
    batch = panda.rnea(q, v, a)
    alone = np.array([panda.rnea(*state) for state in zip(q, v, a)])
    np.testing.assert_allclose(batch, alone, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("count", [0, 1, 3, 127, 128, 129, 1000])
def test_any_number_of_states(panda, random, count):
    q, v, a = states(panda, random, count)
    tau = panda.rnea(q, v, a)
    assert tau.shape == (count, 7)
    for i in {0, count // 2, count - 1} & set(range(count)):
        assert np.array_equal(tau[i], panda.rnea(q[i : i + 1], v[i : i + 1], a[i : i + 1])[0])


def test_broadcasting_and_layouts(panda, random):
    q, v, a = states(panda, random, 4, 5)
    expected = panda.rnea(q, np.broadcast_to(v[:, :1], v.shape).copy(), np.broadcast_to(a[0, 0], a.shape).copy())
    assert np.array_equal(panda.rnea(q, v[:, :1], a[0, 0]), expected)
    assert np.array_equal(panda.rnea(np.asfortranarray(q), v[:, :1], a[0, 0]), expected)
    wide = np.zeros((4, 5, 14))
    wide[..., ::2] = q
    assert np.array_equal(panda.rnea(wide[..., ::2], v[:, :1], a[0, 0]), expected)
    assert np.array_equal(panda.rnea(q[::-1], v[::-1, :1], a[0, 0]), expected[::-1])
    assert np.array_equal(panda.rnea(q.astype(">f8"), v[:, :1], a[0, 0]), expected)
    assert np.array_equal(panda.crba(q.tolist()), panda.crba(q))


def test_derivatives_are_slopes(panda, random):
    q, v, a = states(panda, random)
    exact, by_differences = panda.id_derivatives(q, v, a), panda.id_derivatives(q, v, a, route="fd-central")
    assert exact._fields if hasattr(exact, "_fields") else exact.n_fields == 3
    for name in ("dtau_dq", "dtau_dv", "dtau_da"):
        np.testing.assert_allclose(getattr(by_differences, name), getattr(exact, name), atol=1e-6)
    assert np.array_equal(exact.dtau_da, exact[2])


def test_frames(panda, random):
    q, v, _ = states(panda, random, 2)
    hand = panda.frame_velocity(q, v, frame="panda_hand", axes="local")
    J = panda.frame_jacobian(q, frame="panda_hand", axes="local")
    linear_and_angular = hand if isinstance(hand, np.ndarray) else np.concatenate(hand, axis=-1)
    np.testing.assert_allclose(np.einsum("bij,bj->bi", J, v), linear_and_angular, atol=1e-12)
    world = panda.frame_jacobian(q, frame="panda_hand", axes="world")
    assert not np.allclose(world, J)


def test_configurations(solo, random):
    q, v = solo.random(20, seed=1), random.normal(size=(20, solo.nv))
    moved = solo.integrate(q, v)
    np.testing.assert_allclose(np.linalg.norm(moved[:, 3:7], axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(solo.difference(q, moved), v, atol=1e-9)
    assert np.array_equal(solo.random(20, seed=1), q)
    assert not np.array_equal(solo.random(20, seed=2), q)
    assert solo.neutral()[6] == 1


def test_facts(panda, solo):
    assert (panda.nq, panda.nv, len(panda.joints)) == (7, 7, 7)
    assert (solo.nq, solo.nv) == (19, 18)
    assert solo.joint_types[0] == "free-flyer"
    assert "panda_hand" in panda.frames
    assert panda.effort_limits.shape == (7,) and np.all(panda.lower_limits < panda.upper_limits)
    assert np.isinf(solo.lower_limits[:6]).all()
    assert "panda" in repr(panda) and "nv 7" in repr(panda)


def test_gravity():
    there = dyntape.load(CONFIG / "robots" / "panda.urdf", lock=FINGERS, gravity=[0, 0, -1.62])
    here = dyntape.load(CONFIG / "robots" / "panda.urdf", lock=FINGERS)
    q = here.random(seed=4)
    np.testing.assert_allclose(there.gravity(q) * 9.81, here.gravity(q) * 1.62, rtol=1e-12, atol=1e-12)


def test_a_robot_from_text(panda):
    text = (CONFIG / "robots" / "panda.urdf").read_text()
    robot = dyntape.load_text(text, lock=FINGERS)
    q = robot.random(seed=4)
    assert np.array_equal(robot.crba(q), panda.crba(q))
    with pytest.raises(dyntape.FileError, match="mine.urdf"):
        dyntape.load_text("<robot/>", "mine.urdf")


def test_followers_have_no_entries():
    robot = dyntape.load(CONFIG / "robots" / "panda.urdf", mimic=True)
    assert (robot.nq, robot.nv, len(robot.joints)) == (8, 8, 8)
    assert robot.rnea(np.zeros(8), np.zeros(8), np.zeros(8)).shape == (8,)
    assert robot.neutral().shape == (8,)


def test_limits_of_a_leader_are_those_of_its_followers_too():
    def joint(name, axis, limit, mimic=""):
        return (
            f'<joint name="{name}" type="prismatic"><parent link="base"/><child link="{name}_link"/><axis xyz="{axis}"/>'
            f'<limit {limit} effort="20"/>{mimic}</joint><link name="{name}_link"><inertial><mass value="1"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )

    text = (
        '<robot name="r"><link name="base"/>'
        + joint("leader", "1 0 0", 'lower="-1" upper="1" velocity="10"')
        + joint("twice", "1 0 0", 'lower="-0.5" upper="1.1" velocity="3"', '<mimic joint="leader" multiplier="2" offset="0.1"/>')
        + joint("against", "0 1 0", 'lower="-0.6" upper="0.2" velocity="9"', '<mimic joint="twice" multiplier="-1" offset="0"/>')
        + "</robot>"
    )
    robot = dyntape.load_text(text, mimic=True)
    # twice = 2 leader + 0.1 within -0.5 .. 1.1, against = -twice within -0.6 .. 0.2: leader within -0.15 .. 0.25
    np.testing.assert_allclose(robot.lower_limits, [-0.15], rtol=1e-15)
    np.testing.assert_allclose(robot.upper_limits, [0.25], rtol=1e-15)
    np.testing.assert_allclose(robot.velocity_limits, [1.5], rtol=1e-15)
    assert robot.effort_limits.tolist() == [20]
    free = dyntape.load_text(text)
    assert free.joints == ["against", "leader", "twice"]
    assert free.lower_limits.tolist() == [-0.6, -1, -0.5] and free.velocity_limits.tolist() == [9, 10, 3]


def test_copies_have_the_same_content(panda, random):
    q, v, a = states(panda, random, 9)
    for twin in (pickle.loads(pickle.dumps(panda)), copy.copy(panda), copy.deepcopy(panda)):
        assert np.array_equal(twin.rnea(q, v, a), panda.rnea(q, v, a))
    results = panda.id_derivatives(q, v, a)
    assert np.array_equal(pickle.loads(pickle.dumps(results)).dtau_dv, results.dtau_dv)


def test_results_outlive_robot_and_each_other():
    robot = dyntape.load(CONFIG / "robots" / "panda.urdf", lock=FINGERS)
    q = robot.random(300)
    results = robot.id_derivatives(q, q, q)
    expected, part = results.dtau_dq.copy(), results.dtau_dq
    del robot, results
    assert np.array_equal(part, expected)


def test_threads_share_a_robot(panda, random):
    q, v, a = states(panda, random, 400)
    expected = panda.fd_derivatives(q, v, a)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: panda.fd_derivatives(q, v, a), range(16)))
    for result in found:
        assert np.array_equal(result.ddq_dq, expected.ddq_dq)


def test_a_batch_runs_without_the_lock(panda, random):
    q, v, a = states(panda, random, 60_000)
    f = dyntape.record(lambda x: (np.sin(x) * x).sum(), 7)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    other = threading.Thread(target=tick)
    other.start()
    try:
        for work in (lambda: panda.id_second_derivatives(q[:8000], v[:8000], a[:8000]), lambda: [f.hessian(q) for _ in range(3)]):
            begin = time.perf_counter()
            work()
            end = time.perf_counter()
            during = [t for t in ticks if begin + 0.1 * (end - begin) < t < end - 0.1 * (end - begin)]
            assert len(during) > 3, (len(during), end - begin)
    finally:
        stop.set()
        other.join()


@pytest.mark.parametrize(
    "call, sentence",
    [
        (lambda r, q: r.rnea(q[:, :3], q, q), r"rnea: expected q of shape \(\.\.\., 7\), got \(6, 3\)"),
        (lambda r, q: r.rnea(q, q[:4], q), r"the batch axes of v are \(4,\), which do not broadcast with \(6,\)"),
        (lambda r, q: r.rnea(1.0, q, q), r"expected q of shape \(\.\.\., 7\), got \(\)"),
        (lambda r, q: r.rnea(q, q, q, route="anlytic"), "there is no route"),
        (lambda r, q: r.rnea(q, q, q, route="fd-central"), "rnea is a value"),
        (lambda r, q: r.frame_jacobian(q, frame="panda_hnad"), "panda_hand"),
        (lambda r, q: r.frame_jacobian(q, axes="wrld"), 'expected one of "local", "world", "aligned"'),
    ],
)
def test_errors_say_what_was_expected(panda, call, sentence):
    with pytest.raises(dyntape.ArgumentError, match=sentence) as caught:
        call(panda, np.zeros((6, 7)))
    assert isinstance(caught.value, ValueError)


def test_what_is_no_number(panda):
    with pytest.raises(ValueError):
        panda.crba("seven")
    with pytest.raises(dyntape.ArgumentError, match="q: expected an array of numbers"):
        panda.crba(np.zeros(7, dtype=complex))
    with pytest.raises(TypeError, match="needs a"):
        panda.rnea(np.zeros(7), np.zeros(7))


def test_files_that_are_none(tmp_path):
    with pytest.raises(dyntape.FileError, match="cannot open") as caught:
        dyntape.load(tmp_path / "none.urdf")
    assert isinstance(caught.value, OSError)
    (tmp_path / "bad.urdf").write_text("<robot name='r'><link/></robot>")
    with pytest.raises(dyntape.FileError, match="bad.urdf"):
        dyntape.load(tmp_path / "bad.urdf")
    with pytest.raises(dyntape.ArgumentError, match='base: expected one of "fixed", "floating"'):
        dyntape.load(CONFIG / "robots" / "panda.urdf", base="flying")


def test_every_method_is_documented():
    for name in DIRECTORY:
        assert inspect.getdoc(getattr(dyntape.Robot, name)), name


@pytest.mark.parametrize("name", ["crba", "id_derivatives", "fd_derivatives", "frame_jacobian"])
def test_nonzeros_are_the_results_without_their_zeros(panda, random, name):
    words = list(panda.inputs(name))
    given = arguments(panda, random, words, 3, 5)
    keywords = {"frame": "panda_hand"} if name == "frame_jacobian" else {}
    nonzeros = panda.nonzeros(name, **keywords)
    values = nonzeros(*given)
    assert values.shape == (3, 5, nonzeros.size)
    dense = nonzeros.expand(values)
    whole = getattr(panda, name)(*given, **keywords)
    whole = whole if isinstance(whole, tuple) else (whole,)
    assert sum(block[0, 0].size for block in whole) > nonzeros.size or name == "frame_jacobian"
    for (block, entries), expected in zip(dense.items(), whole, strict=True):
        np.testing.assert_allclose(entries, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
        places = nonzeros.places[block]
        assert places.shape == expected.shape[2:]
        assert places.max() < nonzeros.size
        np.testing.assert_array_equal(np.where(places < 0, 0.0, values[..., places]), entries)
    np.testing.assert_array_equal(nonzeros(*[x[1, 2] for x in given]), values[1, 2])


def test_nonzeros_say_what_they_do_not_know(panda):
    with pytest.raises(dyntape.ArgumentError, match="crb"):
        panda.nonzeros("crb")
    with pytest.raises(dyntape.ArgumentError, match="expected q, v, a"):
        panda.nonzeros("rnea")(np.zeros(7))
    with pytest.raises(dyntape.ArgumentError, match="values"):
        panda.nonzeros("crba").expand(np.zeros(3))
