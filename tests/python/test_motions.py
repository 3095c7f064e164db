# SPDX-License-Identifier: BSD-3-Clause
"""Scenes, roll-outs, tasks and problems from Python."""

import copy
import json
import os
import pickle
import shutil
import signal
import threading
import time

import dyntape
import numpy as np
import pytest
from conftest import CONFIG

PENDULUM = CONFIG / "scenes" / "pendulum.info"


def test_a_scene_is_simulated(tmp_path):
    words = []
    motion = dyntape.simulate(PENDULUM, set={"simulation.duration": 0.5, "start.q": [0.3]}, progress=words.append)
    assert motion.success and motion.trouble == ""
    assert motion.t[-1] == 0.5 and motion.q[0, 0] == 0.3 and motion.q.shape == (len(motion.t), 1)
    energy = motion.kinetic + motion.stored
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)
    np.testing.assert_allclose(motion.work["gravity"], motion.kinetic - motion.kinetic[0], atol=1e-8)
    assert words and "simulated" in motion.verdict and "<canvas" in motion.page()
    assert motion._repr_html_().startswith("<iframe srcdoc=") and "<canvas" not in motion._repr_html_()  # escaped
    unwritten = motion.write(tmp_path / "out")
    written = {file.name for file in (tmp_path / "out").iterdir()}
    assert {"motion.csv", "report.json", "motion.html"} <= written or unwritten
    assert json.loads(motion.json)
    with pytest.raises(dyntape.FileError, match="simulation.durration"):
        dyntape.simulate(PENDULUM, set={"simulation.durration": 1})


@pytest.mark.skipif(not shutil.which("gnuplot"), reason="gnuplot draws them")
def test_pictures(tmp_path):
    pictures = dyntape.solve(CONFIG / "tasks" / "block_move.info").plot()
    assert {"trajectory", "motion"} <= set(pictures) and all("<svg" in picture for picture in pictures.values())
    assert all(path.read_text() in pictures._repr_html_() for path in pictures.save(tmp_path))


def test_a_rollout_is_the_simulation():
    scene = dyntape.Scene(PENDULUM, set={"simulation.duration": 0.2})
    motion = scene.simulate()
    x = scene.rollout(np.concatenate([scene.q, scene.v]))
    assert x.shape == (200, 2)
    stride = round(motion.t[1] / scene.step)
    assert np.array_equal(x[stride - 1 :: stride], np.concatenate([motion.q, motion.v], axis=1)[1:])


def test_worlds_do_not_depend_on_each_other(random):
    scene = dyntape.Scene(CONFIG / "scenes" / "quadruped_dropped.info")
    x0 = np.tile(np.concatenate([scene.q, scene.v]), (37, 1))
    x0[:, 2] += random.uniform(0, 0.1, size=37)
    u = random.normal(size=(37, 40, scene.nu))
    x = scene.rollout(x0, u)
    assert x.shape == (37, 40, scene.nx) and np.isfinite(x).all()
    for k in (0, 15, 16, 36):
        assert np.array_equal(scene.rollout(x0[k], u[k]), x[k])
    spoilt = x0.copy()
    spoilt[7, 0] = np.nan
    spoilt[20, -1] = 1e300
    y = scene.rollout(spoilt, u)
    assert np.isnan(y[7]).all() and not np.isfinite(y[20, -1]).all()
    others = np.delete(np.arange(37), [7, 20])
    assert np.array_equal(y[others], x[others])
    assert np.array_equal(scene.rollout(x0, u[0]), np.stack([scene.rollout(one, u[0]) for one in x0]))


def test_jacobians_of_a_rollout():
    scene = dyntape.Scene(PENDULUM)
    x0, u = np.array([[0.4, 0.1], [1.0, -0.5]]), np.full((2, 30, 1), 0.2)
    x, A, B = scene.rollout_jacobians(x0, u)
    assert np.array_equal(x, scene.rollout(x0, u))
    total = np.eye(2)
    for k in range(30):
        total = A[0, k] @ total
    h = 1e-6
    by_differences = np.stack(
        [(scene.rollout(x0 + h * e, u) - scene.rollout(x0 - h * e, u))[0, -1] / (2 * h) for e in np.eye(2)], axis=1
    )
    np.testing.assert_allclose(total, by_differences, atol=1e-8)
    more = u.copy()
    more[:, -1] += h
    np.testing.assert_allclose((scene.rollout(x0, more) - x)[0, -1] / h, B[0, -1, :, 0], atol=1e-6)


