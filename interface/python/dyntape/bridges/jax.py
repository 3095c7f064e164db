# SPDX-License-Identifier: BSD-3-Clause
"""dyntape's functions in JAX: under jit, vmap, grad, jvp and vjp, with dyntape's exact derivatives.

>>> from dyntape.bridges import jax as dj
>>> jax.config.update("jax_enable_x64", True)
>>> aba = dj.function(robot, "aba")
>>> jax.jit(jax.vmap(jax.grad(lambda q, v, tau: aba(q, v, tau).sum())))(q, v, tau).shape
(4, 7)
"""

from __future__ import annotations

import math
from typing import Any, Callable

import jax
import jax.numpy as jnp
import numpy as np

from jax.typing import ArrayLike

from .. import ArgumentError, Function, QuadraticLayer, Robot, Scene
from ._exact import THIRD_ORDER, Exact


def function(what: Robot | Function, name: str | None = None, **options: Any) -> Callable[..., jax.Array]:
    """A function of a robot, or a recorded one, as a function of JAX arrays.

    what: a Robot, with the name of its function and that function's options, as frame="panda_hand"; or a dyntape.Function.
    Returns a callable.  Of a robot it takes the arguments of the method, q (..., nq), v (..., nv) and so on; of a recorded
    function x (..., n_x), and p (..., n_p) where there are parameters.  Its result is (...) + the shape of one value.

    Derivatives of first and second order are exact, in every mode of JAX.  They are by the entries of all arguments: those of
    a quaternion or of (cos, sin) are entries too, which dyntape's own derivatives by q take together as tangents.
    vmap hands the whole batch to dyntape at once.  Numbers are 64 bit.

    Raises ArgumentError for wrong shapes, for a function with several results, without jax_enable_x64, and for derivatives
    of third order.  What dyntape raises in a compiled function, as GuardViolation, JAX wraps into an error of its own.

    >>> f = dj.function(dyntape.record(lambda x: x[0] ** 2 * x[1], 2))
    >>> jax.hessian(f)(jnp.array([1.0, 2.0])).tolist()
    [[4.0, 2.0], [2.0, 0.0]]
    """
    exact = Exact(what, name, options)
    flat = _chain(exact, 0)

    def call(*arguments: ArrayLike) -> jax.Array:
        arrays = _doubles(exact.name, arguments)
        exact.check(tuple(array.shape for array in arrays))
        batch = jnp.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        x = jnp.concatenate([jnp.broadcast_to(array, (*batch, array.shape[-1])) for array in arrays], axis=-1)
        return jnp.reshape(flat(x), (*batch, *exact.shape))

    call.__name__ = exact.name
    return call


def rollout(scene: Scene) -> Callable[[ArrayLike, ArrayLike], jax.Array]:
    """Motions of a scene as a function of JAX arrays, which reverse mode derives in one sweep back.

    Returns a callable of x0 (..., nx) and u (..., steps, nu), held over each step, N m or N; its result is the states after
    each step, (..., steps, nx).  It can be under jit, vmap, grad and vjp; jvp and second derivatives are JAX's errors.

    Raises ArgumentError for a scene where q has more entries than v (Scene.rollout_jacobians derives it along tangents), for
    wrong shapes, and without jax_enable_x64.

    >>> roll = dj.rollout(dyntape.Scene("config/scenes/pendulum.info"))
    >>> jax.grad(lambda x0: roll(x0, jnp.zeros((100, 1)))[-1, 0])(jnp.array([0.1, 0.0])).shape
    (2,)
    """
    if scene.nq != scene.nv:
        raise ArgumentError(
            f'rollout: scene "{scene.name}" has {scene.nq} entries of q and {scene.nv} of v; expected joints with as many of each'
        )

    @jax.custom_vjp
    def roll(x0: jax.Array, u: jax.Array) -> jax.Array:
        return _callback(lambda *given: _in_worlds(scene.rollout, *given), (*u.shape[:-1], scene.nx), x0, u)

    def forward(x0: jax.Array, u: jax.Array) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
        return roll(x0, u), (x0, u)

    def back(saved: tuple[jax.Array, jax.Array], weights: jax.Array) -> Any:
        shapes = tuple(_spec(array.shape) for array in saved)
        gradient = lambda *given: _in_worlds(lambda *worlds: scene.rollout_gradient(*worlds)[1:], *given)
        return jax.pure_callback(gradient, shapes, *saved, weights, vmap_method="broadcast_all")

    roll.defvjp(forward, back)

    def call(start: ArrayLike, commands: ArrayLike) -> jax.Array:
        x0, u = _doubles("rollout", (start, commands))
        if x0.ndim < 1 or u.ndim < 2:
            raise ArgumentError(f"rollout: expected x0 (..., {scene.nx}) and u (..., steps, {scene.nu}), got {x0.shape} and {u.shape}")
        batch = jnp.broadcast_shapes(x0.shape[:-1], u.shape[:-2])
        return roll(jnp.broadcast_to(x0, (*batch, *x0.shape[-1:])), jnp.broadcast_to(u, (*batch, *u.shape[-2:])))

    return call


