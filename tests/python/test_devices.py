# SPDX-License-Identifier: BSD-3-Clause
"""Functions on devices of OpenCL: the interpreter's bits, shapes, errors.  Skipped where there is no device."""
import os
import subprocess
import sys

import numpy as np
import pytest

import dyntape
from conftest import needs_device


def swing(x, p):
    return np.array([p[0] * np.sin(x[0]) * x[1], x[0] / (2 + np.cos(x[1]))])


@needs_device
def test_batches_have_the_interpreters_bits():
    plain, on_device = (dyntape.record(swing, 2, 1) for _ in range(2))
    assert on_device.compile(device='opencl:0') is on_device and on_device.is_compiled
    random = np.random.default_rng(3)
    x, p, weights = random.normal(size=(7, 30, 2)), random.normal(size=1), random.normal(size=(30, 2))
    for found, expected in [
        (on_device(x, p), plain(x, p)),
        (on_device(x[0, 0], p), plain(x[0, 0], p)),
        (on_device.jacobian(x, p), plain.jacobian(x, p)),
        (on_device.jacobian_values(x[:, ::2], p), plain.jacobian_values(x[:, ::2], p)),
        (on_device.hessian(x, p, weights), plain.hessian(x, p, weights)),
        (on_device(np.empty((0, 2)), p), np.empty((0, 2))),
    ]:
        assert found.shape == expected.shape
        assert np.array_equal(found, expected)


@needs_device
def test_batches_of_many_parts():
    f, g = dyntape.record(lambda x: np.outer(x, x), 30), dyntape.record(lambda x: np.outer(x, x), 30)
    g.compile(0, device='opencl:0')
    x = np.random.default_rng(4).normal(size=(40_000, 30))  # 288 MB of results: several parts
    assert np.array_equal(g(x), f(x))


@needs_device
def test_guards_are_told():
    f = dyntape.record(lambda x: x[0] if x[0] < 1 else -x[0], 1, x0=[0.5])
    f.compile(device='opencl:0')
    x = np.zeros((2000, 1))
    x[1234] = 3
    with pytest.raises(dyntape.GuardViolation, match=r'test_devices.py.*\(at point 1234\)'):
        f(x)
    assert np.array_equal(f(np.zeros((3, 1))), np.zeros(3))


@needs_device
def test_single():
    f = dyntape.record(swing, 2, 1).compile(1, device='opencl:0', single=True)
    x = np.random.default_rng(5).normal(size=(50, 2))
    found, expected = f(x, [2.0]), dyntape.record(swing, 2, 1)(x, [2.0])
    assert found.dtype == np.float64 and not np.array_equal(found, expected)
    assert np.allclose(found, expected, rtol=1e-5, atol=1e-6)
    assert np.array_equal(found, found.astype(np.float32))


# Functions whose recording has the operations of the plain code (tests/python/test_lanes.py); values of the others have those of "tape".
AS_PLAIN = [
    'rnea', 'aba', 'crba', 'minverse', 'nonlinear_effects', 'gravity', 'energy', 'energy_gradients', 'id_derivatives', 'fd_derivatives',
    'gravity_derivatives', 'nonlinear_effects_derivatives', 'frame_placement', 'frame_velocity', 'frame_acceleration', 'frame_jacobian',
    'com', 'com_jacobian', 'centroidal_momentum', 'centroidal_momentum_rate', 'centroidal_matrix',
]  # fmt: skip
METHODS = sorted(name for name, f in vars(dyntape.Robot).items() if 'device: str' in (f.__doc__ or '').split('\n', 1)[0])


def states_of(robot, function, count):
    random = np.random.default_rng(6)
    entries = list(robot.inputs(function).values())
    return [robot.random(count, seed=5), *(random.uniform(-1, 1, (count, n)) for n in entries[1:])]


def parts(result):
    return result if isinstance(result, tuple) else (result,)


def test_all_methods_have_devices():
    assert len(METHODS) >= 38 and set(AS_PLAIN) <= set(METHODS)


BODY = """<link name="{0}"><inertial><origin xyz="0.1 0.2 0.05"/><mass value="{1}"/>
<inertia ixx="0.3" iyy="0.2" izz="0.25" ixy="0.01" ixz="0.02" iyz="0.03"/></inertial></link>"""
FLOATING = f"""<robot name="drifter">{BODY.format('trunk', 2)}{BODY.format('arm', 0.7)}<joint name="shoulder" type="continuous">
<parent link="trunk"/><child link="arm"/><origin xyz="0.1 0 0.3" rpy="0.2 0.1 0"/><axis xyz="0 1 0"/></joint></robot>"""


