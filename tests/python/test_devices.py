# SPDX-License-Identifier: BSD-3-Clause
"""Functions on devices of OpenCL: the interpreter's bits, shapes, errors.  Skipped where there is no device."""
import os
import subprocess
import sys

import numpy as np
import pytest

import dyntape


def reason_of_absence():
    try:
        return '' if dyntape.devices() else 'the loader of OpenCL knows no device'
    except dyntape.ToolError as error:
        return str(error)


needs_device = pytest.mark.skipif(bool(reason_of_absence()), reason=reason_of_absence() or 'there is one')


def swing(x, p):
    return np.array([p[0] * np.sin(x[0]) * x[1], x[0] / (2 + np.cos(x[1]))])


@needs_device
def test_batches_have_the_interpreters_bits():
    plain, on_device = (dyntape.record(swing, 2, 1) for _ in range(2))
    assert on_device.compile(device='opencl:0') is on_device and on_device.is_compiled
    random = np.random.default_rng(3)
    x, p, weights = random.normal(size=(7, 30, 2)), random.normal(size=1), random.normal(size=(30, 2))
    for found, expected in [
        (on_device(x, p), plain(x, p)),
        (on_device(x[0, 0], p), plain(x[0, 0], p)),
        (on_device.jacobian(x, p), plain.jacobian(x, p)),
        (on_device.jacobian_values(x[:, ::2], p), plain.jacobian_values(x[:, ::2], p)),
        (on_device.hessian(x, p, weights), plain.hessian(x, p, weights)),
        (on_device(np.empty((0, 2)), p), np.empty((0, 2))),
    ]:
        assert found.shape == expected.shape
        assert np.array_equal(found, expected)


@needs_device
def test_batches_of_many_parts():
    f, g = dyntape.record(lambda x: np.outer(x, x), 30), dyntape.record(lambda x: np.outer(x, x), 30)
    g.compile(0, device='opencl:0')
    x = np.random.default_rng(4).normal(size=(40_000, 30))  # 288 MB of results: several parts
    assert np.array_equal(g(x), f(x))


@needs_device
def test_guards_are_told():
    f = dyntape.record(lambda x: x[0] if x[0] < 1 else -x[0], 1, x0=[0.5])
    f.compile(device='opencl:0')
    x = np.zeros((2000, 1))
    x[1234] = 3
    with pytest.raises(dyntape.GuardViolation, match=r'test_devices.py.*\(at point 1234\)'):
        f(x)
    assert np.array_equal(f(np.zeros((3, 1))), np.zeros(3))


@needs_device
def test_single():
    f = dyntape.record(swing, 2, 1).compile(1, device='opencl:0', single=True)
    x = np.random.default_rng(5).normal(size=(50, 2))
    found, expected = f(x, [2.0]), dyntape.record(swing, 2, 1)(x, [2.0])
    assert found.dtype == np.float64 and not np.array_equal(found, expected)
    assert np.allclose(found, expected, rtol=1e-5, atol=1e-6)
    assert np.array_equal(found, found.astype(np.float32))


@needs_device
def test_devices_say_what_they_are():
    first = dyntape.devices()[0]
    assert first.name and first.platform and first.driver and first.memory > 0
    assert first.name in repr(first)


def test_wrong_devices():
    f = dyntape.record(swing, 2, 1)
    with pytest.raises(dyntape.ArgumentError, match='device "cuda:0": expected opencl: and a number, as in opencl:0'):
        f.compile(device='cuda:0')
    with pytest.raises(dyntape.ArgumentError, match='single: expected a device, got none'):
        f.compile(single=True)
    assert not f.is_compiled
    assert f([0.1, 0.2], [1.0]).shape == (2,)


def test_without_a_loader():
    program = 'import dyntape, sys\ntry:\n  dyntape.devices()\nexcept dyntape.ToolError as e:\n  sys.exit(str(e))'
    run = subprocess.run([sys.executable, '-c', program], env={**os.environ, 'DYNTAPE_OPENCL': 'libnowhere.so.7'}, capture_output=True,
                         text=True)
    assert run.returncode == 1
    assert run.stderr.startswith('OpenCL: the loader libnowhere.so.7 cannot be opened; expected an installed loader')


@needs_device
def test_a_loader_without_devices(tmp_path):
    program = 'import dyntape\nprint(dyntape.devices())\ndyntape.record(lambda x: x, 1).compile(device="opencl:0")'
    run = subprocess.run([sys.executable, '-c', program], env={**os.environ, 'OCL_ICD_VENDORS': str(tmp_path)}, capture_output=True,
                         text=True)
    assert run.stdout == '[]\n'
    assert 'ToolError: OpenCL: the loader knows no device; expected a driver' in run.stderr
