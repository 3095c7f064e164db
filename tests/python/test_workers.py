# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.workers: the same bits by Ray, Dask and concurrent.futures, and folders that go on."""

import functools
import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, page_section
from dyntape.bridges import workers

SWEEP = CONFIG / "sweeps" / "quadruped_dropped.info"


@pytest.fixture(scope="module")
def few():
    """Settings that the file takes: the whole sweep in a second or two."""
    return {"samples": 40}


@pytest.fixture(scope="module")
def alone(tmp_path_factory, few):
    folder = tmp_path_factory.mktemp("alone")
    dyntape.sweep(SWEEP, folder, set=few)
    return (folder / "sweep.csv").read_bytes()


def processes(n):
    return ProcessPoolExecutor(n, mp_context=multiprocessing.get_context("spawn"))


@pytest.mark.parametrize("make", [lambda: ThreadPoolExecutor(1), lambda: ThreadPoolExecutor(3), lambda: processes(2)], ids=["1 thread", "3 threads", "2 processes"])
def test_a_sweep_by_executors(make, tmp_path, few, alone):
    told = []
    with make() as pool:
        columns = workers.sweep(SWEEP, tmp_path, workers=pool, set=few, progress=told.append)
    assert (tmp_path / "sweep.csv").read_bytes() == alone
    assert len(columns["sample"]) == 40 and told[-1].split()[0] == told[-1].split()[2]


def test_a_sweep_by_dask(tmp_path, few, alone):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
        workers.sweep(SWEEP, tmp_path, workers=client, set=few)
        assert (tmp_path / "sweep.csv").read_bytes() == alone
        assert workers.samples(drawn, 5, seed=3, workers=client) == [drawn_alone(k) for k in range(5)]


@pytest.fixture(scope="module")
def ray():
    ray = pytest.importorskip("ray")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield ray
    ray.shutdown()


def test_a_sweep_by_ray(ray, tmp_path, few, alone):
    workers.sweep(SWEEP, tmp_path, workers="ray", set=few)
    assert (tmp_path / "sweep.csv").read_bytes() == alone
    assert workers.samples(lambda random: random.uniform(), 5, seed=3, workers=ray) == [drawn_alone(k) for k in range(5)]
    with pytest.raises(ZeroDivisionError):
        workers.samples(lambda random: 1 / 0, 2, workers="ray")


def test_a_sweep_goes_on_where_it_was_ended(tmp_path, few, alone):
    class Ended(Exception):
        pass

    def end(text):
        raise Ended

    with ThreadPoolExecutor(2) as pool:
        with pytest.raises(Ended):
            workers.sweep(SWEEP, tmp_path, workers=pool, set=few, progress=end)
        kept = list((tmp_path / "chunks").iterdir())
        assert kept and not (tmp_path / "sweep.csv").exists()
        told = []
        workers.sweep(SWEEP, tmp_path, workers=pool, set=few, progress=told.append)
        assert int(told[0].split()[0]) > 1
        assert (tmp_path / "sweep.csv").read_bytes() == alone
        workers.sweep(SWEEP, tmp_path, workers=pool, set=few, progress=pytest.fail)  # finished
        with pytest.raises(dyntape.FileError):
            workers.sweep(SWEEP, tmp_path, workers=pool, set={"samples": 41})


def drawn(random):
    return random.uniform()


def drawn_alone(k):
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(3, spawn_key=(k,)))).uniform()


def start(robot, weight, random):
    """The pose nearest to a target from a random start, by Newton's method: what a multi-start looks like."""
    f = dyntape.record(lambda q: weight * ((robot.frame_placement(q, frame="panda_hand").p - np.array([0.4, 0.3, 0.5])) ** 2).sum(), 7)
    q = robot.random(seed=int(random.integers(1 << 32)))
    for _ in range(20):
        q = q - np.linalg.solve(f.hessian(q) + 0.05 * np.eye(7), f.jacobian(q).ravel())
    return float(f(q)), q


def test_samples_are_the_same_for_any_workers(panda, tmp_path):
    function = functools.partial(start, panda, 1.0)
    with ThreadPoolExecutor(3) as threads, processes(2) as pool:
        found = [workers.samples(function, 6, seed=1, workers=pool, folder=folder) for pool, folder in ((threads, None), (pool, tmp_path))]
    for (cost, q), (again, same) in zip(*found):
        assert cost == again and np.array_equal(q, same)
    assert min(found[0], key=lambda one: one[0])[0] < 1e-6
    assert len({cost for cost, _ in found[0]}) == 6


def test_samples_go_on_where_they_were_ended(tmp_path):
    calls = []

    def one(random):
        calls.append(1)
        return random.uniform()

    with ThreadPoolExecutor(1) as pool:
        first = workers.samples(one, 4, seed=3, workers=pool, folder=tmp_path)
        (tmp_path / "sample_000002.pickle").unlink()
        assert workers.samples(one, 6, seed=3, workers=pool, folder=tmp_path)[:4] == first == [drawn_alone(k) for k in range(4)]
        assert len(calls) == 4 + 3
        with pytest.raises(dyntape.FileError, match="another function or seed"):
            workers.samples(one, 4, seed=4, workers=pool, folder=tmp_path)
        assert workers.samples(one, 1, seed=4, workers=pool, folder=tmp_path, restart=True) != first[:1]


def test_who_are_no_workers(tmp_path):
    with pytest.raises(dyntape.ArgumentError, match="expected a concurrent.futures executor"):
        workers.samples(drawn, 1, workers=4)
    with pytest.raises(dyntape.FileError):
        workers.sweep(tmp_path / "none.info", tmp_path, workers=ThreadPoolExecutor(1))


def test_the_page(tmp_path, monkeypatch):
    page = page_section("Ray, Dask and executors")
    names = {}
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    exec(page.replace('"out/', f'"{tmp_path}/'), names)
    assert len(names["found"]) == 20 and "most.v" in names["columns"]
