# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.jax: values, derivatives in every mode, batches, and what is refused."""

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, page_section, states

jax = pytest.importorskip("jax")
import jax.numpy as jnp
from dyntape.bridges import jax as dj
from jax.test_util import check_grads

jax.config.update("jax_enable_x64", True)


def test_values_are_those_of_dyntape(panda, random):
    q, v, tau = states(panda, random, 5)
    aba = dj.function(panda, "aba")
    expected = panda.aba(q, v, tau)
    for f in aba, jax.jit(aba), jax.vmap(aba), jax.jit(jax.vmap(aba, in_axes=(0, 0, 0))):
        assert np.allclose(f(q, v, tau), expected, rtol=1e-12, atol=1e-12)
    assert np.allclose(jax.vmap(aba, in_axes=(0, None, None))(q, v[0], tau[0]), panda.aba(q, v[0], tau[0]), rtol=1e-12)
    assert np.allclose(aba(q[:, None], v, tau), panda.aba(q[:, None], v, tau), rtol=1e-12)


def test_gradients_are_exact(panda, random):
    q, v, tau = states(panda, random)
    aba = dj.function(panda, "aba")
    for mode in "fwd", "rev":
        check_grads(aba, (q, v, tau), order=2, modes=[mode], rtol=1e-5, atol=1e-5)
    by_q, by_v, by_tau = jax.jacrev(aba, argnums=(0, 1, 2))(q, v, tau)
    exact = panda.fd_derivatives(q, v, tau)
    for mine, theirs in zip((by_q, by_v, by_tau), exact):
        assert np.allclose(mine, theirs, rtol=1e-9, atol=1e-9)


def test_quaternions_are_derived_by_their_entries(solo, random):
    q, v, tau = states(solo, random)
    check_grads(jax.jit(dj.function(solo, "rnea")), (q, v, tau), order=1, rtol=1e-5, atol=1e-5)


def test_many_states_at_once(panda, random):
    """Large arguments of callbacks reach JAX's pool of threads, which is small here."""
    q, v, tau = states(panda, random, 20_000)
    aba = dj.function(panda, "aba")
    slopes = jax.jit(jax.vmap(jax.grad(lambda q, v, tau: aba(q, v, tau).sum())))(q, v, tau)
    assert np.allclose(slopes, panda.fd_derivatives(q, v, tau)[0].sum(axis=1), rtol=1e-8, atol=1e-8)


def test_recorded_functions():
    f = dyntape.record(lambda x, p: np.array([[np.sin(x[0]) * p[0], x[1] ** 3], [x[0] * x[1], p[0]]]), 2, 1)
    g = dj.function(f)
    x, p = np.array([0.3, -0.7]), np.array([2.0])
    assert np.allclose(g(x, p), f(x, p))
    check_grads(g, (x, p), order=2, rtol=1e-5, atol=1e-5)
    hessian = jax.jit(jax.hessian(lambda x: g(x, p)[0, 1]))(x)
    assert np.allclose(hessian, [[0, 0], [0, 6 * x[1]]])
    nested = jax.vmap(jax.vmap(g, in_axes=(0, None)), in_axes=(None, 0))(np.ones((3, 2)), np.ones((4, 1)))
    assert nested.shape == (4, 3, 2, 2)


def test_options_of_robot_functions(panda):
    q = panda.random()
    jacobian = dj.function(panda, "frame_jacobian", frame="panda_hand")
    assert np.allclose(jacobian(q), panda.frame_jacobian(q, frame="panda_hand"), rtol=1e-12, atol=1e-12)


def test_what_is_refused(panda):
    with pytest.raises(dyntape.ArgumentError, match="several results"):
        dj.function(panda, "frame_placement", frame="panda_hand")
    with pytest.raises(dyntape.ArgumentError, match="name of a function"):
        dj.function(panda)
    with pytest.raises(dyntape.ArgumentError, match="no function"):
        dj.function(panda, "abba")
    with pytest.raises(dyntape.ArgumentError, match=r"expected q of shape \(..., 7\), got \(6,\)"):
        dj.function(panda, "aba")(np.zeros(6), np.zeros(7), np.zeros(7))
    cube = dj.function(dyntape.record(lambda x: x[0] ** 3, 1))
    with pytest.raises(dyntape.ArgumentError, match="third"):
        jax.grad(jax.grad(jax.grad(lambda x: cube(x[None]))))(2.0)
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(dyntape.ArgumentError, match="jax_enable_x64"):
            cube(np.ones(1))
    finally:
        jax.config.update("jax_enable_x64", True)


def test_rollouts(random):
    scene = dyntape.Scene(CONFIG / "scenes" / "pendulum.info")
    roll = dj.rollout(scene)
    x0, u = 0.1 * random.normal(size=(3, scene.nx)), random.normal(size=(3, 10, scene.nu))
    for f in roll, jax.jit(jax.vmap(roll)):
        assert np.allclose(f(x0, u), scene.rollout(x0, u), rtol=1e-13, atol=1e-14)
    check_grads(roll, (x0, u), order=1, modes=["rev"], rtol=1e-5, atol=1e-5)
    slopes = jax.jit(jax.vmap(jax.grad(lambda x0, u: (roll(x0, u) ** 2).sum(), argnums=(0, 1))))(x0, u)
    expected = scene.rollout_gradient(x0, u, 2 * scene.rollout(x0, u))[1:]
    assert all(np.allclose(mine, theirs, rtol=1e-12) for mine, theirs in zip(slopes, expected))
    with pytest.raises(dyntape.ArgumentError, match="as many of each"):
        dj.rollout(dyntape.Scene(CONFIG / "scenes" / "quadruped_explicit.info"))


def test_the_page():
    names = {}
    exec(page_section("JAX"), names)
    assert names["slopes"].shape == (4096, 7)
