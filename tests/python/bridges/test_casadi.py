# SPDX-License-Identifier: BSD-3-Clause
"""Functions of dyntape in CasADi: values, exact derivatives, Opti, threads, and names that are free again."""
import numpy as np
import pytest

import dyntape
from conftest import page_section

ca = pytest.importorskip('casadi')


@pytest.fixture(scope='module')
def arm():
    return dyntape.load(dyntape.config_folder() / 'robots' / 'panda.urdf', lock=['panda_finger_joint1', 'panda_finger_joint2'])


def states(robot, count):
    return robot.random(count, seed=1), robot.random(count, seed=2), robot.random(count, seed=3)


def test_values_and_jacobians_are_the_robots(arm):
    aba = arm.casadi('aba')
    q, v, tau = (x[0] for x in states(arm, 1))
    assert aba.name_in() == ['q', 'v', 'tau'] and aba.name_out() == ['ddq']
    assert np.abs(np.array(aba(q, v, tau))[:, 0] - arm.aba(q, v, tau)).max() < 1e-9
    by_q, by_v, by_tau = aba.jacobian()(q, v, tau, 0)
    exact = arm.fd_derivatives(q, v, tau)
    for got, expected in ((by_q, exact.ddq_dq), (by_v, exact.ddq_dv), (by_tau, exact.ddq_dtau)):
        assert np.abs(np.array(got) - expected).max() < 1e-9 * np.abs(expected).max()


def test_hessians_are_those_of_the_recording(arm):
    q, v, tau = (x[0] for x in states(arm, 1))
    weights = np.arange(1.0, 8.0)
    x, rnea = ca.MX.sym('x', 21), arm.casadi('rnea')
    hessian = ca.Function('h', [x], [ca.hessian(ca.dot(weights, rnea(x[:7], x[7:14], x[14:])), x)[0]])
    recorded = dyntape.record(lambda x: arm.rnea(x[:7], x[7:14], x[14:]), 21)
    z = np.concatenate([q, v, tau])
    assert np.abs(np.array(hessian(z)) - recorded.hessian(z, weights=weights)).max() < 1e-10


def test_matrices_are_as_numpy_has_them(arm):
    q = arm.random(seed=4)
    assert np.array_equal(np.array(arm.casadi('crba')(q)), np.array(arm.casadi('crba')(q)).T)
    placement = arm.casadi('frame-jacobian', frame='panda_link7', axes='local')
    assert placement.size_out(0) == (6, 7)
    assert np.abs(np.array(placement(q)) - arm.frame_jacobian(q, frame='panda_link7', axes='local')).max() < 1e-14


def test_recorded_functions_with_parameters():
    f = dyntape.record(lambda x, p: np.array([x[0] * p[0] + np.sin(x[1]), x[0] * x[1] ** 2]), 2, 1).casadi()
    assert f.name_in() == ['x', 'p'] and np.allclose(np.array(f([1, 2], 3))[:, 0], [3 + np.sin(2), 4])
    by_x, by_p = f.jacobian()([1, 2], 3, 0)
    assert np.allclose(np.array(by_x), [[3, np.cos(2)], [4, 4]]) and np.allclose(np.array(by_p), [[1], [0]])


def test_a_branch_that_is_left_is_a_failed_evaluation():
    f = dyntape.record(lambda x: x * 2 if x[0] < 1 else x, 1).casadi()
    with pytest.raises(RuntimeError):
        f(2)


def test_opti_finds_the_pendulums_least_torque():
    pendulum = dyntape.load(dyntape.config_folder() / 'robots' / 'pendulum.urdf')
    fd, n, opti = pendulum.casadi('aba'), 40, ca.Opti()
    q, v, u = opti.variable(1, n + 1), opti.variable(1, n + 1), opti.variable(1, n + 1)
    a, h = fd.map(n + 1)(q, v, u), 1 / n
    opti.subject_to(q[1:] - q[:-1] == h / 2 * (v[1:] + v[:-1]))
    opti.subject_to(v[1:] - v[:-1] == h / 2 * (a[1:] + a[:-1]))
    opti.subject_to([q[0] == 0, v[0] == 0, q[-1] == 0.5, v[-1] == 0])
    opti.minimize(ca.sumsqr(u) * h)
    opti.solver('ipopt', {'print_time': False, 'ipopt': {'print_level': 0, 'sb': 'yes'}})
    solution = opti.solve()
    assert solution.stats()['success'] and solution.stats()['iter_count'] < 15  # exact Hessians
    assert abs(solution.value(q[n // 2]) - 0.25) < 0.1


def test_an_integrator_takes_it(arm):
    fd, x = arm.casadi('aba'), ca.MX.sym('x', 14)
    flow = ca.integrator('flow', 'cvodes', {'x': x, 'ode': ca.vertcat(x[7:], fd(x[:7], x[7:], np.zeros(7)))}, 0, 0.1,
                         {'reltol': 1e-10, 'abstol': 1e-12})
    q = arm.random(seed=5)
    end = np.array(flow(x0=np.concatenate([q, np.zeros(7)]))['xf'])[:, 0]
    energies = [np.sum([float(e) for e in arm.energy(at[:7], at[7:])]) for at in (np.concatenate([q, np.zeros(7)]), end)]
    assert abs(energies[1] - energies[0]) < 1e-6


def test_threads_and_names_that_are_free_again(arm):
    q, v, tau = states(arm, 64)
    rnea = arm.casadi('rnea')
    by_threads = np.array(rnea.map(64, 'thread', 4)(q.T, v.T, tau.T))
    assert np.array_equal(by_threads, np.array(rnea.map(64)(q.T, v.T, tau.T)))
    for _ in range(300):  # there is room for 100
        arm.casadi('gravity')
    assert np.array_equal(np.array(rnea(q[0], v[0], tau[0]))[:, 0], by_threads[:, 0])


def test_a_function_that_is_not_there(arm):
    with pytest.raises(dyntape.ArgumentError, match='did you mean'):
        arm.casadi('inverse')


def test_the_page():
    names = {}
    exec(page_section("CasADi and acados"), names)
    assert names["A"].shape == (7, 51)