def test_rollouts_say_what_they_expect():
    scene = dyntape.Scene(PENDULUM)
    with pytest.raises(dyntape.ArgumentError, match=r"expected x0 of shape \(worlds, 2\) or \(2,\), got \(3,\)"):
        scene.rollout(np.zeros(3))
    with pytest.raises(dyntape.ArgumentError, match=r"expected u of shape \(worlds, steps, 1\)"):
        scene.rollout(np.zeros(2), np.zeros((4, 3)))
    with pytest.raises(dyntape.ArgumentError, match="x0 is of 3 worlds, and u of 2"):
        scene.rollout(np.zeros((3, 2)), np.zeros((2, 5, 1)))
    rigid = dyntape.Scene(CONFIG / "scenes" / "rigid_bounce.info")
    with pytest.raises(dyntape.ArgumentError, match="rigid contacts or hard limits, whose impacts have no derivatives"):
        rigid.rollout_jacobians(np.zeros(13))
    with pytest.raises(dyntape.ArgumentError, match="the contact at 'ball' is 0.1 m below its ground"):
        rigid.rollout([0, 0, 0, 0, 0, 0, 1] + 6 * [0], steps=3)
    assert scene.rollout(np.zeros((0, 2)), np.zeros((5, 1))).shape == (0, 5, 2)
    assert scene.rollout(np.zeros((3, 2)), np.zeros((3, 0, 1))).shape == (3, 0, 2)


def test_a_task_is_solved(tmp_path):
    task = dyntape.Task(CONFIG / "tasks" / "block_move.info")
    solution = task.solve()
    assert solution.success and solution.verdict
    assert solution.q.shape == (len(solution.t), 1) and solution.tau.shape[0] == len(solution.t)
    solution.write(tmp_path)
    assert (tmp_path / "trajectory.csv").exists() and (tmp_path / "motion.html").read_text() == solution.page()
    coarse = dyntape.solve(CONFIG / "tasks" / "block_move.info", set={"horizon.intervals": 4, "verify.max_refinements": 0})
    assert len(coarse.t) < len(solution.t) or coarse.cost != solution.cost
    with pytest.raises(dyntape.FileError, match="horizon.intervals"):
        dyntape.solve(CONFIG / "tasks" / "block_move.info", set={"horizon.intervals": -3})


def test_a_problem_of_ones_own():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_squares("effort", lambda s: s.u)
    p.start, p.goal = [0, 0], [1, 0]
    s = p.solve(10)
    assert s.success and abs(s.cost - 12) < 1e-9
    np.testing.assert_allclose(s.u[:, 0], 6 - 12 * s.t, atol=1e-7)
    p.add_inequality("slow", lambda s: s.x[1], upper=1.2)
    s = p.solve(20)
    assert s.success and s.x[:, 1].max() < 1.2 + 1e-6 and s.cost > 12.1


def test_a_guess():
    def swing_up():
        p = dyntape.Problem("swing", ["th", "w"], ["u"], 3.0, lambda s: [s.x[1], s.u[0] - 9.81 * np.sin(s.x[0])])
        p.add_effort()
        p.start, p.goal = [0, 0], [np.pi, 0]
        return p

    p = swing_up()
    first = p.solve(30)
    p.guess(first.x, first.u, t=first.t)
    again = p.solve(30)
    assert again.success and again.iterations < first.iterations / 2 and abs(again.cost - first.cost) < 1e-6
    p.guess([1.0, 0.0], [2.0])
    assert p.solve(30).iterations > 0
    with pytest.raises(dyntape.ArgumentError, match=r"guess: x: expected shape \(2,\), got \(3,\)"):
        p.guess([1, 2, 3])
    with pytest.raises(dyntape.ArgumentError, match=r"guess: u: expected shape \(times, 1\)"):
        p.guess(first.x, first.u[:, 0], t=first.t)


