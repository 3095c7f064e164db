# SPDX-License-Identifier: BSD-3-Clause
"""Tensors of other libraries as arguments: read without a copy where they lie in memory, else by their own copy to the host."""

import tracemalloc

import numpy as np
import pytest

import dyntape


class OnHost:
    """Has DLPack's two methods and nothing else."""

    def __init__(self, values):
        self.values = np.asarray(values)

    def __dlpack__(self, **options):
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return (1, 0)


class OnCard:
    """A tensor in a card's memory, as PyTorch, CuPy and Numba have them: nobody reads it but by its own method."""

    def __init__(self, values, copy, by_dlpack=True):
        self.values, self.copies = np.asarray(values), 0
        setattr(self, copy, self.copied)
        if by_dlpack:
            self.__class__ = type('OnCardByDlpack', (OnCard,), {'__dlpack_device__': lambda self: (2, 0)})
        else:
            self.__cuda_array_interface__ = {}

    def __dlpack__(self, **options):
        raise BufferError('in the memory of a card')

    def __array__(self, dtype=None, copy=None):
        raise TypeError('in the memory of a card')

    def copied(self):
        self.copies += 1
        return self.values


def squares():
    return dyntape.record(lambda x: x @ x, 4)


def test_tensors_with_dlpack_alone():
    x = np.random.default_rng(1).normal(size=(20, 4))
    f, arm = squares(), dyntape.load('config/robots/arm_2r.urdf')
    assert np.array_equal(f(OnHost(x)), f(x))
    assert np.array_equal(f(OnHost(x.astype(np.float32))), f(x.astype(np.float32)))
    assert np.array_equal(f.jacobian(OnHost(x[::2])), f.jacobian(x[::2]))
    q = x[:, :2]
    assert np.array_equal(arm.rnea(OnHost(q), q, OnHost(q)), arm.rnea(q, q, q))
    with pytest.raises(dyntape.ArgumentError, match=r'expected x of shape \(\.\.\., 4\), got \(20, 3\)'):
        f(OnHost(x[:, :3]))


@pytest.mark.parametrize('copy', ['cpu', 'get', 'copy_to_host'])
@pytest.mark.parametrize('by_dlpack', [True, False])
def test_tensors_of_a_card_copy_themselves(copy, by_dlpack):
    x = np.random.default_rng(2).normal(size=(20, 4))
    tensor = OnCard(x, copy, by_dlpack)
    assert np.array_equal(squares()(tensor), squares()(x)) and tensor.copies == 1


def test_a_tensor_of_a_card_that_cannot_be_copied():
    with pytest.raises(dyntape.ArgumentError, match='x: expected an array of numbers: in the memory of a card'):
        squares()(OnCard(np.zeros((2, 4)), 'no_such_method'))


def most_memory(call):
    """Bytes that numpy allocates meanwhile."""
    tracemalloc.start()
    call()
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return most


def test_tensors_of_the_processor_are_not_copied():
    f, x = squares(), np.ones((250_000, 4))  # 8 MB, and results of 2 MB
    tensor = OnHost(x)
    f(tensor)
    assert most_memory(lambda: f(tensor)) < 3e6
    assert most_memory(lambda: f(OnHost(x.astype(np.float32)))) > 7e6  # which is converted


def test_torch():
    torch = pytest.importorskip('torch')
    f, x = squares(), torch.ones((250_000, 4), dtype=torch.float64)
    assert np.array_equal(f(x), np.full(250_000, 4.0))
    assert most_memory(lambda: f(x)) < 3e6
    assert np.array_equal(f(x[:, None, :1].expand(-1, 2, 4)), np.full((250_000, 2), 4.0))
    assert np.array_equal(f(x[:3].float()), np.full(3, 4.0))
    arm = dyntape.load('config/robots/arm_2r.urdf')
    q = torch.linspace(-1, 1, 10, dtype=torch.float64).reshape(5, 2)
    assert np.array_equal(arm.aba(q, q, q.T.contiguous().T), arm.aba(*[q.numpy()] * 3))
    with pytest.raises(dyntape.ArgumentError, match='rnea: q: the tensor requires a gradient'):
        arm.rnea(q.clone().requires_grad_(), q, q)


def test_jax():
    jax = pytest.importorskip('jax')
    jax.config.update('jax_enable_x64', True)
    f, x = squares(), jax.numpy.ones((250_000, 4))
    assert np.array_equal(f(x), np.full(250_000, 4.0))
    assert most_memory(lambda: f(x)) < 3e6
    arm = dyntape.load('config/robots/arm_2r.urdf')
    q = jax.numpy.linspace(-1, 1, 10).reshape(5, 2)
    assert np.array_equal(arm.crba(q), arm.crba(np.asarray(q)))
