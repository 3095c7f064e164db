# SPDX-License-Identifier: BSD-3-Clause
"""What of a MuJoCo model has no counterpart in a robot of dyntape's, a sentence each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

import mujoco as mj  # type: ignore[import-not-found, import-untyped, unused-ignore]
import numpy as np


def left_out(m: mj.MjModel, untouchable: Counter[str]) -> list[str]:
    """Sentences; untouchable: how many geoms that collide have no contact points, by kind.

    >>> left_out(mj.MjModel.from_xml_string("<mujoco/>"), Counter())
    []
    """
    return [*_joints(m), *_bodies(m), *_parts(m), *_geoms(m, untouchable), *_world(m)]


def _count(n: int, one: str, many: str = "") -> str:
    return f"1 {one}" if n == 1 else f"{n} {many or one + 's'}"


def _named(m: mj.MjModel, kind: Any, indices: Iterable[int]) -> str:
    names = [mj.mj_id2name(m, kind, int(i)) or f"number {i}" for i in indices]
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def _field(m: mj.MjModel, name: str, rows: int) -> Any:
    """An array that older versions of MuJoCo have not: zeros then."""
    return getattr(m, name, np.zeros((rows, 1)))


def _any_of(array: Any) -> Any:
    """Rows that are not all zero."""
    return np.array([i for i, row in enumerate(np.asarray(array)) if np.any(row)], dtype=int)


def _joints(m: mj.MjModel) -> Iterator[str]:
    kind = mj.mjtObj.mjOBJ_JOINT
    several = [j for j in range(m.njnt) if m.jnt_type[j] in (mj.mjtJoint.mjJNT_FREE, mj.mjtJoint.mjJNT_BALL)]
    widths = {j: 6 if m.jnt_type[j] == mj.mjtJoint.mjJNT_FREE else 3 for j in several}
    dofs = {j: slice(m.jnt_dofadr[j], m.jnt_dofadr[j] + widths[j]) for j in several}
    if found := [j for j in several if m.dof_armature[dofs[j]].any()]:
        yield f"armature of joints with several axes: {_named(m, kind, found)}"
    if found := [j for j in several if m.jnt_stiffness[j]]:
        yield f"springs of joints with several axes: {_named(m, kind, found)}"
    if found := [j for j in several if m.jnt_limited[j]]:
        yield f"limits of joints with several axes: {_named(m, kind, found)}"
    for field, what in ("dof_dampingpoly", "damping that is not linear"), ("jnt_stiffnesspoly", "springs that are not linear"):
        found = _any_of(_field(m, field, m.nv if field.startswith("dof") else m.njnt))
        if len(found):
            joints = sorted({int(m.dof_jntid[k]) for k in found}) if field.startswith("dof") else found
            yield f"{what}, of {_named(m, kind, joints)}"
    if found := [j for j in _any_of(_field(m, "jnt_springyield", m.njnt)) if getattr(m, "nplastic", 0)]:
        yield f"springs that yield, of {_named(m, kind, found)}"


def _bodies(m: mj.MjModel) -> Iterator[str]:
    kind = mj.mjtObj.mjOBJ_BODY
    if len(found := _any_of(m.body_gravcomp)):
        yield f"compensation of gravity of {_count(len(found), 'body', 'bodies')}: {_named(m, kind, found)}"
    if m.nmocap:
        yield f"motion of {_count(m.nmocap, 'mocap body', 'mocap bodies')}, which stand still: {_named(m, kind, np.flatnonzero(m.body_mocapid >= 0))}"


def _parts(m: mj.MjModel) -> Iterator[str]:
    counted = [
        (m.nu, "actuator", "", mj.mjtObj.mjOBJ_ACTUATOR),
        (m.ntendon, "tendon", "", mj.mjtObj.mjOBJ_TENDON),
        (m.neq, "equality constraint", "", mj.mjtObj.mjOBJ_EQUALITY),
        (m.nflex, "flexible object", "", mj.mjtObj.mjOBJ_FLEX),
        (m.npair, "contact pair", "", mj.mjtObj.mjOBJ_PAIR),
        (m.nexclude, "exclusion of contacts", "exclusions of contacts", mj.mjtObj.mjOBJ_EXCLUDE),
        (m.nsensor, "sensor", "", mj.mjtObj.mjOBJ_SENSOR),
        (m.nkey, "keyframe", "", mj.mjtObj.mjOBJ_KEY),
    ]
    for n, one, many, kind in counted:
        if n:
            yield f"{_count(n, one, many)}: {_named(m, kind, range(n))}"
    if m.nplugin:
        yield _count(m.nplugin, "plugin")


def _geoms(m: mj.MjModel, untouchable: Counter[str]) -> Iterator[str]:
    for kind, n in sorted(untouchable.items()):
        yield f"contacts of {_count(n, 'geom')} of the kind {kind}"
    if untouched := sum(untouchable.values()):
        if n := m.ngeom - untouched:
            yield f"contacts of {_count(n, 'other geom')} with one another: robot.contacts has where they touch a plane"


def _world(m: mj.MjModel) -> Iterator[str]:
    if m.opt.density or m.opt.viscosity:
        yield f"the fluid of density {m.opt.density:g} kg/m^3 and viscosity {m.opt.viscosity:g} Pa s"
    if np.any(m.opt.wind):
        yield "wind"
    if len(found := _any_of(_field(m, "actuator_armature", m.nu))):
        yield f"reflected inertia of {_count(len(found), 'actuator')}"
    if len(found := _any_of(_field(m, "tendon_armature", m.ntendon))):
        yield f"inertia of {_count(len(found), 'tendon')}"
