# SPDX-License-Identifier: BSD-3-Clause
"""Robots from MuJoCo's models, through its own compiler: MJCF files, MjSpec, MjModel.

    from dyntape.bridges import mujoco as dm
    robot = dm.load("humanoid.xml")
    q, v = robot.from_mujoco(data.qpos, data.qvel)
    a = robot.aba(q, v, robot.passive(q, v) + tau)
    print("\\n".join(robot.left_out))
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable
from typing import Any, NamedTuple

import mujoco as mj  # type: ignore[import-not-found, import-untyped, unused-ignore]
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import ArgumentError, Body, FileError, Robot, Shape
from .._bodies import state_of
from ._mujoco_left_out import left_out

Array = NDArray[np.float64]
_FREE, _BALL, _SLIDE, _HINGE = (int(getattr(mj.mjtJoint, f"mjJNT_{kind}")) for kind in ("FREE", "BALL", "SLIDE", "HINGE"))
_TYPES = {_FREE: "free-flyer", _BALL: "spherical", _SLIDE: "prismatic", _HINGE: "revolute"}
_GEOM = mj.mjtGeom


class ContactPoint(NamedTuple):
    """A sphere, or with radius 0 a point, in which a geom that collides touches a plane.

    geom: its name.  frame: the body that it moves with.  position: (3,) m, in that frame.  radius: m.
    friction: of sliding.
    """

    geom: str
    frame: str
    position: Array
    radius: float
    friction: float


class MujocoRobot(Robot):
    """A robot with the state of a MuJoCo model beside its own; made by `load`.

    Joints are in MuJoCo's order, each with the same number of entries; frames are bodies and sites.  What differs:
        quaternions      MuJoCo w x y z, here x y z w
        free joints      MuJoCo's linear velocity is along the world's axes, here along the body's; the angular one is along the
                         body's axes in both
        slides, hinges   MuJoCo's position counts from the joint's `ref`, here from the pose that the file describes

    contacts: where its geoms touch planes.  What has no counterpart is in left_out, a sentence each.
    """

    _facts: dict[str, Array]
    contacts: tuple[ContactPoint, ...]

    def from_mujoco(self, qpos: ArrayLike, qvel: ArrayLike) -> tuple[Array, Array]:
        """(q, v) of MuJoCo's qpos (..., nq) and qvel (..., nv).

        >>> ball = load(mj.MjModel.from_xml_string('''<mujoco><worldbody><body name="ball"><freejoint/>
        ... <geom size="0.1"/></body></worldbody></mujoco>'''))
        >>> ball.from_mujoco([1, 2, 3, 0, 0, 0, 1], [1, 0, 0, 0, 0, 5])[1].tolist()
        [-1.0, 0.0, 0.0, 0.0, 0.0, 5.0]
        """
        f = self._facts
        q = np.array(qpos, dtype=float)[..., f["order"]] - f["reference"]
        return q, self._turned(q, qvel, back=True)

    def to_mujoco(self, q: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """(qpos, qvel) of q (..., nq) and v (..., nv)."""
        f = self._facts
        q = np.asarray(q, dtype=float)
        return (q + f["reference"])[..., np.argsort(f["order"])], self._turned(q, v)

    def accelerations_from_mujoco(self, qpos: ArrayLike, qvel: ArrayLike, qacc: ArrayLike) -> Array:
        """(..., nv) accelerations here of MuJoCo's qacc (..., nv)."""
        q, v = self.from_mujoco(qpos, qvel)
        return self._turned(q, qacc, back=True) - self._spin(v)

    def accelerations_to_mujoco(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """MuJoCo's qacc (..., nv) of accelerations a (..., nv)."""
        return self._turned(q, np.asarray(a, dtype=float) + self._spin(np.asarray(v, dtype=float)))

    def forces_from_mujoco(self, qpos: ArrayLike, force: ArrayLike) -> Array:
        """tau (..., nv) of MuJoCo's generalised forces, as qfrc_applied (..., nv), N m or N."""
        q = np.array(qpos, dtype=float)[..., self._facts["order"]]
        return self._turned(q, force, back=True)

    def forces_to_mujoco(self, q: ArrayLike, tau: ArrayLike) -> Array:
        """MuJoCo's generalised forces (..., nv) of tau (..., nv), N m or N."""
        return self._turned(q, tau)

    def passive(self, q: Any, v: Any) -> Any:
        """(..., nv) what its springs and dampers exert, to be added to tau; numpy's arrays, or recorded values.

        Springs of slides and hinges, and linear dampers of all joints.
        """
        f = self._facts
        return f["stiffness"] * (f["rest"] - q[..., f["places"]]) - f["damping"] * v

    def _turned(self, q: Any, v: ArrayLike, back: bool = False) -> Array:
        """Linear parts of free joints from body axes to the world's, or back."""
        q, result = np.asarray(q, dtype=float), np.array(v, dtype=float)
        shape = np.broadcast_shapes(q.shape[:-1], result.shape[:-1])
        result = np.broadcast_to(result, (*shape, result.shape[-1])).copy()
        for i, k in self._facts["free"].astype(int):
            R = _rotations(np.roll(q[..., i + 3 : i + 7], 1, axis=-1))
            result[..., k : k + 3] = np.einsum("...ji,...j->...i" if back else "...ij,...j->...i", R, result[..., k : k + 3])
        return result

    def _spin(self, v: Array) -> Array:
        """w x v of the free joints: between the rate of components in the body's axes and the body's acceleration."""
        result = np.zeros_like(v)
        for _, k in self._facts["free"].astype(int):
            result[..., k : k + 3] = np.cross(v[..., k + 3 : k + 6], v[..., k : k + 3])
        return result

    def __getstate__(self) -> Any:
        return super().__getstate__(), self._facts, self.contacts

    def __setstate__(self, state: Any) -> None:
        super().__setstate__(state[0])
        self._facts, self.contacts = state[1], state[2]


def load(model: str | os.PathLike[str] | mj.MjModel | mj.MjSpec) -> MujocoRobot:
    """A robot from a MuJoCo model.

    model: the path of an MJCF or URDF file, which MuJoCo's compiler reads, an MjSpec, or an MjModel.

    Bodies and their inertias, joints of all four kinds, reflected inertia, damping, dry friction, springs, limits, gravity, sites,
    geoms as shapes and as contact points come along.  Bodies without joints are merged into the one that carries them.

    Raises FileError with MuJoCo's sentence for what it cannot read, ArgumentError for a model without joints.

    >>> pendulum = load(mj.MjModel.from_xml_string('''<mujoco><worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
    ... <geom type="capsule" fromto="0 0 0 0 0 -1" size="0.05"/></body></worldbody></mujoco>'''))
    >>> pendulum.joints, pendulum.nv
    (['hinge'], 1)
    """
    m = _compiled(model)
    if m.njnt == 0:
        raise ArgumentError("mujoco: the model has no joint; expected one at least")
    reader = _Reader(m)
    robot = MujocoRobot.__new__(MujocoRobot)
    gravity = np.zeros(3) if m.opt.disableflags & int(mj.mjtDisableBit.mjDSBL_GRAVITY) else m.opt.gravity
    state = state_of(_model_name(m), reader.bodies, frames=reader.frames, gravity=gravity,
                     left_out=left_out(m, reader.untouchable), shapes=reader.shapes,
                     contacts=[(point.frame, point.position, point.radius) for point in reader.contacts])  # fmt: skip
    robot.__setstate__((state, _facts_of(m), tuple(reader.contacts)))
    return robot


def _compiled(model: Any) -> mj.MjModel:
    if isinstance(model, mj.MjModel):
        return model
    if hasattr(model, "compile"):
        return model.compile()
    try:
        return mj.MjModel.from_xml_path(os.fspath(model))
    except ValueError as refused:
        raise FileError(f"{os.fspath(model)}: MuJoCo cannot read it: {' '.join(str(refused).split())}") from refused


def _model_name(m: mj.MjModel) -> str:
    return bytes(m.names).split(b"\0", 1)[0].decode() or "mujoco"


def _rotations(wxyz: Array) -> Array:
    """(..., 3, 3) of quaternions (..., 4) of any length."""
    w, x, y, z = np.moveaxis(wxyz / np.linalg.norm(wxyz, axis=-1, keepdims=True), -1, 0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]  # fmt: skip
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _placement(wxyz: Array, position: Array) -> Array:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = _rotations(wxyz), position
    return X


class _Reader:
    """Walks the bodies; `carrier` and `X` say for each body which joint moves it, and where it is in that joint's frame."""

    def __init__(self, m: mj.MjModel) -> None:
        self.m = m
        self.bodies: list[Body] = []
        self.frames: dict[str, tuple[str | None, Array, Array]] = {}
        self.shapes: list[Shape] = []
        self.contacts: list[ContactPoint] = []
        self.untouchable: Counter[str] = Counter()  # geoms that collide and have no contact points, by kind
        names = [self._name(mj.mjtObj.mjOBJ_JOINT, j) or f"joint_{j}" for j in range(m.njnt)]
        self._joint_names = [name if names.count(name) == 1 else f"{name}_{j}" for j, name in enumerate(names)]
        self._body_names = [self._name(mj.mjtObj.mjOBJ_BODY, b) or f"body_{b}" for b in range(m.nbody)]
        carrier: list[int | None] = [None]
        X = [np.eye(4)]
        self._add_frame(self._body_names[0], None, X[0])
        for b in range(1, m.nbody):
            on, placed = self._enter(b, carrier[m.body_parentid[b]], X[m.body_parentid[b]])
            carrier.append(on)
            X.append(placed)
            self._add_frame(self._body_names[b], on, placed)
        for s in range(m.nsite):
            b, name = m.site_bodyid[s], self._name(mj.mjtObj.mjOBJ_SITE, s)
            if name:
                taken = name in self.frames
                self._add_frame(f"{name}_site" if taken else name, carrier[b], X[b] @ _placement(m.site_quat[s], m.site_pos[s]))
        for g in range(m.ngeom):
            self._add_geom(g)

    def _name(self, kind: Any, index: int) -> str:
        return mj.mj_id2name(self.m, kind, index) or ""

    def _add_frame(self, name: str, carrier: int | None, X: Array) -> None:
        if name not in self.frames:
            self.frames[name] = (None if carrier is None else self.bodies[carrier].joint, X[:3, :3], X[:3, 3])

    def _enter(self, b: int, carrier: int | None, X: Array) -> tuple[int | None, Array]:
        m = self.m
        X = X @ _placement(m.body_quat[b], m.body_pos[b])
        first = m.body_jntadr[b]
        for j in range(first, first + m.body_jntnum[b]):
            there, back = np.eye(4), np.eye(4)  # to the joint's anchor, which is the origin of the frame here
            if m.jnt_type[j] == _FREE:
                X = np.eye(4)
            elif m.jnt_type[j] != _SLIDE:
                there[:3, 3], back[:3, 3] = m.jnt_pos[j], -m.jnt_pos[j]
            self.bodies.append(self._joint(j, None if carrier is None else self.bodies[carrier].joint, X @ there))
            carrier, X = len(self.bodies) - 1, back
        if carrier is not None:
            self._add_inertia(self.bodies[carrier], b, X)
        return carrier, X

    def _joint(self, j: int, parent: str | None, fixed: Array) -> Body:
        m, dof = self.m, self.m.jnt_dofadr[j]
        body = Body(self._joint_names[j], _TYPES[int(m.jnt_type[j])], parent, fixed[:3, :3], fixed[:3, 3])
        body.damping, body.friction = float(m.dof_damping[dof]), float(m.dof_frictionloss[dof])
        if _is_single(m.jnt_type[j]):
            body.axis = m.jnt_axis[j] / np.linalg.norm(m.jnt_axis[j])
            body.armature = float(m.dof_armature[dof])
            if m.jnt_limited[j]:
                body.lower, body.upper = (float(end - m.qpos0[m.jnt_qposadr[j]]) for end in m.jnt_range[j])
            if getattr(m, "jnt_actfrclimited", np.zeros(m.njnt))[j]:
                body.effort = float(np.abs(m.jnt_actfrcrange[j]).max())
        return body

    def _add_inertia(self, carrier: Body, b: int, X: Array) -> None:
        m = self.m
        if m.body_mass[b] == 0 and not m.body_inertia[b].any():
            return
        at = X @ _placement(m.body_iquat[b], m.body_ipos[b])
        R, com, mass = at[:3, :3], at[:3, 3], float(m.body_mass[b])
        inertia: Array = R @ np.diag(m.body_inertia[b]) @ R.T
        inertia = (inertia + inertia.T) / 2
        if carrier.mass == 0 and not np.any(carrier.inertia):
            carrier.mass, carrier.com, carrier.inertia = mass, com, inertia
            return
        d: Array = np.asarray(carrier.com, dtype=float) - com
        total = carrier.mass + mass
        share = mass / total if total > 0 else 0.0
        reduced = carrier.mass * share
        carrier.inertia = np.asarray(carrier.inertia, dtype=float) + inertia + reduced * (d @ d * np.eye(3) - np.outer(d, d))
        carrier.com = np.asarray(carrier.com) - share * d
        carrier.mass = total

    def _add_geom(self, g: int) -> None:
        m, kind, frame = self.m, self.m.geom_type[g], self._body_names[self.m.geom_bodyid[g]]
        X, size = _placement(m.geom_quat[g], m.geom_pos[g]), m.geom_size[g]
        color = (m.mat_rgba[m.geom_matid[g]] if m.geom_matid[g] >= 0 else m.geom_rgba[g]).astype(float)
        self.shapes += [Shape(frame, word, X @ offset, scale, color, mesh) for word, offset, scale, mesh in _looks(m, g)]
        if not (m.geom_contype[g] or m.geom_conaffinity[g]):
            return
        points = list(_touching(kind, size))
        if not points:
            self.untouchable[_GEOM(int(kind)).name.removeprefix("mjGEOM_").lower()] += 1
        name = self._name(mj.mjtObj.mjOBJ_GEOM, g) or f"geom_{g}"
        for at, radius in points:
            self.contacts.append(ContactPoint(name, frame, X[:3, :3] @ at + X[:3, 3], radius, float(m.geom_friction[g, 0])))


def _is_single(kind: int) -> bool:
    return int(kind) in (_SLIDE, _HINGE)


def _along(z: float) -> Array:
    X = np.eye(4)
    X[2, 3] = z
    return X


def _looks(m: mj.MjModel, g: int) -> Iterable[tuple[str, Array, Array, Any]]:
    """Kind, place in the geom, scale, mesh of what a geom looks like; nothing for planes and height fields."""
    kind, size, here = m.geom_type[g], m.geom_size[g].astype(float), np.eye(4)
    if kind == _GEOM.mjGEOM_BOX:
        yield "box", here, 2 * size, None
    elif kind == _GEOM.mjGEOM_SPHERE:
        yield "sphere", here, np.full(3, size[0]), None
    elif kind == _GEOM.mjGEOM_ELLIPSOID:
        yield "sphere", here, size, None
    elif kind in (_GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_CAPSULE):
        yield "cylinder", here, np.array([size[0], size[0], 2 * size[1]]), None
        if kind == _GEOM.mjGEOM_CAPSULE:
            for end in (-size[1], size[1]):
                yield "sphere", _along(end), np.full(3, size[0]), None
    elif kind == _GEOM.mjGEOM_MESH and m.geom_dataid[g] >= 0:
        i = m.geom_dataid[g]
        points = m.mesh_vert[m.mesh_vertadr[i] :][: m.mesh_vertnum[i]]
        yield "mesh", here, np.ones(3), (points.astype(float), m.mesh_face[m.mesh_faceadr[i] :][: m.mesh_facenum[i]].astype(np.intp))


def _touching(kind: int, size: Array) -> Iterable[tuple[Array, float]]:
    """Spheres and points of a geom, in its axes; those of dyntape's own reader of collision shapes."""
    if kind == _GEOM.mjGEOM_SPHERE:
        yield np.zeros(3), float(size[0])
    elif kind == _GEOM.mjGEOM_CAPSULE:
        for z in (-size[1], size[1]):
            yield np.array([0, 0, z]), float(size[0])
    elif kind == _GEOM.mjGEOM_BOX:
        for corner in np.ndindex(2, 2, 2):
            yield (2 * np.array(corner) - 1) * size, 0.0
    elif kind == _GEOM.mjGEOM_CYLINDER:
        for angle in np.arange(8) * np.pi / 4:
            for z in (-size[1], size[1]):
                yield np.array([size[0] * np.cos(angle), size[0] * np.sin(angle), z]), 0.0


def _facts_of(m: mj.MjModel) -> dict[str, Array]:
    """Where a state of MuJoCo's has its entries: those of `q` in `qpos`, references, free joints, springs and dampers."""
    order, reference = np.arange(m.nq), np.zeros(m.nq)
    places, stiffness, rest = np.zeros(m.nv, dtype=int), np.zeros(m.nv), np.zeros(m.nv)
    free = []
    for j in range(m.njnt):
        i, k, kind = m.jnt_qposadr[j], m.jnt_dofadr[j], m.jnt_type[j]
        if _is_single(kind):
            reference[i] = m.qpos0[i]
            places[k], stiffness[k], rest[k] = i, m.jnt_stiffness[j], m.qpos_spring[i] - m.qpos0[i]
            continue
        u = i + 3 if kind == _FREE else i
        order[u : u + 4] = [u + 1, u + 2, u + 3, u]
        if kind == _FREE:
            free.append((i, k))
    facts = {"order": order, "reference": reference, "free": np.array(free, dtype=int).reshape(-1, 2), "places": places}
    return {**facts, "stiffness": stiffness, "rest": rest, "damping": np.array(m.dof_damping)}
