# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps, samples and multi-starts as tasks of Ray, Dask or concurrent.futures.

    from dyntape.bridges import workers
    columns = workers.sweep("config/sweeps/quadruped_dropped.info", "out/drop", workers=distributed.Client())
    columns = workers.sweep("config/sweeps/quadruped_dropped.info", "out/drop", workers="ray")
    found = workers.samples(solve_from, 200, seed=1, workers=ProcessPoolExecutor(8), folder="out/starts")
    best = min(found, key=lambda one: one.cost)

Results are the same bits for any number and kind of workers, and what is finished is on disk: the same call goes on from there.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import pathlib
import pickle
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import ArgumentError, FileError
from .. import sweep as sweep_here
from .._dyntape import SweepWork

Result = TypeVar("Result")


def sweep(
    file: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    workers: Any,
    set: Mapping[str, Any] | None = None,
    restart: bool = False,
    progress: Callable[[str], object] | None = None,
) -> dict[str, NDArray[np.float64]]:
    """dyntape.sweep with its chunks of rows computed by workers: the same bytes in sweep.csv, the same folder.

    workers: a concurrent.futures executor, a distributed.Client, or "ray", which is started where it is not.  Those on other
        machines need the same files at the same path, and no folder in common.
    set, restart: as for dyntape.sweep.  progress: is called with the number of finished chunks.

    What is finished is in the folder at once: this call, dyntape.sweep and the command go on from there.

    Raises what dyntape.sweep raises, and FileError where a worker's files are others.

    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
    ...     columns = sweep("config/sweeps/pendulum_amplitudes.info", folder, workers=pool)
    >>> len(columns["sample"])
    30
    """
    path, settings = os.path.abspath(os.fspath(file)), dict(set or {})
    work = SweepWork(path, set=settings)
    missing = work.open(output, restart=restart)
    try:
        calls = [(chunk, (path, tuple(sorted(settings.items(), key=str)), work.identity, chunk)) for chunk in missing]
        for done, (chunk, text) in enumerate(_computed(_pool_of(workers), _chunk, calls), 1):
            work.keep(chunk, text)
            if progress is not None:
                progress(f"{work.chunks - len(missing) + done} of {work.chunks} chunks")
    finally:
        work.close()
    return sweep_here(path, output, set=settings)


def samples(
    function: Callable[[np.random.Generator], Result],
    count: int,
    *,
    seed: int = 0,
    workers: Any,
    folder: str | os.PathLike[str] | None = None,
    restart: bool = False,
    progress: Callable[[str], object] | None = None,
) -> list[Result]:
    """[function(random) for each of `count` samples], each with random numbers of its own: of the seed and its index alone.

    function: takes a numpy.random.Generator.  Processes get it pickled, so that it has to stand in a module for executors of
        concurrent.futures; robots and recorded functions that it holds go along by content.
    workers: as for `sweep`.
    folder: keeps each result as it comes, pickled (read it only if it is yours); the same call goes on from there.  None: nothing is
        kept.  restart: begins anew.  progress: is called with the number of finished ones.

    Raises what the function raises, and FileError for a folder with samples of another function, seed or version of it.

    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(2) as pool:
    ...     samples(lambda random: round(random.uniform(), 3), 2, seed=1, workers=pool)
    [0.212, 0.181]
    """
    kept = _Kept(folder, _identity(function, seed), restart) if folder is not None else None
    found: dict[int, Any] = kept.read(count) if kept else {}
    calls = [(k, (function, seed, k)) for k in range(count) if k not in found]
    for k, result in _computed(_pool_of(workers), _sample, calls):
        found[k] = result
        if kept:
            kept.write(k, result)
        if progress is not None:
            progress(f"{len(found)} of {count} samples")
    return [found[k] for k in range(count)]


# --- What workers do --------------------------------------------------------------------------------------------------------------


@functools.lru_cache(maxsize=4)
def _work_of(path: str, settings: tuple[tuple[str, Any], ...]) -> SweepWork:
    return SweepWork(path, set=dict(settings))


def _chunk(path: str, settings: tuple[tuple[str, Any], ...], identity: str, chunk: int) -> str:
    work = _work_of(path, settings)
    if work.identity != identity:
        raise FileError(f"{path} means another sweep to this worker than to who asks")
    return work.compute(chunk)


def _sample(function: Callable[[np.random.Generator], Any], seed: int, k: int) -> Any:
    return function(np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(k,)))))


# --- Who they are -----------------------------------------------------------------------------------------------------------------