def test_a_problem_of_a_scene(capfd):
    """Effects and driven joints of the file act in it."""
    scene = dyntape.Scene(CONFIG / "scenes" / "pendulum.info", set={"effects.joint_damping": 0.5})
    p = scene.problem(1.0)
    p.add_effort()
    p.end_at([0.5])
    s = p.solve(20, progress=True)
    assert s.success and "iteration" in capfd.readouterr().err and "<canvas" in s.page()
    assert s.q[0, 0] == scene.q[0]
    free = dyntape.Scene(CONFIG / "scenes" / "pendulum.info").problem(1.0)
    free.add_effort()
    free.end_at([0.5])
    assert free.solve(20).cost != s.cost


def test_a_sweep(tmp_path):
    columns = dyntape.sweep(CONFIG / "sweeps" / "pendulum_amplitudes.info", tmp_path / "out")
    assert len({len(column) for column in columns.values()}) == 1 and (tmp_path / "out" / "sweep.csv").exists()
    again = dyntape.sweep(CONFIG / "sweeps" / "pendulum_amplitudes.info", tmp_path / "out")
    assert all(np.array_equal(again[name], column, equal_nan=True) for name, column in columns.items())


def test_terms_of_python_on_a_robot():
    """A cost of one's own on a robot, with the dynamics in it and exact derivatives of both orders."""
    arm = dyntape.load(CONFIG / "robots" / "ur5.urdf", continuous="angle")
    p = arm.problem(1.5, form="inverse")
    p.start_at(np.zeros(6))
    p.end_at([0.6, -0.4, 0.5, 0.1, 0.2, 0.0])
    p.add_accelerations(1e-2)
    p.add_cost("torques", lambda s: (arm.rnea(s.q, s.v, s.a) ** 2).sum() * 1e-3)
    p.add_cost("end speed", lambda s: s.v @ s.v, where="end")
    p.add_equality("via", lambda s: s.q[0] - 0.35, where=0.5)
    s = p.solve(24)
    assert s.converged, s.verdict
    middle = np.argmin(abs(s.t - 0.75))
    assert abs(s.q[middle, 0] - 0.35) < 1e-7
    assert "torques" in repr(p) and "<canvas" in s.page()


def test_a_pose_behind_an_obstacle():
    arm = dyntape.load(CONFIG / "robots" / "ur5.urdf", continuous="angle")
    p = arm.problem(2, form="inverse")
    p.add_accelerations()
    p.add_equality("place", p.frame_error("tool0", [0.4, 0.4, 0.3]), where="end")
    p.keep_clear(("hand", "tool0", [0, 0, 0], 0.08), ("post", [0.6, 0.1, 0], [0.6, 0.1, 0.8], 0.05))
    p.limit_positions()
    p.limit_efforts()
    p.start_at([-0.8, -1.2, 1.4, -0.6, 0.9, 0.2])
    p.end_at()
    p.guess_towards(p.inverse_kinematics("tool0", [0.4, 0.4, 0.3]))
    s = p.solve()
    assert s.success, s.verdict
    np.testing.assert_allclose(arm.frame_placement(s.q[-1], frame="tool0").p, [0.4, 0.4, 0.3], atol=1e-6)
    hand = arm.frame_placement(s.q, frame="tool0").p
    assert (np.hypot(hand[:, 0] - 0.6, hand[:, 1] - 0.1) > 0.13 - 1e-6).all()


def test_a_term_that_branches_is_refused():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    with pytest.raises(dyntape.RecordingError, match="test_motions.py"):
        p.add_cost("kink", lambda s: s.u[0] if s.u[0] > 0 else -s.u[0])
    p.add_cost("smooth", lambda s: dyntape.where(s.u[0] > 0, s.u[0], -s.u[0]))
    with pytest.raises(dyntape.ArgumentError, match="where: expected"):
        p.add_cost("late", lambda s: s.u[0], where="later")
    with pytest.raises(dyntape.ArgumentError, match="only for a robot's problem"):
        p.limit_positions()
    with pytest.raises(dyntape.ArgumentError, match=r"start: expected an array of shape \(2,\), got \(3,\)"):
        p.start = [0, 0, 0]


