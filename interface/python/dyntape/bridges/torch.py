# SPDX-License-Identifier: BSD-3-Clause
"""dyntape's functions in PyTorch, with dyntape's exact derivatives.

>>> from dyntape.bridges import torch as dt
>>> aba = dt.function(robot, "aba")
>>> q = torch.zeros(1000, 7, dtype=torch.float64, requires_grad=True)
>>> aba(q, q, q).sum().backward()
>>> q.grad.shape
torch.Size([1000, 7])
"""

from __future__ import annotations

from typing import Any, Callable

import numpy as np
import torch

from .. import ArgumentError, Function, QuadraticLayer, Robot
from ._exact import THIRD_ORDER, Exact


def function(what: Robot | Function, name: str | None = None, **options: Any) -> Callable[..., torch.Tensor]:
    """A function of a robot, or a recorded one, as a function of tensors.

    what: a Robot, with the name of its function and that function's options, as frame="panda_hand"; or a dyntape.Function.
    Returns a callable.  Of a robot it takes the arguments of the method, q (..., nq), v (..., nv) and so on; of a recorded
    function x (..., n_x), and p (..., n_p) where there are parameters.  Its result is (...) + the shape of one value.

    Derivatives of first and second order are exact, by the entries of all arguments; backward can be called twice.
    Tensors are float64; those of a GPU are copied to the CPU and back.

    Raises ArgumentError for wrong shapes and types, for a function with several results, and for derivatives of third order.

    >>> f = dt.function(dyntape.record(lambda x: x[0] ** 2 * x[1], 2))
    >>> torch.autograd.functional.hessian(f, torch.tensor([1.0, 2.0], dtype=torch.float64)).tolist()
    [[4.0, 2.0], [2.0, 0.0]]
    """
    exact = Exact(what, name, options)

    def call(*arguments: torch.Tensor) -> torch.Tensor:
        exact.check(tuple(tuple(argument.shape) for argument in arguments))
        for argument in arguments:
            if argument.dtype != torch.float64:
                raise ArgumentError(f"{exact.name}: dyntape computes in 64 bits; expected tensors of float64, got {argument.dtype}")
        batch = np.broadcast_shapes(*(argument.shape[:-1] for argument in arguments))
        x = torch.cat([argument.expand(*batch, argument.shape[-1]) for argument in arguments], dim=-1)
        y: torch.Tensor = _Level.apply(exact, 0, x)
        return y.reshape((*batch, *exact.shape))

    call.__name__ = exact.name
    return call


def quadratic(
    Q: torch.Tensor,
    q: torch.Tensor,
    A: torch.Tensor | None = None,
    b: torch.Tensor | None = None,
    G: torch.Tensor | None = None,
    h: torch.Tensor | None = None,
) -> torch.Tensor:
    """The solution x (..., n) of dyntape.QuadraticLayer as a function of tensors.

    Where there is no solution x is NaN, and so are derivatives where the minimum is not strict; weakly active rows count as open.
    Derivatives are of first order.

    >>> q = torch.tensor([-0.5], dtype=torch.float64, requires_grad=True)
    >>> one = torch.ones(1, dtype=torch.float64)
    >>> dt.quadratic(torch.eye(1, dtype=torch.float64), q, G=one[None], h=one).sum().backward()
    >>> q.grad.tolist()
    [-1.0]
    """
    for part in (Q, q, A, b, G, h):
        if part is not None and part.dtype != torch.float64:
            raise ArgumentError(f"quadratic: dyntape computes in 64 bits; expected tensors of float64, got {part.dtype}")
    x: torch.Tensor = _Minimum.apply(Q, q, A, b, G, h)
    return x


class _Minimum(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, *parts: torch.Tensor | None) -> torch.Tensor:
        ctx.layer = QuadraticLayer(*(None if part is None else part.detach().cpu().numpy() for part in parts))
        ctx.likes = [None if part is None else (part.shape, part.device) for part in parts]
        solved = np.asarray(ctx.layer.outcome)[..., None] == "solved"
        q = parts[1]
        assert q is not None
        return torch.from_numpy(np.where(solved, ctx.layer.x, np.nan)).to(q.device)

    @staticmethod
    @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator, unused-ignore]
    def backward(ctx: Any, slope: torch.Tensor) -> Any:
        gradients = ctx.layer.backward(slope.cpu().numpy())
        return tuple(
            None if like is None else torch.from_numpy(part).sum_to_size(like[0]).to(like[1])
            for like, part in zip(ctx.likes, gradients)
        )


class _Level(torch.autograd.Function):
    """Derivatives of one order; PyTorch derives them by those of the next."""

    @staticmethod
    def forward(ctx: Any, exact: Exact, order: int, x: torch.Tensor) -> torch.Tensor:
        ctx.exact, ctx.order = exact, order
        ctx.save_for_backward(x)
        return torch.from_numpy(exact.level(order, x.detach().cpu().numpy())).to(x.device)

    @staticmethod
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[None, None, torch.Tensor]:
        exact, order, (x,) = ctx.exact, ctx.order, ctx.saved_tensors
        if order == 2:
            raise ArgumentError(THIRD_ORDER.format(exact.name))
        jacobian = _Level.apply(exact, order + 1, x).reshape(*x.shape[:-1], exact.size(order), exact.n)
        return None, None, torch.einsum("...i,...ij->...j", weights, jacobian)