def quadratic(
    Q: ArrayLike,
    q: ArrayLike,
    A: ArrayLike | None = None,
    b: ArrayLike | None = None,
    G: ArrayLike | None = None,
    h: ArrayLike | None = None,
) -> jax.Array:
    """The solution x (..., n) of dyntape.QuadraticLayer as a function of JAX arrays, under jit, vmap, grad and vjp.

    Where there is no solution x is NaN, and so are derivatives where the minimum is not strict; weakly active rows count as open.
    jvp and second derivatives are JAX's errors.

    >>> jax.grad(lambda q: dj.quadratic(jnp.eye(1), q, G=jnp.ones((1, 1)), h=jnp.ones(1)).sum())(jnp.array([-0.5])).tolist()
    [-1.0]
    """
    if (A is None) != (b is None) or (G is None) != (h is None):
        raise ArgumentError("quadratic program: expected A with b and G with h, got one without the other")
    (cost,) = _doubles("quadratic", (q,))
    n = cost.shape[-1] if cost.ndim else 0
    none = jnp.zeros((0, n)), jnp.zeros(0)
    arrays = _doubles("quadratic", (Q, cost, *(none if A is None else (A, b)), *(none if G is None else (G, h))))
    batch = jnp.broadcast_shapes(*(array.shape[: max(0, array.ndim - axes)] for array, axes in zip(arrays, _QUADRATIC_AXES)))
    whole = (jnp.broadcast_to(array, (*batch, *array.shape[array.ndim - axes :])) for array, axes in zip(arrays, _QUADRATIC_AXES))
    x: jax.Array = _minimum(*whole)
    return x


_QUADRATIC_AXES = 2, 1, 2, 1, 2, 1


def _solved(*parts: Any) -> Any:
    layer = QuadraticLayer(*map(np.asarray, parts))
    return np.where(np.asarray(layer.outcome)[..., None] == "solved", layer.x, np.nan)


@jax.custom_vjp
def _minimum(*parts: jax.Array) -> jax.Array:
    return _callback(_solved, parts[1].shape, *parts)


def _minimum_forward(*parts: jax.Array) -> tuple[jax.Array, tuple[jax.Array, ...]]:
    return _minimum(*parts), parts


def _minimum_back(parts: tuple[jax.Array, ...], weights: jax.Array) -> Any:
    shapes = tuple(_spec(part.shape) for part in parts)
    gradient = lambda weights, *parts: tuple(QuadraticLayer(*map(np.asarray, parts)).backward(np.asarray(weights)))
    return jax.pure_callback(gradient, shapes, weights, *parts, vmap_method="broadcast_all")


_minimum.defvjp(_minimum_forward, _minimum_back)


def _chain(exact: Exact, order: int) -> Callable[[jax.Array], jax.Array]:
    """Derivatives of one order; JAX derives them by those of the next."""

    @jax.custom_jvp
    def level(x: jax.Array) -> jax.Array:
        return _callback(lambda x: exact.level(order, x), (*x.shape[:-1], exact.size(order)), x)

    @level.defjvp
    def derivative(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        (x,), (dx,) = primals, tangents
        if order == 2:
            raise ArgumentError(THIRD_ORDER.format(exact.name))
        jacobian = jnp.reshape(_chain(exact, order + 1)(x), (*x.shape[:-1], exact.size(order), exact.n))
        return level(x), jnp.sum(jacobian * dx[..., None, :], axis=-1)  # which XLA fuses; a dot would be transposed first

    return level


def _callback(f: Callable[..., Any], shape: tuple[int, ...], *arguments: jax.Array) -> jax.Array:
    result: jax.Array = jax.pure_callback(f, _spec(shape), *arguments, vmap_method="broadcast_all")
    return result


def _spec(shape: tuple[int, ...]) -> jax.ShapeDtypeStruct:
    return jax.ShapeDtypeStruct(shape, np.dtype(np.float64))  # type: ignore[no-untyped-call, unused-ignore]


def _in_worlds(f: Callable[..., Any], *given: Any) -> Any:
    """Batch axes as the one axis that a scene knows, and back; given: x0 (..., nx), and others (..., steps, n)."""
    x0, *others = map(np.asarray, given)
    batch, worlds = x0.shape[:-1], math.prod(x0.shape[:-1])
    result = f(x0.reshape(worlds, -1), *(array.reshape(worlds, *array.shape[-2:]) for array in others))
    if isinstance(result, tuple):
        return tuple(array.reshape(*batch, *array.shape[1:]) for array in result)
    return result.reshape(*batch, *result.shape[1:])


def _doubles(name: str, arguments: tuple[Any, ...]) -> tuple[jax.Array, ...]:
    if jnp.zeros(()).dtype != np.float64:
        raise ArgumentError(f'{name}: dyntape computes in 64 bits; expected jax.config.update("jax_enable_x64", True) before')
    return tuple(jnp.asarray(argument, dtype=np.float64) for argument in arguments)