def test_ctrl_c_ends_a_simulation():
    scene = dyntape.Scene(CONFIG / "scenes" / "quadruped_dropped.info", set={"simulation.duration": 3000})
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        scene.simulate()
    assert time.monotonic() - begin < 20


def test_a_gradient_of_a_rollout(random):
    scene = dyntape.Scene(PENDULUM)
    x0, u = np.array([[0.4, 0.1], [1.0, -0.5], [2.0, 0.3]]), random.normal(size=(3, 25, 1))
    w = random.normal(size=(3, 25, 2))
    x, by_x0, by_u = scene.rollout_gradient(x0, u, w)
    assert np.array_equal(x, scene.rollout(x0, u)) and by_x0.shape == (3, 2) and by_u.shape == u.shape
    cost = lambda x0, u: (w * scene.rollout(x0, u)).sum(axis=(1, 2))
    h = 1e-6
    for k in range(2):
        step = h * np.eye(2)[k]
        np.testing.assert_allclose((cost(x0 + step, u) - cost(x0 - step, u)) / (2 * h), by_x0[:, k], atol=1e-7)
    for k in (0, 12, 24):
        step = np.zeros_like(u)
        step[:, k] = h
        np.testing.assert_allclose((cost(x0, u + step) - cost(x0, u - step)) / (2 * h), by_u[:, k, 0], atol=1e-7)
    alone = scene.rollout_gradient(x0[1], u[1], w[1])
    assert np.array_equal(alone[1], by_x0[1]) and np.array_equal(alone[2], by_u[1])
    with pytest.raises(dyntape.ArgumentError, match=r"weights: expected an array of shape \(3, 25, 2\)"):
        scene.rollout_gradient(x0, u, w[:2])


def lifting():
    """An arm of one joint with a load at its end, 0.4 m from the joint, that follows a reference."""

    def rate(s):
        m = s["load"][0]
        return [s.x[1], (s.u[0] - m * 9.81 * 0.4 * np.cos(s.x[0])) / (m * 0.4 * 0.4)]

    p = dyntape.Problem("lift", ["angle", "rate"], ["torque"], 1.0, rate, parameters={"load": 1.0})
    t = np.linspace(0, 20, 400)
    p.add_parameter("reference", 0.5 * np.sin(t), times=t)
    p.add_squares("near", lambda s: 10 * (s.x[:1] - s["reference"]))
    p.add_squares("calm", lambda s: 0.02 * s.u)
    p.start = [0, 0]
    p.bound_controls(-15, 15)
    return p


def test_a_controller():
    """The plan is followed; a heavier load is answered once the controller is told."""
    mpc = dyntape.Mpc(lifting(), iterations=1)
    x, t, h, off = np.zeros(2), 0.0, 0.05, []
    mpc.set_parameter("load", 1.5)
    for k in range(120):
        step = mpc.step(t, x)
        assert step.usable, step
        for i in range(50):  # the plant: a load of 1.5 kg
            torque = step.control(t + i * h / 50)[0]
            x = x + h / 50 * np.array([x[1], (torque - 1.5 * 9.81 * 0.4 * np.cos(x[0])) / (1.5 * 0.16)])
        t += h
        off.append(abs(x[0] - 0.5 * np.sin(t)))
    assert max(off[60:]) < 0.02
    with pytest.raises(dyntape.ArgumentError, match="load"):
        mpc.set_parameter("laod", 1.0)
    with pytest.raises(dyntape.ArgumentError, match=r"step: x: expected an array of shape \(2,\)"):
        mpc.step(t, [0.0])


