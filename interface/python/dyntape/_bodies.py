# SPDX-License-Identifier: BSD-3-Clause
"""Robots that are given body by body, and what robots look like."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _dyntape
from ._dyntape import ArgumentError, Robot

Array = NDArray[np.float64]


class Shape(NamedTuple):
    """A shape of a robot, a unit shape that is stretched and placed.

    frame: the name of the frame that it moves with.
    kind: "box", edges of 1 m about the origin; "cylinder", radius 1 m, z from -1/2 to 1/2 m; "sphere", radius 1 m; "mesh".
    placement: (4, 4) of the shape in that frame: rotation, and position in m.
    scale: (3,) what it is stretched by along its axes before it is placed.
    color: (4,) red, green, blue and opacity of 0 to 1, or None.
    mesh: (vertices (n, 3), triangles (m, 3)) of a mesh, else None.
    """

    frame: str
    kind: str
    placement: Array
    scale: Array
    color: Array | None = None
    mesh: tuple[Array, NDArray[np.intp]] | None = None


def _zeros() -> Array:
    return np.zeros(3)


def _up() -> Array:
    return np.array([0.0, 0.0, 1.0])


@dataclass
class Body:
    """A rigid body and the joint that carries it.  Units: kg, m, rad, s, N, N m.

    joint: the joint's name.  type: "revolute", "continuous" (q: cos, sin), "prismatic", "helical", "spherical" (q: quaternion
        x y z w), "planar" or "free-flyer" (q: position, quaternion; v: linear, angular in the body's frame).
    parent: the name of the joint that carries the body before it, None: the world.
    rotation (3, 3), position (3,): the joint's fixed side in the frame of the parent's joint.
    axis: (3,) of unit length, in the joint's frame, which at zero is the fixed side's.
    mass; com: (3,) centre of mass; inertia: (3, 3) about it; all in the joint's moving frame, the frame of the body.
    lower, upper, velocity, effort: limits.  armature: rotor inertia seen at the joint, of joints with one axis.
    damping, friction: act where an effect asks for them.  pitch: m/rad, of a helical joint.

    >>> dyntape.Body("hinge", axis=[0, 1, 0], mass=2.0, com=[0, 0, -0.5]).type
    'revolute'
    """

    joint: str
    type: str = "revolute"
    parent: str | None = None
    rotation: ArrayLike = field(default_factory=lambda: np.eye(3))
    position: ArrayLike = field(default_factory=_zeros)
    axis: ArrayLike = field(default_factory=_up)
    mass: float = 0.0
    com: ArrayLike = field(default_factory=_zeros)
    inertia: ArrayLike = field(default_factory=lambda: np.zeros((3, 3)))
    lower: float = -math.inf
    upper: float = math.inf
    velocity: float = math.inf
    effort: float = math.inf
    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    pitch: float = 0.0


def assemble(
    name: str,
    bodies: Sequence[Body],
    *,
    frames: Mapping[str, tuple[str | None, ArrayLike, ArrayLike]] | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    left_out: Iterable[str] = (),
    shapes: Iterable[Shape] = (),
    contacts: Iterable[tuple[str, ArrayLike, float]] = (),
) -> Robot:
    """A robot of bodies, in the place of a file; q, v and tau are in their order.

    bodies: a parent comes before its children.
    frames: named places, by the joint that carries them (None: the world), rotation (3, 3) and position (3,) in its frame;
        by default each body's own, called as its joint.
    gravity: (3,) acceleration of free fall, m/s^2.  left_out: becomes robot.left_out.  shapes: what it looks like.
    contacts: spheres, or points of radius 0, in which it may touch: frame, centre (3,) in that frame, radius, m; for scenes with
        `shapes collision` (Scene.from_text).

    Raises ArgumentError, naming the joint or frame, for what is no robot.

    >>> arm = dyntape.assemble("arm", [dyntape.Body("hinge", axis=[0, -1, 0], mass=1.0, com=[0, 0, -1])])
    >>> arm.aba([np.pi / 2], [0.0], [0.0])
    array([-9.81])
    """
    given = state_of(name, bodies, frames=frames, gravity=gravity, left_out=left_out, shapes=shapes, contacts=contacts)
    return _dyntape.assembled(given)


def state_of(
    name: str,
    bodies: Sequence[Body],
    *,
    frames: Mapping[str, tuple[str | None, ArrayLike, ArrayLike]] | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    left_out: Iterable[str] = (),
    shapes: Iterable[Shape] = (),
    contacts: Iterable[tuple[str, ArrayLike, float]] = (),
) -> tuple[Any, ...]:
    """What a robot of bodies is pickled as (bridges/bodies.h): Robot.__setstate__ takes it."""
    places: dict[str | None, int] = {None: -1}
    rows = []
    for body in bodies:
        if body.parent not in places:
            raise ArgumentError(f'assemble: joint "{body.joint}" hangs on "{body.parent}", which is no joint before it')
        rows.append((body.joint, body.type, places[body.parent], _numbers(body)))
        places[body.joint] = len(places) - 1
    placed = dict(frames) if frames is not None else {body.joint: (body.joint, np.eye(3), np.zeros(3)) for body in bodies}
    frame_rows, of_frames = [], {}
    for frame, (joint, rotation, position) in placed.items():
        if joint not in places:
            raise ArgumentError(f'assemble: frame "{frame}" is on "{joint}", which is no joint')
        R, p = _array(rotation, (3, 3), f'frame "{frame}"'), _array(position, (3,), f'frame "{frame}"')
        of_frames[frame] = (places[joint], R, p)
        frame_rows.append((frame, places[joint], [*R.ravel().tolist(), *p.tolist()]))
    shape_rows, meshes = _shape_rows(list(shapes), of_frames)
    touching = []
    for frame, center, radius in contacts:
        if frame not in of_frames:
            raise ArgumentError(f'assemble: a contact is on "{frame}", which is no frame')
        number, R, p = of_frames[frame]
        touching.append((frame, number, (R @ _array(center, (3,), "the centre of a contact") + p).tolist(), float(radius)))
    return name, _array(gravity, (3,), "gravity").tolist(), rows, frame_rows, list(left_out), shape_rows, meshes, touching


def _array(given: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    array = np.asarray(given, dtype=np.float64)
    if array.shape != shape:
        raise ArgumentError(f"assemble: {what}: expected numbers of shape {shape}, got {array.shape}")
    return array


def _numbers(body: Body) -> list[float]:
    """In the order of BodyRow (bridges/bodies.h)."""
    what = f'joint "{body.joint}"'
    parts = [
        _array(body.axis, (3,), what),
        [body.pitch],
        _array(body.rotation, (3, 3), what).ravel(),
        _array(body.position, (3,), what),
        [body.mass],
        _array(body.com, (3,), what),
        _array(body.inertia, (3, 3), what).ravel(),
        [body.lower, body.upper, body.velocity, body.effort, body.armature, body.damping, body.friction],
    ]
    return [float(number) for part in parts for number in part]


def _shape_rows(shapes: list[Shape], frames: Mapping[str, tuple[int, Array, Array]]) -> tuple[list[Any], list[Any]]:
    rows, meshes, numbers = [], [], {}
    for shape in shapes:
        if shape.frame not in frames:
            raise ArgumentError(f'assemble: a shape is on "{shape.frame}", which is no frame')
        joint, R, p = frames[shape.frame]
        placement = _array(shape.placement, (4, 4), "the placement of a shape")
        entries = [*(R @ placement[:3, :3]).ravel(), *(R @ placement[:3, 3] + p), *_array(shape.scale, (3,), "the scale of a shape")]
        mesh = -1
        if shape.mesh is not None:
            mesh = numbers.setdefault(id(shape.mesh), len(meshes))
            if mesh == len(meshes):
                meshes.append((np.ravel(shape.mesh[0]).tolist(), np.ravel(shape.mesh[1]).tolist()))
        color = [] if shape.color is None else np.asarray(shape.color, dtype=float).tolist()
        rows.append((shape.frame, joint, shape.kind, [float(entry) for entry in entries], color, mesh))
    return rows, meshes
