# SPDX-License-Identifier: BSD-3-Clause
"""Robots in meshcat, rerun and viser: their shapes, and motions.

    from dyntape.bridges import viewers
    view = viewers.meshcat(robot)                  # or viewers.viser(robot), viewers.rerun(robot)
    view.show(q)
    view.play(motion.t, motion.q)

Each needs its package alone (pip install meshcat, viser or rerun-sdk); the page in 3D that dyntape writes itself needs none.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import ArgumentError, Robot, Shape

Array = NDArray[np.float64]
_GREY = (0.72, 0.74, 0.78, 1.0)


def triangles(shape: Shape) -> tuple[Array, NDArray[np.int32]]:
    """(vertices (n, 3), triangles (m, 3)) of a shape, stretched, in its own axes, m.

    >>> vertices, corners = triangles(dyntape.Shape("tip", "box", np.eye(4), np.array([1.0, 2.0, 4.0])))
    >>> vertices.max(axis=0).tolist(), len(corners)
    ([0.5, 1.0, 2.0], 12)
    """
    points: Any
    corners: Any
    if shape.mesh is not None:
        points, corners = shape.mesh
    elif shape.kind == "box":
        points = np.array(list(np.ndindex(2, 2, 2))) - 0.5
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        corners = np.array([triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))])
    else:
        points, corners = _turned([(0, -0.5), (1, -0.5), (1, 0.5), (0, 0.5)] if shape.kind == "cylinder" else _half_circle(16))
    if np.prod(shape.scale) < 0:
        corners = np.asarray(corners)[:, ::-1]
    return np.asarray(points) * shape.scale, np.asarray(corners, dtype=np.int32)


def _half_circle(n: int) -> list[tuple[float, float]]:
    return [(np.sin(angle), -np.cos(angle)) for angle in np.linspace(0, np.pi, n)]


def _turned(profile: list[tuple[float, float]], n: int = 32) -> tuple[Array, NDArray[np.int32]]:
    """The surface that a profile of (radius, z), upwards, sweeps about z."""
    around = 2 * np.pi * np.arange(n) / n
    points = np.array([(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in around])
    corners = []
    for row in range(len(profile) - 1):
        for k in range(n):
            a, b = row * n + k, row * n + (k + 1) % n
            corners += [(a, b, b + n), (a, b + n, a + n)]
    return points, np.array(corners, dtype=np.int32)


class View:
    """A robot in a viewer: made by `meshcat`, `rerun` or `viser`.

    scene: the viewer's own object, to which more can be added.
    """

    scene: Any

    def __init__(self, robot: Robot, name: str) -> None:
        self.robot, self.name = robot, name or robot.name or "robot"
        self.shapes = robot.shapes()
        self.frames = list(dict.fromkeys(shape.frame for shape in self.shapes))
        if not self.frames:
            raise ArgumentError(f'viewers: the robot "{robot.name}" has no shapes to show')
        for k, shape in enumerate(self.shapes):
            color = tuple(shape.color) if shape.color is not None else _GREY
            self._add(f"{self._path(shape.frame)}/{shape.kind}_{k}", shape, *triangles(shape), color)
        self.show(robot.neutral())

    def show(self, q: ArrayLike) -> None:
        """Moves the robot to q (nq,)."""
        for frame, X in self._placements(np.asarray(q, dtype=float)).items():
            self._place(self._path(frame), X)

    def play(self, t: ArrayLike, q: ArrayLike, *, speed: float = 1.0) -> None:
        """A motion: times t (samples,), s, and configurations q (samples, nq).

        In rerun it is on the timeline "time", in meshcat an animation that the page plays; viser is moved along in real time.
        speed: so many times quicker.

        Raises ArgumentError for shapes that do not fit each other.
        """
        times, states = np.asarray(t, dtype=float), np.asarray(q, dtype=float)
        if times.ndim != 1 or states.shape != (len(times), self.robot.nq):
            raise ArgumentError(f"viewers: expected t (samples,) and q (samples, {self.robot.nq}), got {times.shape} and {states.shape}")
        if not len(times) or not speed > 0:
            raise ArgumentError("viewers: expected one sample at least, and a speed above zero")
        self._play((times - times[0]) / speed, self._placements(states))

    def _path(self, frame: str) -> str:
        return f"{self.name}/{frame.replace('/', '_')}"

    def _placements(self, q: Array) -> dict[str, Array]:
        """(..., 4, 4) of each frame in the world."""
        found = {}
        for frame in self.frames:
            placed = self.robot.frame_placement(q, frame=frame)
            X = np.zeros((*q.shape[:-1], 4, 4))
            X[..., :3, :3], X[..., :3, 3], X[..., 3, 3] = placed.R, placed.p, 1
            found[frame] = X
        return found

    def _play(self, t: Array, placements: dict[str, Array]) -> None:
        begin = time.perf_counter()
        for k, moment in enumerate(t):
            time.sleep(max(0.0, begin + moment - time.perf_counter()))
            for frame, X in placements.items():
                self._place(self._path(frame), X[k])

    def _add(self, path: str, shape: Shape, points: Array, corners: NDArray[np.int32], color: Any) -> None:
        raise NotImplementedError

    def _place(self, path: str, X: Array) -> None:
        raise NotImplementedError


def _missing(package: str, install: str) -> ArgumentError:
    return ArgumentError(f"viewers: {package} is not installed here: pip install {install}")


def meshcat(robot: Robot, *, scene: Any = None, name: str = "") -> View:
    """The robot in meshcat, a page in the browser: view.scene.url(), or in a notebook view.scene.jupyter_cell().

    scene: a meshcat.Visualizer; None: a new one.  name: of the robot among others.
    """
    try:
        import meshcat as library  # type: ignore[import-not-found, import-untyped, unused-ignore]
        from meshcat import animation, geometry
    except ModuleNotFoundError:
        raise _missing("meshcat", "meshcat") from None

    class Meshcat(View):
        def _add(self, path: str, shape: Shape, points: Array, corners: NDArray[np.int32], color: Any) -> None:
            rgb = [int(round(255 * part)) for part in color[:3]]
            material = geometry.MeshLambertMaterial(color=rgb[0] << 16 | rgb[1] << 8 | rgb[2], opacity=float(color[3]))
            material.transparent = color[3] < 1
            self.scene[path].set_object(geometry.TriangularMeshGeometry(points.astype(np.float32), corners.astype(np.uint32)), material)
            self.scene[path].set_transform(shape.placement)

        def _place(self, path: str, X: Array) -> None:
            self.scene[path].set_transform(X)

        def _play(self, t: Array, placements: dict[str, Array]) -> None:
            rate = 60
            motion = animation.Animation(default_framerate=rate)
            last = -1
            for k, moment in enumerate(t):
                if (at := int(round(rate * moment))) == last and k < len(t) - 1:
                    continue
                last = at
                for frame, X in placements.items():
                    with motion.at_frame(self.scene, at) as scene:
                        scene[self._path(frame)].set_transform(X[k])
            self.scene.set_animation(motion)

    Meshcat.scene = scene if scene is not None else library.Visualizer()
    return Meshcat(robot, name)


def rerun(robot: Robot, *, scene: Any = None, name: str = "") -> View:
    """The robot in rerun: to be sent where the recording goes (rr.spawn(), rr.save("motion.rrd"), a notebook).

    scene: a rerun.RecordingStream; None: the one that rr.init has made, or a new one.  name: of the robot among others.
    """
    try:
        import rerun as library  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except ModuleNotFoundError:
        raise _missing("rerun", "rerun-sdk") from None

    class Rerun(View):
        def _add(self, path: str, shape: Shape, points: Array, corners: NDArray[np.int32], color: Any) -> None:
            rgba = [int(round(255 * part)) for part in color]
            mesh = library.Mesh3D(vertex_positions=points, triangle_indices=corners, albedo_factor=rgba)
            library.log(path, mesh, self._transform(shape.placement), static=True, recording=self.scene)

        def _transform(self, X: Array) -> Any:
            return library.Transform3D(translation=X[:3, 3], mat3x3=X[:3, :3])

        def _place(self, path: str, X: Array) -> None:
            library.log(path, self._transform(X), recording=self.scene)

        def _play(self, t: Array, placements: dict[str, Array]) -> None:
            for k, moment in enumerate(t):
                library.set_time("time", duration=float(moment), recording=self.scene)
                for frame, X in placements.items():
                    self._place(self._path(frame), X[k])

    if scene is None:
        scene = library.get_global_data_recording()
    if scene is None:
        library.init("dyntape")
        scene = library.get_global_data_recording()
    Rerun.scene = scene
    return Rerun(robot, name)


def viser(robot: Robot, *, scene: Any = None, name: str = "") -> View:
    """The robot in viser, a page in the browser, which says where it is when it starts.

    scene: a viser.ViserServer; None: a new one.  name: of the robot among others.
    """
    try:
        import viser as library  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except ModuleNotFoundError:
        raise _missing("viser", "viser") from None
    from viser import transforms  # type: ignore[import-not-found, import-untyped, unused-ignore]

    class Viser(View):
        def _wxyz(self, X: Array) -> Any:
            return transforms.SO3.from_matrix(X[:3, :3]).wxyz

        def _add(self, path: str, shape: Shape, points: Array, corners: NDArray[np.int32], color: Any) -> None:
            X = shape.placement
            rgb = tuple(int(round(255 * part)) for part in color[:3])
            opacity = float(color[3]) if color[3] < 1 else None
            self.scene.scene.add_mesh_simple(
                "/" + path, points.astype(np.float32), corners.astype(np.uint32), color=rgb, opacity=opacity, wxyz=self._wxyz(X), position=X[:3, 3]
            )

        def _place(self, path: str, X: Array) -> None:
            handles = self.__dict__.setdefault("handles", {})
            if path not in handles:
                handles[path] = self.scene.scene.add_frame("/" + path, show_axes=False)
            handles[path].wxyz, handles[path].position = self._wxyz(X), X[:3, 3]

    Viser.scene = scene if scene is not None else library.ViserServer()
    return Viser(robot, name)