def test_a_task_as_a_controller(tmp_path):
    loop = dyntape.control(CONFIG / "control" / "arm_holds.info", set={"mpc.duration": 2.1, "mpc.max_late": 1})
    assert loop.success and loop.x.shape[0] == len(loop.t) and (loop.step_seconds > 0).all()
    loop.write(tmp_path)
    assert (tmp_path / "closed_loop.csv").exists()


def test_a_policy():
    def rate(s):
        return [s.x[1], (s.u[0] - 0.05 * s.x[1] - 9.81 * 0.5 * np.sin(s.x[0])) / 0.25]

    p = dyntape.Problem("pendulum", ["angle", "rate"], ["torque"], 3.0, rate)
    p.add_squares("effort", lambda s: s.u)
    p.add_squares("upright", lambda s: [20 * (s.x[0] - np.pi), 20 * s.x[1]], where="end")
    p.start, p.goal = [0, 0], [np.nan, np.nan]
    s = p.solve_ddp(100)
    assert s.success and s.x.shape == (101, 2) and s.u.shape == (100, 1) and s.K.shape == (100, 1, 2)
    assert abs(s.x[-1, 0] - np.pi) < 0.1 and s.integration_error < 1e-3
    with pytest.raises(dyntape.ArgumentError, match="no parameter"):
        p.add_cost("unknown", lambda s: s["mass"][0])


def swing_up():
    def rate(s):
        return [s.x[1], (s.u[0] - 0.05 * s.x[1] - s["load"][0] * 9.81 * 0.5 * np.sin(s.x[0])) / 0.25]

    p = dyntape.Problem("pendulum", ["angle", "rate"], ["torque"], 3.0, rate, parameters={"load": 1.0})
    p.add_squares("effort", lambda s: s.u)
    p.add_squares("upright", lambda s: [20 * (s.x[0] - np.pi), 20 * s.x[1]], where="end")
    p.start, p.goal = [0, 0], [np.nan, np.nan]
    return p


def test_many_policies_at_once(random):
    solver = swing_up().ddp(60)
    starts, loads = random.uniform(-0.5, 0.5, (11, 2)), random.uniform(0.8, 1.2, 11)
    s = solver.solve_batch(starts, parameters={"load": loads})
    assert len(s) == 11 and s.success.all() and (s.iterations > 0).all()
    assert s.x.shape == (11, 61, 2) and s.u.shape == (11, 60, 1) and s.K.shape == (11, 60, 1, 2)
    np.testing.assert_array_equal(s.x[:, 0], starts)
    alone = solver.solve_batch(starts[7:8], parameters={"load": loads[7:8]})
    for part in ("x", "u", "K", "cost", "slope"):  # the bits that it has alone
        np.testing.assert_array_equal(getattr(s, part)[7], getattr(alone, part)[0])
    solver.set_parameter("load", loads[7])
    one = solver.solve(starts[7])
    np.testing.assert_allclose(one.u, s[7].u, atol=1e-7 * abs(one.u).max())
    step = 1e-5 * np.array([0, 1])
    by_rate = (solver.solve(starts[7] + step).cost - solver.solve(starts[7] - step).cost) / 2e-5
    np.testing.assert_allclose(s.slope[7, 1], by_rate, rtol=1e-5)


