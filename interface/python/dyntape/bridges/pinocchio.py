# SPDX-License-Identifier: BSD-3-Clause
"""Robots from Pinocchio's models, with the same states: q, v, a and tau go from one to the other as they are.

    from dyntape.bridges import pinocchio as dp
    robot = dp.load(pinocchio.buildSampleModelHumanoid())
    robot.aba(q, v, tau)                               # as pinocchio.aba(model, data, q, v, tau)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin  # type: ignore[import-not-found, import-untyped, unused-ignore]

from .. import ArgumentError, Body, Robot, assemble

# By the name of Pinocchio's joint, without X, Y, Z and what says that the axis is another.
_TYPES = {
    "R": "revolute",
    "Revolute": "revolute",
    "RUB": "continuous",
    "RevoluteUnbounded": "continuous",
    "P": "prismatic",
    "Prismatic": "prismatic",
    "H": "helical",
    "Helical": "helical",
    "Spherical": "spherical",
    "Planar": "planar",
    "FreeFlyer": "free-flyer",
}
_SINGLE = ("revolute", "continuous", "prismatic", "helical")
# Joints whose velocities are rates of their positions: one after the other, about or along these axes.
_CHAINS = {"Translation": "xyz", "SphericalZYX": "ZYX"}
_AXES = dict(zip("xyz", np.eye(3)))


def load(model: Any) -> Robot:
    """A robot from a pinocchio.Model, with its q, v, a and tau: the same entries in the same order and frames.

    Joints of all types but mimicking and ellipsoid ones; composite ones, translations, universal and Euler-angle joints become
    a joint an axis, called NAME_1, NAME_2 and so on.  Inertias, frames, limits, armature, gravity; damping and friction act where an
    effect asks for them.  What has no counterpart is in robot.left_out, a sentence each.

    Raises ArgumentError for a joint that dyntape has not, and for a model without joints.

    >>> arm = load(pin.buildSampleModelManipulator())
    >>> arm.nq, arm.joints[0]
    (6, 'shoulder1_joint')
    """
    if not isinstance(model, pin.Model):
        raise ArgumentError(f"pinocchio: expected a pinocchio.Model, got {type(model).__name__}")
    bodies: list[Body] = []
    left_out: list[str] = []
    last: list[str | None] = [None]  # of each joint of Pinocchio's, the joint here that carries its body
    for i in range(1, model.njoints):
        joint = model.joints[i]
        chain = _chain(joint, str(model.names[i]))
        if not chain:
            raise ArgumentError(f'pinocchio: joint "{model.names[i]}": dyntape has no {joint.shortname()}')
        chain[0].parent = last[model.parents[i]]
        placement = model.jointPlacements[i] * pin.SE3(np.asarray(chain[0].rotation), np.asarray(chain[0].position))
        chain[0].rotation, chain[0].position = placement.rotation, placement.translation
        for body, link in zip(chain[1:], chain):
            body.parent = link.joint
        inertia = model.inertias[i]
        chain[-1].mass, chain[-1].com, chain[-1].inertia = float(inertia.mass), inertia.lever, inertia.inertia
        left_out += _set_numbers(model, joint, chain)
        bodies += chain
        last.append(chain[-1].joint)
    frames: dict[str, tuple[str | None, Any, Any]] = {}
    for frame in sorted(model.frames, key=lambda frame: frame.type != pin.FrameType.BODY):  # links first, as here
        parent = last[frame.parentJoint if hasattr(frame, "parentJoint") else frame.parent]
        frames.setdefault(str(frame.name), (parent, frame.placement.rotation, frame.placement.translation))
    return assemble(str(model.name), bodies, frames=frames, gravity=model.gravity.linear, left_out=left_out)


def _chain(joint: Any, name: str) -> list[Body]:
    """The joints here that one of Pinocchio's is, placed in its own fixed side; none: there are none."""
    kind = joint.shortname().removeprefix("JointModel").removesuffix("Tpl")
    if kind == "Composite":
        return _composite(joint.extract(), name)
    if kind in _CHAINS:
        return [_about(f"{name}_{k + 1}", axis) for k, axis in enumerate(_CHAINS[kind])]
    if kind == "Universal":
        whole = joint.extract()
        axes = (whole.axis1, whole.axis2)
        return [Body(f"{name}_{k + 1}", axis=np.array(axis).ravel()) for k, axis in enumerate(axes)]
    plain = kind.removesuffix("Unaligned")
    type_ = _TYPES.get(plain) or (_TYPES.get(plain[:-1]) if plain[-1:] in "XYZ" else None)
    if type_ is None:
        return []
    body = Body(name, type_)
    if type_ in _SINGLE:
        linear, angular = np.split(_columns(joint), 2)
        body.axis = linear if type_ == "prismatic" else angular
        if type_ == "helical":
            body.pitch = float(linear @ angular)
    return [body]


def _about(name: str, axis: str) -> Body:
    return Body(name, "revolute" if axis.isupper() else "prismatic", axis=_AXES[axis.lower()])


def _columns(joint: Any) -> Any:
    """(6,) the motion of a joint with one axis: linear, angular."""
    data = joint.createData()
    q = np.zeros(joint.nq)
    q[0] = joint.nq == 2  # (cos, sin)
    joint.calc(data, q)
    return np.asarray(data.S).reshape(6)


def _composite(joint: Any, name: str) -> list[Body]:
    bodies: list[Body] = []
    for placement, part in zip(joint.jointPlacements, joint.joints):
        chain = _chain(part, f"{name}_{len(bodies) + 1}")
        if not chain:
            return []
        at = placement * pin.SE3(np.asarray(chain[0].rotation), np.asarray(chain[0].position))
        chain[0].rotation, chain[0].position = at.rotation, at.translation
        bodies += chain
    for k, body in enumerate(bodies):
        body.joint = f"{name}_{k + 1}"
    return bodies


def _set_numbers(model: Any, joint: Any, chain: list[Body]) -> Iterator[str]:
    """Limits, armature, damping and friction of each axis; yields what has no place."""
    armature = np.asarray(model.armature)
    damping, friction = np.asarray(model.damping), np.asarray(_either(model, "upperDryFrictionLimit", "friction"))
    speed, effort = _either(model, "upperVelocityLimit", "velocityLimit"), _either(model, "upperEffortLimit", "effortLimit")
    i, k = joint.idx_q, joint.idx_v
    for body in chain:
        n = {"spherical": (4, 3), "planar": (4, 3), "free-flyer": (7, 6), "continuous": (2, 1)}.get(body.type, (1, 1))
        if body.type in _SINGLE:
            body.armature, body.damping, body.friction = float(armature[k]), float(damping[k]), float(friction[k])
            body.velocity, body.effort = _limit(speed[k]), _limit(effort[k])
            if n[0] == 1:
                lower, upper = float(model.lowerPositionLimit[i]), float(model.upperPositionLimit[i])
                body.lower, body.upper = -_limit(-lower), _limit(upper)
        elif armature[k : k + n[1]].any():
            yield f'armature of joint "{body.joint}", which has several axes'
        i, k = i + n[0], k + n[1]


def _either(model: Any, name: str, before: str) -> Any:
    """An attribute, or as versions before called it."""
    return getattr(model, name) if hasattr(model, name) else getattr(model, before)


def _limit(number: float) -> float:
    return float("inf") if number >= np.finfo(float).max else float(number)
