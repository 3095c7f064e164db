#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Forward dynamics of a Panda in JAX, its gradient by jit(vmap(grad)): dyntape's bridge beside the recursion written in JAX.

    jax_peer.py [STATES]      PYTHONPATH with dyntape and jax; by default 4096 states

The recursion is R. Featherstone's, Rigid Body Dynamics Algorithms, 2008 (chapter 7: articulated bodies), in body frames, angular part
first, unrolled over the joints; XLA compiles it.  Its robot is read from the same URDF file.  Both are checked against each other.
"""
import pathlib
import sys
import time
import xml.etree.ElementTree as ET

import jax
import jax.numpy as jnp
import numpy as np

import dyntape
from dyntape.bridges import jax as dj

jax.config.update("jax_enable_x64", True)
FILE = pathlib.Path(__file__).resolve().parents[3] / "config" / "robots" / "panda.urdf"
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rotation(rpy):
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]]) @ \
        np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


def pose(element):
    origin = element.find("origin") if element is not None else None
    read = lambda key: np.array([float(x) for x in (origin.get(key) if origin is not None and origin.get(key) else "0 0 0").split()])
    return rotation(read("rpy")), read("xyz")


def inertia_of(link):
    """(6, 6) about the link's origin."""
    inertial = link.find("inertial")
    if inertial is None:
        return np.zeros((6, 6))
    R, c = pose(inertial)
    m = float(inertial.find("mass").get("value"))
    entries = {key: float(value) for key, value in inertial.find("inertia").attrib.items()}
    about = np.array([[entries["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    h = m * skew(c)
    return np.block([[R @ about @ R.T - m * skew(c) @ skew(c), h], [h.T, m * np.eye(3)]])


def motion(R, p):
    """(6, 6) motions of the parent as the child, which stands at R, p in it, sees them."""
    return np.block([[R.T, np.zeros((3, 3))], [-R.T @ skew(p), R.T]])


def chain():
    """Of each revolute joint its parent, placement, axis, and the inertia it carries; what is fixed is merged."""
    urdf = ET.parse(FILE).getroot()
    links = {link.get("name"): link for link in urdf.findall("link")}
    bodies, place = [], {}

    def add(name, body, R, p):
        if body >= 0:
            X = motion(R, p)
            bodies[body]["inertia"] += X.T @ inertia_of(links[name]) @ X
        for joint in urdf.findall("joint"):
            if joint.find("parent").get("link") != name:
                continue
            Rj, pj = pose(joint)
            Rj, pj, child = R @ Rj, p + R @ pj, joint.find("child").get("link")
            if joint.get("type") == "revolute":
                axis = np.array([float(x) for x in joint.find("axis").get("xyz").split()])
                bodies.append({"parent": body, "R": Rj, "p": pj, "axis": axis, "inertia": np.zeros((6, 6))})
                add(child, len(bodies) - 1, np.eye(3), np.zeros(3))
            else:
                add(child, body, Rj, pj)

    add((set(links) - {joint.find("child").get("link") for joint in urdf.findall("joint")}).pop(), -1, np.eye(3), np.zeros(3))
    return bodies


BODIES = chain()


def cross_motion(a):
    w, l = hat(a[:3]), hat(a[3:])
    return jnp.block([[w, jnp.zeros((3, 3))], [l, w]])


def hat(a):
    return jnp.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def aba(q, v, tau):
    X, S, V, c, inertia, bias = [], [], [], [], [], []
    for i, body in enumerate(BODIES):
        turn = skew(body["axis"])
        E = (jnp.eye(3) + jnp.sin(q[i]) * turn + (1 - jnp.cos(q[i])) * turn @ turn).T
        zero = jnp.zeros((3, 3))
        X.append(jnp.block([[E, zero], [zero, E]]) @ motion(body["R"], body["p"]))
        S.append(np.concatenate([body["axis"], np.zeros(3)]))
        own = S[i] * v[i]
        V.append(own + (X[i] @ V[body["parent"]] if body["parent"] >= 0 else 0))
        c.append(cross_motion(V[i]) @ own)
        inertia.append(body["inertia"])
        bias.append(-cross_motion(V[i]).T @ (body["inertia"] @ V[i]))
    U, D, u = {}, {}, {}
    for i in reversed(range(len(BODIES))):
        U[i] = inertia[i] @ S[i]
        D[i], u[i] = S[i] @ U[i], tau[i] - S[i] @ bias[i]
        if (k := BODIES[i]["parent"]) >= 0:
            left = inertia[i] - jnp.outer(U[i], U[i]) / D[i]
            pushed = bias[i] + left @ c[i] + U[i] * u[i] / D[i]
            inertia[k] = inertia[k] + X[i].T @ left @ X[i]
            bias[k] = bias[k] + X[i].T @ pushed
    a, result = [], []
    for i, body in enumerate(BODIES):
        up = X[i] @ (a[body["parent"]] if body["parent"] >= 0 else np.array([0, 0, 0, 0, 0, 9.81])) + c[i]
        result.append((u[i] - U[i] @ up) / D[i])
        a.append(up + S[i] * result[i])
    return jnp.stack(result)


def seconds(f, *arguments):
    """Median of several calls, the first left out."""
    jax.block_until_ready(f(*arguments))
    times = []
    while len(times) < 7 or (sum(times) < 2 and len(times) < 100):
        start = time.perf_counter()
        jax.block_until_ready(f(*arguments))
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
    robot = dyntape.load(FILE, lock=FINGERS)
    random = np.random.default_rng(1)
    state = tuple(map(jnp.asarray, (robot.random(count), random.normal(size=(count, 7)), random.normal(size=(count, 7)))))
    results = {}
    for name, f in {"dyntape": dj.function(robot, "aba"), "jax": aba}.items():
        start = time.perf_counter()
        gradient = jax.jit(jax.vmap(jax.grad(lambda q, v, tau, f=f: f(q, v, tau).sum(), argnums=(0, 1, 2))))
        results[name] = jax.block_until_ready(gradient(*state))
        made = time.perf_counter() - start
        print(f"{name:8} {seconds(gradient, *state) * 1e3:8.2f} ms for {count} gradients; {made:.1f} s until the first", flush=True)
    scale = max(float(abs(x).max()) for x in results["jax"])
    off = max(float(abs(x - y).max()) for x, y in zip(results["dyntape"], results["jax"]))
    print(f"largest difference {off / scale:.1e} of the largest entry")


if __name__ == "__main__":
    main()