def test_what_many_policies_change_by(random):
    solver = swing_up().ddp(60, sensitivities="motion")
    assert solver.parameters == ["load"]
    starts, loads = random.uniform(-0.5, 0.5, (3, 2)), random.uniform(0.8, 1.2, 3)
    s = solver.solve_batch(starts, parameters={"load": loads})
    assert s.sensitivity_status == ["good"] * 3
    assert s.dx_dp.shape == (3, 61, 2, 1) and s.du_dp.shape == (3, 60, 1, 1) and s.dcost_dp.shape == (3, 1)
    assert s.dx_dstart.shape == (3, 61, 2, 2) and s.du_dstart.shape == (3, 60, 1, 2) and s.dcost_dstart.shape == (3, 2)
    step = 1e-5
    up, down = (solver.solve_batch(starts, parameters={"load": loads + way}) for way in (step, -step))
    for slope, part in (("dx_dp", "x"), ("du_dp", "u"), ("dcost_dp", "cost")):
        change = (getattr(up, part) - getattr(down, part)) / (2 * step)
        np.testing.assert_allclose(getattr(s, slope)[..., 0], change, atol=1e-5 * abs(change).max())
        np.testing.assert_array_equal(getattr(s[1], slope), getattr(s, slope)[1])
    np.testing.assert_array_equal(s.dx_dstart[:, 0], np.broadcast_to(np.eye(2), (3, 2, 2)))
    np.testing.assert_allclose(s.dcost_dstart, s.slope, atol=1e-6 * abs(s.slope).max())
    of_cost = swing_up().solve_ddp(60, hessian="gauss_newton", sensitivities="cost")
    assert of_cost.sensitivity_status == "good" and of_cost.dcost_dp.shape == (1,)
    for without in (of_cost, swing_up().ddp(60).solve()):
        with pytest.raises(dyntape.ArgumentError, match='du_dp: not asked for; expected sensitivities="motion"'):
            without.du_dp
    with pytest.raises(dyntape.ArgumentError, match="sensitivities: expected"):
        swing_up().ddp(20, sensitivities="all")


def test_what_a_batch_does_not_take():
    solver = swing_up().ddp(20)
    with pytest.raises(dyntape.ArgumentError, match=r"starts: expected an array of shape \(any, 2\)"):
        solver.solve_batch([[0.0, 0.0, 0.0]])
    with pytest.raises(dyntape.ArgumentError, match=r'"load": expected an array of shape \(problems, 1\), got \(2, 2\)'):
        solver.solve_batch(parameters={"load": [[1.0, 2.0], [1.0, 2.0]]})
    with pytest.raises(dyntape.ArgumentError, match="3 columns, expected 2"):
        solver.solve_batch([[0.0, 0.0]] * 2, parameters={"load": [1.0, 1.0, 1.0]})
    with pytest.raises(IndexError, match="problem 2 of 2"):
        solver.solve_batch([[0.0, 0.0]] * 2)[2]
    with pytest.raises(dyntape.ArgumentError, match="hessian: expected"):
        swing_up().ddp(20, hessian="newton")


def test_masses_are_identified(random):
    arm = dyntape.load(CONFIG / "robots" / "double_pendulum.urdf")
    q, v, a = arm.random(400, seed=2), random.normal(size=(400, 2)), random.normal(size=(400, 2))
    tau = arm.rnea(q, v, a) + random.normal(scale=0.02, size=(400, 2))
    found = arm.identify(q, v, a, tau)
    assert len(found.names) == len(found.values) and (abs(found.values - found.nominal) < 5 * found.deviations).all()
    np.testing.assert_allclose(found.noise, 0.02, rtol=0.2)
    with pytest.raises(dyntape.ArgumentError, match=r"tau: expected an array of shape \(400, 2\)"):
        arm.identify(q, v, a, tau[1:])


