# SPDX-License-Identifier: BSD-3-Clause
"""Non-zeros and where they are, as scipy has them."""

from __future__ import annotations

from typing import Any

import numpy as np


def general(values: Any, pattern: tuple[Any, Any], shape: tuple[int, int]) -> Any:
    try:
        from scipy.sparse import csr_array  # type: ignore[import-untyped, unused-ignore]
    except ImportError as error:
        raise ImportError("sparse=True gives arrays of scipy.sparse, and scipy is not installed") from error
    return csr_array((values, pattern), shape=shape)


def symmetric(values: Any, pattern: tuple[Any, Any], shape: tuple[int, int]) -> Any:
    """Of a lower triangle, both."""
    rows, cols = pattern
    off = rows != cols
    mirrored = np.concatenate([values, values[off]])
    return general(mirrored, (np.r_[rows, cols[off]], np.r_[cols, rows[off]]), shape)