class _Pool:
    """Executors and Dask's clients, whose futures are alike."""

    def __init__(self, executor: Any) -> None:
        self._executor = executor
        # Dask takes two calls with the same arguments for one; all of these are different, and pure.
        self.submit = executor.submit

    def wait(self, pending: Iterable[Any]) -> list[Any]:
        """Those that are done, one at least."""
        pending = list(pending)
        pause = 1e-4
        while not (done := [future for future in pending if future.done()]):
            time.sleep(pause)
            pause = min(2 * pause, 0.02)
        return done

    def result(self, future: Any) -> Any:
        return future.result()

    def cancel(self, pending: Iterable[Any]) -> None:
        for future in pending:
            future.cancel()


class _Ray(_Pool):
    def __init__(self) -> None:
        import ray  # type: ignore[import-not-found, import-untyped, unused-ignore]

        self._ray = ray
        if not ray.is_initialized():
            ray.init(include_dashboard=False, log_to_driver=False)
        self._remote: dict[Any, Any] = {}

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Any:
        remote = self._remote.setdefault(function, self._ray.remote(function))
        return remote.remote(*arguments)

    def wait(self, pending: Iterable[Any]) -> list[Any]:
        done, _ = self._ray.wait(list(pending), num_returns=1)
        return list(done)

    def result(self, future: Any) -> Any:
        try:
            return self._ray.get(future)
        except self._ray.exceptions.RayTaskError as failed:
            raise getattr(failed, "cause", failed) from failed

    def cancel(self, pending: Iterable[Any]) -> None:
        for future in pending:
            self._ray.cancel(future)


def _pool_of(workers: Any) -> _Pool:
    if workers == "ray" or getattr(workers, "__name__", "") == "ray":
        try:
            return _Ray()
        except ModuleNotFoundError:
            raise ArgumentError("workers: Ray is not installed here: pip install ray") from None
    if not callable(getattr(workers, "submit", None)):
        raise ArgumentError(f'workers: expected a concurrent.futures executor, a distributed.Client or "ray", got {workers!r}')
    return _Pool(workers)


_MOST_WAITING = 256  # calls that are handed out and not back


def _computed(pool: _Pool, function: Callable[..., Any], calls: list[tuple[int, tuple[Any, ...]]]) -> Iterator[tuple[int, Any]]:
    """(key, function(*arguments)) as they come."""
    pending: dict[Any, int] = {}
    waiting = iter(calls)
    try:
        while True:
            while len(pending) < _MOST_WAITING and (call := next(waiting, None)) is not None:
                pending[pool.submit(function, *call[1])] = call[0]
            if not pending:
                return
            for future in pool.wait(pending):
                key = pending.pop(future)
                yield key, pool.result(future)
    finally:
        pool.cancel(pending)


# --- What is on disk --------------------------------------------------------------------------------------------------------------


def _identity(function: Any, seed: int) -> str:
    """Of the seed, and of the function: its name, its instructions, what functools.partial has given it."""
    digest = hashlib.sha256(repr(seed).encode())
    while isinstance(function, functools.partial):
        digest.update(pickle.dumps((function.args, function.keywords)))
        function = function.func
    digest.update(f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', '')}".encode())
    if code := getattr(function, "__code__", None):
        digest.update(code.co_code + repr([constant for constant in code.co_consts if not hasattr(constant, "co_code")]).encode())
    return digest.hexdigest()


class _Kept:
    """A folder with a file a sample, each whole or not there."""

    def __init__(self, folder: str | os.PathLike[str], identity: str, restart: bool) -> None:
        self._folder = pathlib.Path(folder)
        self._folder.mkdir(parents=True, exist_ok=True)
        mark = self._folder / "samples.json"
        if restart:
            for path in self._folder.glob("sample_*.pickle"):
                path.unlink()
        elif mark.exists() and json.loads(mark.read_text()).get("identity") != identity:
            raise FileError(f"{mark}: the folder has samples of another function or seed; expected another folder, or restart=True")
        self._replace(mark, json.dumps({"identity": identity}).encode())

    def read(self, count: int) -> dict[int, Any]:
        found = {}
        for k in range(count):
            path = self._path(k)
            if path.exists():
                found[k] = pickle.loads(path.read_bytes())
        return found

    def write(self, k: int, result: Any) -> None:
        self._replace(self._path(k), pickle.dumps(result))

    def _path(self, k: int) -> pathlib.Path:
        return self._folder / f"sample_{k:06d}.pickle"

    def _replace(self, path: pathlib.Path, data: bytes) -> None:
        handle, name = tempfile.mkstemp(dir=self._folder, prefix=".")
        with os.fdopen(handle, "wb") as out:
            out.write(data)
        os.replace(name, path)