def test_a_problem_is_refined_unless_its_mesh_is_given():
    p = dyntape.Problem("halves", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_squares("effort", lambda s: s.u)
    p.start, p.goal = [0, 0], [1, 0]
    p.add_equality("rest", lambda s: s.x[1], where=0.5)
    s = p.solve()  # the control jumps at half time; 24 in each half
    assert s.success and abs(s.cost - 48) < 0.05 and s.cost_change < 1e-4
    assert len(s.meshes) > 1 and s.meshes[-1]["intervals"] == s.intervals
    assert s.iterations == sum(mesh["iterations"] for mesh in s.meshes)
    fixed = p.solve(40)
    assert len(fixed.meshes) == 1 and fixed.intervals == 40 and np.isnan(fixed.cost_change)
    assert len(p.solve(40, refine=True).meshes) > 1


def cart_pole():
    def rate(s):
        (x, v, q, w), f = s.x, s.u[0]
        c, sn = np.cos(q), np.sin(q)
        den = 1 + 0.3 * sn**2
        return [v, (f + 0.3 * sn * (0.5 * w**2 + 9.81 * c)) / den, w, -(f * c + 0.15 * w**2 * sn * c + 1.3 * 9.81 * sn) / (0.5 * den)]

    p = dyntape.Problem("cart", ["x", "v", "q", "w"], ["f"], 2.0, rate)
    p.add_squares("effort", lambda s: s.u)
    p.bound_controls(-20, 20)
    p.start, p.goal = [0, 0, 0, 0], [1, 0, np.pi, 0]
    return p


@pytest.mark.parametrize("method", ["ipopt", "riccati"])
def test_a_solve_begins_with_an_earlier_solution(method):
    p = cart_pole()
    cold = p.solve(method=method)
    p.guess(cold)
    again = p.solve(method=method)
    assert again.success and again.iterations <= 3 and again.intervals == cold.intervals
    np.testing.assert_allclose(again.cost, cold.cost, rtol=1e-6)
    p.goal = [1.01, 0, 1.01 * np.pi, 0]
    moved = p.solve(method=method)
    assert moved.success and moved.iterations <= 6 and moved.attempts[0]["start"] == "an earlier solution"
    fresh = cart_pole()
    fresh.goal = p.goal
    np.testing.assert_allclose(moved.cost, fresh.solve(method=method).cost, rtol=1e-4)
    p.add_inequality("slow", lambda s: s.x[1], upper=50)  # more rows: the motion is still a guess
    assert p.solve(method=method).success
    block = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    block.guess(cold)
    with pytest.raises(dyntape.ArgumentError, match="4 states and 1 controls"):
        block.solve()


def test_a_solution_between_its_points():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_squares("effort", lambda s: s.u)
    p.start, p.goal = [0, 0], [1, 0]
    s = p.solve()
    t = np.linspace(0, 1, 37)
    m = s.at(t)  # p = 3 t^2 - 2 t^3, of least effort
    np.testing.assert_allclose(m.x, np.stack([3 * t**2 - 2 * t**3, 6 * t - 6 * t**2], 1), atol=1e-9)
    np.testing.assert_allclose(m.u[:, 0], 6 - 12 * t, atol=1e-6)
    assert s.at(0.5).x.shape == (2,) and s.at(0.5).t == 0.5
    with pytest.raises(dyntape.ArgumentError, match="lasts from 0 to 1 s, got 1.5"):
        s.at(1.5)
    assert "<td>solved</td>" in s._repr_html_()
    pytest.importorskip("matplotlib")
    figure = s.plot()
    assert [len(axes.lines) for axes in figure.axes] == [4, 2]  # a curve and its points each
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["p", "v"]


def test_copies_and_pickles_of_problems():
    p = cart_pole()
    other = copy.deepcopy(p)
    other.goal = [0, 0, np.pi, 0]
    assert p.goal[0] == 1 and other.goal[0] == 0
    s = p.solve(20)
    assert copy.copy(s) is s
    free = cart_pole()
    free.goal = np.full(4, np.nan)
    for held, instead in ((p, "the function that makes it"), (s, "its arrays"), (free.ddp(20), "another Ddp")):
        with pytest.raises(TypeError, match=instead):
            pickle.dumps(held)


def test_what_is_passed_between_points_is_no_success():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_effort(1)
    p.start, p.goal = [0, 0], [1, 0]
    p.bound_states([-5, -1.2], [5, 1.2])
    coarse = p.solve(2)  # v goes up to 1.244 between its points
    assert coarse.converged and not coarse.success and coarse.passed > 1e-3
    assert "v is 1.24" in coarse.verdict and "between points" in coarse.verdict
    fine = p.solve()
    assert fine.success and fine.passed <= 1e-3


def test_the_true_cost_is_told():
    p = dyntape.Problem("pulse", ["x"], ["u"], 1, lambda s: [s.u[0]])
    p.start = [0]
    p.add_cost("f", lambda s: s.u[0] ** 2 + 1e4 * np.exp(-(((s.t - 0.512) / 0.002) ** 2)) * (s.x[0] - 1) ** 2)
    s = p.solve(20)
    assert s.converged and not s.success and abs(s.true_cost - 20 * np.sqrt(np.pi)) < 0.01