@pytest.fixture(scope='module', params=['fixed', 'floating'])
def robot(request):
    """Small ones, as all their functions are compiled."""
    if request.param == 'fixed':
        return dyntape.load('config/robots/arm_2r.urdf')
    return dyntape.load_text(FLOATING, base='floating')


@needs_device
@pytest.mark.parametrize('function', METHODS)
def test_methods_of_robots(robot, function):
    method, is_derivative = getattr(robot, function), 'fd-forward' in getattr(dyntape.Robot, function).__doc__
    arguments = states_of(robot, function, 1000)
    route = {} if function in AS_PLAIN or is_derivative else {'route': 'tape'}
    expected, found = method(*arguments, **route), method(*arguments, device='opencl:0')
    assert type(found) is type(expected)
    for a, b in zip(parts(found), parts(expected)):
        assert a.shape == b.shape
        if function in AS_PLAIN or not is_derivative:
            assert np.array_equal(a, b, equal_nan=True) and not np.any(np.signbit(a) & (a == 0))
        else:
            assert np.allclose(a, b, rtol=1e-9, atol=1e-9 * max(1, np.abs(b).max(initial=0)))
    one = method(*(x[:1] for x in arguments), device='opencl:0')
    alone = method(*(x[7] for x in arguments), device='opencl:0')
    for a, of_one, of_alone in zip(parts(found), parts(one), parts(alone)):
        assert np.array_equal(a[:1], of_one, equal_nan=True) and np.array_equal(a[7], of_alone, equal_nan=True)


@needs_device
def test_methods_broadcast_and_take_options():
    arm = dyntape.load('config/robots/arm_2r.urdf')
    q, v, a = states_of(arm, 'rnea', 6)
    wide = arm.rnea(q.reshape(2, 3, 2), v[0], a[:3], device='opencl:0')
    assert np.array_equal(wide, arm.rnea(q.reshape(2, 3, 2), v[0], a[:3]))
    options = {'frame': arm.frames[1], 'axes': 'local'}
    assert np.array_equal(arm.frame_jacobian(q, device='opencl:0', **options), arm.frame_jacobian(q, **options))
    assert arm.crba(np.empty((0, 2)), device='opencl:0').shape == (0, 2, 2)
    tied = dyntape.load('config/robots/panda.urdf', mimic=True)
    arguments = states_of(tied, 'rnea', 10)
    assert np.array_equal(tied.rnea(*arguments, device='opencl:0'), tied.rnea(*arguments, route='tape'))


@needs_device
def test_methods_and_rollouts_in_float():
    arm = dyntape.load('config/robots/arm_2r.urdf')
    arguments = states_of(arm, 'aba', 50)
    found, expected = arm.aba(*arguments, device='opencl:0', single=True), arm.aba(*arguments)
    assert not np.array_equal(found, expected) and np.allclose(found, expected, rtol=1e-3, atol=1e-3)
    assert np.array_equal(found, found.astype(np.float32))
    assert np.array_equal(arm.aba(*arguments, device='opencl:0'), expected)  # kept by precision
    scene = dyntape.Scene('config/scenes/pendulum.info', set={'simulation.integrator': 'semi-implicit-euler'})
    x0, u = np.random.default_rng(11).normal(size=(50, 2)), np.zeros((20, 1))
    found, expected = scene.rollout(x0, u, device='opencl:0', single=True), scene.rollout(x0, u, device='opencl:0')
    assert np.array_equal(found, found.astype(np.float32)) and np.allclose(found, expected, rtol=1e-4, atol=1e-4)
    with pytest.raises(dyntape.ArgumentError, match='rnea: single: expected a device, got none'):
        arm.rnea(*arguments, single=True)
    with pytest.raises(dyntape.ArgumentError, match='rollout: single: expected a device, got none'):
        scene.rollout(x0, u, single=True)


@needs_device
def test_a_batch_of_many_parts():
    arm = dyntape.load('config/robots/ur5.urdf')
    arguments = states_of(arm, 'minverse', 400_000)  # 42 numbers a state: two parts
    assert np.array_equal(arm.minverse(*arguments, device='opencl:0'), arm.minverse(*arguments))


@needs_device
def test_devices_say_what_they_are():
    first = dyntape.devices()[0]
    assert first.name and first.platform and first.driver and first.memory > 0
    assert first.name in repr(first)


