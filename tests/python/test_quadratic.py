# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.QuadraticLayer: batches, outcomes, derivatives against closed forms, and what is refused; in JAX and PyTorch."""

import dyntape
import numpy as np
import pytest

EYE = np.eye(2)


def clipped(t):
    """min |x - t|^2 / 2 subject to x <= 1, entry by entry: x = min(t, 1)."""
    return dyntape.QuadraticLayer(EYE, -np.asarray(t), G=EYE, h=np.ones(2))


def test_batches_are_those_of_numpy(random):
    t = random.normal(size=(3, 4, 2)) + 1
    layer = clipped(t)
    assert np.allclose(layer.x, np.minimum(t, 1), atol=1e-14) and layer.x.shape == (3, 4, 2)
    assert np.allclose(layer.multipliers, np.maximum(t - 1, 0), atol=1e-14)
    assert layer.good.all() and (layer.outcome == "solved").all() and layer.nu.shape == (3, 4, 0)
    gradient = layer.backward(np.ones(2))
    assert np.allclose(gradient.q, np.where(t < 1, -1, 0)) and np.allclose(gradient.h, t > 1) and gradient.Q.shape == (3, 4, 2, 2)
    step = layer.forward(q=[-1.0, 0.0], h=[0.0, 1.0])
    assert np.allclose(step.x, np.stack([t[..., 0] < 1, t[..., 1] > 1], axis=-1))


def test_each_outcome_has_its_proof():
    layer = dyntape.QuadraticLayer(np.zeros((3, 1, 1)), [[0.0], [1.0], [-1.0]], G=[[1.0]], h=[[np.inf], [np.inf], [1.0]])
    assert layer.outcome.tolist() == ["solved", "unbounded", "solved"]
    assert layer.status.tolist() == ["no strict minimum", "not a solution", "good"]
    assert layer.certificate.x[1] == -1 and np.isnan(layer.backward(np.ones(1)).q[:2]).all()
    assert layer.backward(np.ones(1)).h[2] == 1
    empty = dyntape.QuadraticLayer([[1.0]], [0.0], G=[[1.0], [-1.0]], h=[-1.0, -1.0])
    assert empty.outcome == "infeasible" and empty.certificate.multipliers.tolist() == [0.5, 0.5]
    assert "no x fulfils" in empty.why and not empty.good


def test_weak_rows_have_a_slope_to_either_side():
    layer = clipped([1.0, 0.0])
    assert layer.status == "weakly active" and layer.weak.tolist() == [True, False]
    assert layer.forward(q=[-1.0, 0.0]).x.tolist() == [0, 0] and layer.forward(q=[1.0, 0.0]).x.tolist() == [-1, 0]
    assert layer.backward([1.0, 0.0]).q[0] == -1 and layer.backward([1.0, 0.0], weak="held").q[0] == 0


def test_refusals():
    for given, message in (
        (dict(Q=EYE, q=np.ones(3)), r"Q is|expected"),
        (dict(Q=EYE, q=np.ones(2), G=EYE), "G with h"),
        (dict(Q=-EYE, q=np.ones(2)), "not positive semidefinite"),
        (dict(Q=EYE, q=np.ones((3, 2)), A=np.ones((2, 1, 2)), b=np.ones(1)), "do not broadcast"),
        (dict(Q=EYE, q=[1, np.nan]), "finite"),
    ):
        with pytest.raises(dyntape.ArgumentError, match=message):
            dyntape.QuadraticLayer(**given)
    with pytest.raises(dyntape.ArgumentError, match="open"):
        clipped([0.0, 0.0]).backward(np.ones(2), weak="loose")
    with pytest.raises(dyntape.ArgumentError, match="no 'g'"):
        clipped([0.0, 0.0]).forward(g=np.ones(2))


def program(random):
    root = random.normal(size=(3, 3))
    return root @ root.T + np.eye(3), random.normal(size=3), random.normal(size=(1, 3)), np.ones(1), random.normal(size=(2, 3)), np.zeros(2)


def test_jax(random):
    jax = pytest.importorskip("jax")
    from dyntape.bridges import jax as dj
    from jax.test_util import check_grads

    jax.config.update("jax_enable_x64", True)
    Q, *rest = program(random)
    symmetric = lambda Q, *rest: dj.quadratic((Q + Q.T) / 2, *rest)
    check_grads(symmetric, (Q, *rest), order=1, modes=["rev"], rtol=1e-5, atol=1e-5)
    q = random.normal(size=(5, 3))
    many = jax.jit(jax.vmap(jax.grad(lambda q: dj.quadratic(Q, q, *rest[1:]).sum())))(q)
    assert np.allclose(many, dyntape.QuadraticLayer(Q, q, *rest[1:]).backward(np.ones(3)).q)
    assert np.isnan(dj.quadratic(np.zeros((1, 1)), np.ones(1))).all()


def test_torch(random):
    torch = pytest.importorskip("torch")
    from dyntape.bridges import torch as dt

    Q, *rest = (torch.tensor(part, requires_grad=True) for part in program(random))
    assert torch.autograd.gradcheck(lambda Q, *rest: dt.quadratic((Q + Q.T) / 2, *rest), (Q, *rest))
    q = torch.tensor(random.normal(size=(5, 3)), requires_grad=True)
    dt.quadratic(Q, q, *rest[1:]).sum().backward()
    assert Q.grad.shape == (3, 3) and q.grad.shape == (5, 3)
