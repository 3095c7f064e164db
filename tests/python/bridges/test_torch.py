# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.torch: values, first and second derivatives, batches, and what is refused."""

import dyntape
import numpy as np
import pytest
from conftest import page_section, states

torch = pytest.importorskip("torch")
from dyntape.bridges import torch as dt
from torch.autograd import gradcheck, gradgradcheck


def tensors(*arrays):
    return tuple(torch.tensor(array, requires_grad=True) for array in arrays)


def test_values_and_slopes(panda, random):
    q, v, tau = states(panda, random, 3, 2)
    x = tensors(q, v, tau)
    aba = dt.function(panda, "aba")
    y = aba(*x)
    assert np.allclose(y.detach(), panda.aba(q, v, tau), rtol=1e-12, atol=1e-12)
    y.sum().backward()
    for mine, theirs in zip(x, panda.fd_derivatives(q, v, tau)):
        assert np.allclose(mine.grad, theirs.sum(axis=-2), rtol=1e-9, atol=1e-9)
    assert np.allclose(aba(x[0], x[1][0, 0], x[2][:, :1]).detach(), panda.aba(q, v[0, 0], tau[:, :1]), rtol=1e-12, atol=1e-12)


def test_gradients_are_exact(panda, solo, random):
    x = tensors(*states(panda, random, 2))
    assert gradcheck(dt.function(panda, "aba"), x)
    assert gradgradcheck(dt.function(panda, "rnea"), x)
    assert gradcheck(dt.function(solo, "rnea"), tensors(*states(solo, random)))


def test_recorded_functions(random):
    f = dyntape.record(lambda x, p: np.array([[np.sin(x[0]) * p[0], x[1] ** 3], [x[0] * x[1], p[0]]]), 2, 1)
    g, x = dt.function(f), tensors(random.normal(size=(4, 2)), random.normal(size=(4, 1)))
    assert g(*x).shape == (4, 2, 2)
    assert gradcheck(g, x) and gradgradcheck(g, x)


def test_what_is_refused(panda):
    aba, q = dt.function(panda, "aba"), torch.zeros(7, dtype=torch.float64)
    with pytest.raises(dyntape.ArgumentError, match="float64"):
        aba(q.float(), q, q)
    with pytest.raises(dyntape.ArgumentError, match="expected q, v, tau"):
        aba(q)
    cube = dt.function(dyntape.record(lambda x: x[0] ** 3, 1))
    third = torch.tensor([2.0], dtype=torch.float64, requires_grad=True)
    first = torch.autograd.grad(cube(third), third, create_graph=True)[0]
    second = torch.autograd.grad(first.sum(), third, create_graph=True)[0]
    assert float(first.detach()) == 12 and float(second.detach()) == 12
    with pytest.raises(dyntape.ArgumentError, match="third"):
        second.sum().backward()


def test_the_page():
    names = {}
    exec(page_section("PyTorch"), names)
    assert names["q"].grad.shape == (4096, 7)
