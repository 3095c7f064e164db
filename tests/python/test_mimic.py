# SPDX-License-Identifier: BSD-3-Clause
"""Scenes, roll-outs, tasks and controllers of robots whose joints follow others."""

import dyntape
import numpy as np
import pytest

G = 9.81
M_A, M_B, RATIO, OFFSET = 0.3, 0.2, -2.0, 0.01
MASS = M_A + RATIO**2 * M_B  # G^T M G
WEIGHT = G * (M_A + RATIO * M_B)


def slider(name, mass, mimic=""):
    return (
        f'<joint name="{name}" type="prismatic"><parent link="base"/><child link="{name}_link"/><axis xyz="0 0 1"/>'
        f'<limit effort="20" velocity="50" lower="-100" upper="100"/>{mimic}</joint>'
        f'<link name="{name}_link"><inertial><mass value="{mass}"/>'
        '<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


URDF = (
    '<robot name="sliders"><link name="base"/>'
    + slider("a", M_A)
    + slider("b", M_B, f'<mimic joint="a" multiplier="{RATIO}" offset="{OFFSET}"/>')
    + "</robot>"
)


def sliders():
    return dyntape.load_text(URDF, mimic=True)


def scene(integrator="runge-kutta-4", more=""):
    text = "start {{ q {{ a 0.1 }} v {{ a 0.2 }} }}\nsimulation {{ duration 0.5  integrator {} }}\n{}"
    return dyntape.Scene.from_text(text.format(integrator, more), robot=sliders())


def test_states_of_a_scene_are_those_of_its_robot():
    s, robot = scene(), sliders()
    assert (s.nq, s.nv, s.nx, s.nu) == (robot.nq, robot.nv, 2, 1) and s.driven == ["a"]
    assert s.q.tolist() == [0.1] and s.v.tolist() == [0.2]
    motion = s.simulate()
    assert motion.success, motion.verdict
    assert motion.q.shape == (len(motion.t), 1)
    np.testing.assert_allclose(motion.q[:, 0], 0.1 + 0.2 * motion.t - WEIGHT / MASS * motion.t**2 / 2, atol=1e-11)
    assert np.ptp(motion.kinetic + motion.stored) < 1e-10


@pytest.mark.parametrize("integrator", ["runge-kutta-4", "implicit-midpoint"])
def test_rollouts_and_their_derivatives(integrator):
    s = scene(integrator)
    u = np.linspace(-1, 3, 40).reshape(1, 40, 1)
    x0 = np.array([[0.1, 0.2], [-0.3, 0.0]])
    x, A, B = s.rollout_jacobians(x0, u)
    np.testing.assert_allclose(x, s.rollout(x0, u), atol=1e-13)
    h = s.step
    np.testing.assert_allclose(A, np.broadcast_to([[1, h], [0, 1]], A.shape), atol=1e-12)
    np.testing.assert_allclose(B, np.broadcast_to([[h * h / 2 / MASS], [h / MASS]], B.shape), atol=1e-12)
    v = x0[:, 1:] + np.cumsum((u[..., 0] - WEIGHT) / MASS * h, axis=1)
    np.testing.assert_allclose(x[..., 1], v, atol=1e-12)
    w = np.zeros((2, 40, 2))
    w[:, -1, 0] = 1
    _, by_x0, by_u = s.rollout_gradient(x0, u, w)
    np.testing.assert_allclose(by_x0, [[1, 40 * h]] * 2, atol=1e-12)
    np.testing.assert_allclose(by_u[0, :, 0], h * h / MASS * (39.5 - np.arange(40)), atol=1e-12)


def test_policies_see_the_independent_joints():
    s = scene()
    hold = dyntape.record(lambda x, p: [WEIGHT - p[0] * x[0] - p[1] * x[1]], 2, 2)
    x = s.rollout([0.1, 0.0], steps=3000, policy=hold, parameters=[20, 10])
    assert abs(x[-1, 0]) < 1e-3
    x, by_x0, by_p = s.rollout_gradient([0.1, 0.0], weights=np.ones((50, 2)), steps=50, policy=hold, parameters=[20, 5])
    assert by_x0.shape == (2,) and by_p.shape == (2,)
    e = np.array([1e-6, 0])
    total = [s.rollout([0.1, 0.0], steps=50, policy=hold, parameters=[20, 5] + d).sum() for d in (e, -e)]
    assert by_p[0] == pytest.approx((total[0] - total[1]) / 2e-6, rel=1e-5)


def test_problems_of_a_scene_keep_the_rules():
    p = scene(more="effects { gravity off }").problem(2.0)
    assert list(p.states) == ["q.a", "v.a"] and list(p.controls) == ["u.a"]
    p.start_at([0.1])
    p.end_at([0.6])
    p.add_squares("effort", lambda s: s.u)
    solution = p.solve()
    assert solution.success, solution.verdict
    assert solution.cost == pytest.approx(12 * MASS**2 * 0.25 / 8, rel=1e-6)


def test_a_controller_of_tied_joints_holds_them():
    p = sliders().problem(0.6)
    p.start_at([0.1])
    p.add_squares("place", lambda s: s.q - 0.3, weight=50)
    p.add_squares("speed", lambda s: s.v, weight=1)
    p.add_squares("effort", lambda s: s.u - WEIGHT, weight=1e-3)
    mpc = dyntape.Mpc(p, intervals=12, scheme="runge-kutta-4")
    s, x, h = scene(), np.array([0.1, 0.0]), 0.02
    for k in range(75):
        step = mpc.step(k * h, x)
        assert step.usable, step
        u = [[step.control(k * h + i * s.step)[0]] for i in range(20)]
        x = s.rollout(x, u)[-1]
    assert abs(x[0] - 0.3) < 5e-3 and abs(x[1]) < 5e-2


def test_files_of_tied_robots(tmp_path):
    (tmp_path / "sliders.urdf").write_text(URDF)
    robot = "robot { urdf sliders.urdf  mimic true }\n"
    (tmp_path / "task.info").write_text(
        robot
        + "effects { gravity off }\nhorizon { duration 2  intervals 10 }\ncosts { control 1 }\n"
        + "start { q { a 0.1 } }\ngoal { q { a 0.6 } }\n"
    )
    solution = dyntape.solve(tmp_path / "task.info")
    assert solution.success, solution.verdict
    assert solution.cost == pytest.approx(12 * MASS**2 * 0.25 / 8, rel=1e-6)
    np.testing.assert_allclose(solution.q[:, 1], RATIO * solution.q[:, 0] + OFFSET, atol=1e-8)
    (tmp_path / "scene.info").write_text(robot + "simulation { duration 0.5 }\n")
    motion = dyntape.simulate(tmp_path / "scene.info")
    assert motion.success and motion.q.shape[1] == 1


def test_what_followers_do_not_have_is_told():
    text = "start {{ q {{ {} }} }}\nsimulation {{ duration 1 }}"
    with pytest.raises(dyntape.FileError, match="joint 'b' follows 'a' and has no value of its own"):
        dyntape.Scene.from_text(text.format("a 0 b 1"), robot=sliders())
    with pytest.raises(dyntape.ArgumentError, match='joint "b" follows "a", whose motor moves it'):
        sliders().problem(1.0, driven=["b"])


def test_limits_that_exclude_each_other_are_told():
    limit = '<limit effort="20" velocity="50" lower="-100" upper="100"/>'
    first, rest = URDF.split(limit, 1)
    text = first + limit.replace("-100", "0").replace("100", "1") + rest.replace(limit, limit.replace("-100", "90"))
    robot = dyntape.load_text(text, mimic=True)
    for ask in (robot.random, lambda: robot.lower_limits):
        with pytest.raises(dyntape.ArgumentError, match="no position of joint 'a' is within its limits and those of"):
            ask()


def test_what_a_robot_cannot_do_is_told_before_a_solve():
    robot = sliders()
    problem = robot.problem(1.0)
    problem.start_at([0.0])
    problem.add_effort(1e-3)
    problem.add_equality("there", problem.frame_error("a_link", [3.0, 0, 0]), where="end")
    with pytest.warns(UserWarning, match="no configuration within the limits of the joints was found in which 'a_link'"):
        problem.solve(4, max_iterations=3)
    weak = dyntape.load_text(URDF.replace('effort="20"', 'effort="0.1"'), mimic=True).problem(1.0)
    weak.start_at([0.0])
    weak.limit_efforts()
    weak.add_effort(1e-3)
    with pytest.warns(UserWarning, match="the motors cannot hold the robot at rest: 'a'"):
        weak.solve(4, max_iterations=3)


def test_random_configurations_keep_the_limits_of_followers():
    """Joint b = RATIO a + OFFSET has narrower limits than a."""
    robot = sliders()
    q = robot.random(2000)
    assert robot.upper_limits[0] < 51
    assert (q >= robot.lower_limits).all() and (q <= robot.upper_limits).all()