def test_wrong_devices():
    f = dyntape.record(swing, 2, 1)
    with pytest.raises(dyntape.ArgumentError, match='device "cuda:0": expected opencl: and a number, as in opencl:0'):
        f.compile(device='cuda:0')
    with pytest.raises(dyntape.ArgumentError, match='single: expected a device, got none'):
        f.compile(single=True)
    arm, q = dyntape.load('config/robots/arm_2r.urdf'), np.zeros((5, 2))
    with pytest.raises(dyntape.ArgumentError, match='device "cuda:0": expected opencl: and a number, as in opencl:0'):
        arm.rnea(q, q, q, device='cuda:0')
    with pytest.raises(dyntape.ArgumentError, match="rnea: a route is the processor's; expected route or device, got both"):
        arm.rnea(q, q, q, device='opencl:0', route='lanes')
    with pytest.raises(TypeError, match='device: expected a str'):
        arm.rnea(q, q, q, device=0)
    with pytest.raises(dyntape.ArgumentError, match='crba: a device is for numbers'):
        dyntape.record(lambda x: arm.crba(x, device='opencl:0'), 2)
    assert not f.is_compiled
    assert f([0.1, 0.2], [1.0]).shape == (2,)


@needs_device
def test_devices_that_are_not_there():
    arm, q = dyntape.load('config/robots/arm_2r.urdf'), np.zeros((5, 2))
    with pytest.raises(dyntape.ToolError) as caught:
        arm.rnea(q, q, q, device='opencl:77')
    listed = ', '.join(f'opencl:{i} ({d.name})' for i, d in enumerate(dyntape.devices()))
    assert str(caught.value) == f'OpenCL: there is no device opencl:77; expected {listed}'


def test_without_a_loader():
    program = 'import dyntape, sys\ntry:\n  dyntape.devices()\nexcept dyntape.ToolError as e:\n  sys.exit(str(e))'
    run = subprocess.run([sys.executable, '-c', program], env={**os.environ, 'DYNTAPE_OPENCL': 'libnowhere.so.7'}, capture_output=True,
                         text=True)
    assert run.returncode == 1
    assert run.stderr.startswith('OpenCL: the loader libnowhere.so.7 cannot be opened; expected an installed loader')


@needs_device
def test_a_loader_without_devices(tmp_path):
    program = 'import dyntape\nprint(dyntape.devices())\ndyntape.record(lambda x: x, 1).compile(device="opencl:0")'
    run = subprocess.run([sys.executable, '-c', program], env={**os.environ, 'OCL_ICD_VENDORS': str(tmp_path)}, capture_output=True,
                         text=True)
    assert run.stdout == '[]\n'
    assert 'ToolError: OpenCL: the loader knows no device; expected a driver' in run.stderr


def quadruped(scheme, **contact):
    changes = {f'effects.contacts.contact.{key}': value for key, value in contact.items()}
    changes |= {'simulation.integrator': scheme, 'simulation.step': 1e-3}
    scene = dyntape.Scene('config/scenes/quadruped_explicit.info', set=changes)
    start = np.concatenate([scene.q, scene.v])
    random = np.random.default_rng(8)
    x0 = np.tile(start, (70, 1))
    x0[:, 2] += random.uniform(-0.3, 0.1, size=70)  # some touch the ground soon
    x0[:, scene.nq :] += random.normal(size=(70, scene.nv))
    return scene, x0, random.uniform(-2, 2, size=(70, 40, scene.nu))


