# SPDX-License-Identifier: BSD-3-Clause
"""dyntape in other libraries, a module each: `from dyntape.bridges import jax as dj`.

Each imports its library when it is imported itself; dyntape needs none of them.
"""