@needs_device
@pytest.mark.parametrize('scheme', ['semi-implicit-euler', 'runge-kutta-4'])
def test_rollouts_have_the_bits_of_the_processor(scheme):
    scene, x0, u = quadruped(scheme, exponent=1, friction=0)  # without pow and tanh, which are the device's
    x0[3, 5] = np.nan  # a world without steps
    u[4, 7, 2] = np.inf  # and one that ends
    expected = scene.rollout(x0, u)
    found = scene.rollout(x0, u, device='opencl:0')
    assert found.shape == expected.shape and np.array_equal(found, expected, equal_nan=True)
    assert np.isnan(found[3]).all() and np.isnan(found[4, 7:]).all() and np.isfinite(found[4, :7]).all()
    for every in 1, 7, 40, 41:
        kept = scene.rollout(x0, u, every=every, device='opencl:0')
        assert kept.shape == (70, 40 // every, scene.nx)
        assert np.array_equal(kept, expected[:, every - 1 :: every], equal_nan=True)
        assert np.array_equal(scene.rollout(x0, u, every=every), kept, equal_nan=True)
    one = scene.rollout(x0[0], u[0], device='opencl:0')
    assert np.array_equal(one, expected[0])
    shared = scene.rollout(x0, u[0], device='opencl:0')  # the same commands for all worlds
    assert np.array_equal(shared, scene.rollout(x0, u[0]), equal_nan=True)
    assert np.array_equal(scene.rollout(x0[0], u, device='opencl:0')[0], expected[0])


@needs_device
def test_rollouts_with_functions_of_the_device():
    scene, x0, u = quadruped('semi-implicit-euler')
    expected, found = scene.rollout(x0, u), scene.rollout(x0, u, device='opencl:0')
    flying = (expected[:, :, 2] > 0.4).all(axis=1)
    assert flying.any() and not flying.all()
    assert np.array_equal(found[flying], expected[flying]) and np.allclose(found, expected, rtol=1e-10, atol=1e-10)


@needs_device
def test_rollouts_of_the_scenes_own_commands():
    scene = dyntape.Scene('config/scenes/pendulum.info', set={'simulation.integrator': 'semi-implicit-euler'})
    x0 = np.random.default_rng(9).normal(size=(3000, 2))
    expected = scene.rollout(x0, steps=200)
    assert np.array_equal(scene.rollout(x0, steps=200, device='opencl:0'), expected)
    assert np.array_equal(scene.rollout(x0, steps=200, every=200, device='opencl:0')[:, 0], expected[:, -1])


@needs_device
def test_rollouts_with_a_policy():
    scene, x0, _ = quadruped('semi-implicit-euler', exponent=1, friction=0)
    nq, nu = scene.nq, scene.nu

    def law(x, p):
        return [p[k % 3] * np.sin(-x[7 + k]) - p[3] * x[nq + 6 + k] + p[4] * x[3] * x[6] for k in range(nu)]

    policy = dyntape.record(law, scene.nx, 5)
    theta = np.random.default_rng(10).uniform(1, 3, size=(70, 5))
    x0[3, 5], theta[6, 2] = np.nan, np.inf
    for parameters in theta, theta[1]:
        expected = scene.rollout(x0, steps=30, policy=policy, parameters=parameters)
        found = scene.rollout(x0, steps=30, policy=policy, parameters=parameters, device='opencl:0')
        assert np.isfinite(expected[:3]).all() and np.isnan(expected[3]).all()
        assert np.array_equal(found, expected, equal_nan=True)
    free = dyntape.record(lambda x: -0.1 * x[nq + 6 :], scene.nx)  # without parameters
    expected = scene.rollout(x0[1], steps=30, policy=free, every=10)
    assert np.array_equal(scene.rollout(x0[1], steps=30, policy=free, every=10, device='opencl:0'), expected)


@needs_device
def test_rollouts_that_no_device_takes():
    scene = dyntape.Scene('config/scenes/pendulum.info', set={'simulation.integrator': 'semi-implicit-euler'})
    branching = dyntape.record(lambda x: [-x[1] if x[0] < 3 else x[1]], 2)
    with pytest.raises(dyntape.ArgumentError, match=r'policy ".*" branches on values \(.*test_devices.py:\d+\); expected select'):
        scene.rollout([0.1, 0], steps=5, policy=branching, device='opencl:0')
    with pytest.raises(dyntape.ArgumentError, match='rollout: every is 0, expected 1 or more'):
        scene.rollout([0.1, 0], steps=5, every=0)
    with pytest.raises(dyntape.ToolError, match='there is no device opencl:77; expected opencl:0'):
        scene.rollout([0.1, 0], steps=5, device='opencl:77')
    implicit = dyntape.Scene('config/scenes/quadruped_dropped.info')
    with pytest.raises(dyntape.ArgumentError, match='the scheme implicit-midpoint; expected an explicit one, semi-implicit-euler or runge'):
        implicit.rollout(np.concatenate([implicit.q, implicit.v]), steps=5, device='opencl:0')
    rigid = dyntape.Scene('config/scenes/tumbling_box.info')
    with pytest.raises(dyntape.ArgumentError, match='"tumbling_box" has rigid contacts or hard limits, whose steps iterate'):
        rigid.rollout(np.concatenate([rigid.q, rigid.v]), steps=5, device='opencl:0')
