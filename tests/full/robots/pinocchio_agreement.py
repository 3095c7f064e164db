#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Holds `dyntape eval` against Pinocchio's own reading of the same robot files.

    pinocchio_agreement.py DYNTAPE --states 1000 robots/panda.urdf robots/solo12.urdf:floating ...

Joint order and indices must be the same, and every function by every route must agree within its tolerance:
largest difference over largest entry, block by block (a large block must not hide a small one).
Needs the Python packages pin and numpy.  One line a robot and function; exit status 1 where one disagrees.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import pinocchio

ROUTES = ('analytic', 'tape', 'generated')
# Text is compiled for robots of at most so many velocities: a humanoid's takes minutes, and its bits are the tape's (RobotTable tests).
MOST_COMPILED = 18
# By which routes, and how closely, each function must agree.  Forward-dynamics derivatives: Pinocchio's are
# themselves off by about 1e-12.
CORE = {'rnea': 1e-12, 'aba': 1e-12, 'crba': 1e-12, 'id-derivatives': 1e-12, 'fd-derivatives': 1e-11}
PLAIN = {'nonlinear-effects': 1e-12, 'gravity': 1e-12, 'minverse': 1e-11, 'energy': 1e-12, 'gravity-derivatives': 1e-12,
         'frame-placement': 1e-12, 'frame-velocity': 1e-12, 'frame-acceleration': 1e-12, 'frame-jacobian': 1e-12,
         'frame-jacobian-rate': 1e-12, 'frame-velocity-derivatives': 1e-12, 'com': 1e-12, 'com-jacobian': 1e-12,
         'centroidal-momentum': 1e-12, 'centroidal-momentum-rate': 1e-12, 'centroidal-matrix': 1e-12,
         'centroidal-matrix-rate': 1e-12, 'centroidal-derivatives': 1e-12, 'torque-regressor': 1e-12}


def symmetric(upper):
    return np.triu(upper) + np.triu(upper, 1).T


class Peer:
    """Pinocchio's answers, as lists of blocks."""

    def __init__(self, urdf, base):
        root = [pinocchio.JointModelFreeFlyer()] if base == 'floating' else []
        self.model = pinocchio.buildModelFromUrdf(str(urdf), *root)
        self.data = self.model.createData()

    def blocks(self, function, q, v, w):
        m, d = self.model, self.data
        if function == 'rnea':
            return [pinocchio.rnea(m, d, q, v, w).copy()]
        if function == 'aba':
            return [pinocchio.aba(m, d, q, v, w, pinocchio.Convention.LOCAL).copy()]
        if function == 'crba':
            return [symmetric(pinocchio.crba(m, d, q))]
        if function == 'id-derivatives':
            dq, dv, da = pinocchio.computeRNEADerivatives(m, d, q, v, w)
            return [dq.copy(), dv.copy(), symmetric(da)]  # the next call overwrites what it returned
        if function == 'fd-derivatives':
            return [block.copy() for block in pinocchio.computeABADerivatives(m, d, q, v, w)[:3]]
        if function.startswith('frame-'):
            return [np.array(block) for block in self.frame_blocks(function, q, v, w)]
        return [np.array(block) for block in self.other_blocks(function, q, v, w)]

    def frame_blocks(self, function, q, v, w):
        """Of the frame that `dyntape eval` takes where none is named, in its default frame."""
        m, d, f, aligned = self.model, self.data, self.frame, pinocchio.LOCAL_WORLD_ALIGNED
        if function == 'frame-jacobian':
            return [pinocchio.computeFrameJacobian(m, d, q, f, aligned)]
        if function == 'frame-jacobian-rate':
            pinocchio.computeJointJacobiansTimeVariation(m, d, q, v)
            return [pinocchio.getFrameJacobianTimeVariation(m, d, f, aligned)]
        pinocchio.computeForwardKinematicsDerivatives(m, d, q, v, w)
        if function == 'frame-placement':
            placement = pinocchio.updateFramePlacement(m, d, f)
            return [placement.rotation, placement.translation]
        if function == 'frame-velocity':
            return [pinocchio.getFrameVelocity(m, d, f, aligned).vector]
        if function == 'frame-acceleration':
            return [pinocchio.getFrameAcceleration(m, d, f, aligned).vector,
                    pinocchio.getFrameClassicalAcceleration(m, d, f, aligned).vector]
        return pinocchio.getFrameVelocityDerivatives(m, d, f, pinocchio.LOCAL)  # wrong where it is aligned

    def centroidal_rate(self, q, v):
        """computeCentroidalMapTimeVariation gives a matrix that only times v is right."""
        pinocchio.dccrba(self.model, self.data, q, v)
        return self.data.dAg

    def other_blocks(self, function, q, v, w):
        m, d = self.model, self.data
        return {
            'nonlinear-effects': lambda: [pinocchio.nonLinearEffects(m, d, q, v)],
            'gravity': lambda: [pinocchio.computeGeneralizedGravity(m, d, q)],
            'minverse': lambda: [symmetric(pinocchio.computeMinverse(m, d, q))],
            'energy': lambda: [[pinocchio.computeKineticEnergy(m, d, q, v), pinocchio.computePotentialEnergy(m, d, q)]],
            'gravity-derivatives': lambda: [pinocchio.computeGeneralizedGravityDerivatives(m, d, q)],
            'com': lambda: [pinocchio.centerOfMass(m, d, q)],
            'com-jacobian': lambda: [pinocchio.jacobianCenterOfMass(m, d, q)],
            'centroidal-momentum': lambda: [pinocchio.computeCentroidalMomentum(m, d, q, v).vector],
            'centroidal-momentum-rate':
                lambda: [pinocchio.computeCentroidalMomentumTimeVariation(m, d, q, v, w).vector],
            'centroidal-matrix': lambda: [pinocchio.computeCentroidalMap(m, d, q)],
            'centroidal-matrix-rate': lambda: [self.centroidal_rate(q, v)],
            'centroidal-derivatives':
                lambda: pinocchio.computeCentroidalDynamicsDerivatives(m, d, q, v, w)[1:],
            'torque-regressor': lambda: [pinocchio.computeJointTorqueRegressor(m, d, q, v, w)],
        }[function]()


def states(peer, count, seed):
    rng = np.random.default_rng(seed)
    pinocchio.seed(seed)
    bound = np.ones(peer.model.nq)
    for _ in range(count):
        q = pinocchio.randomConfiguration(peer.model, -bound, bound)
        yield q, rng.uniform(-1, 1, peer.model.nv), rng.uniform(-1, 1, peer.model.nv)


def run(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip() or f'exit status {done.returncode}')
    return done.stdout


def compare_tree(dyntape, urdf, base, peer):
    info = json.loads(run([dyntape, 'info', urdf, '--base', base, '--snap', 0, '--json']))
    ours = [(j['name'], j['idx_q'], j['idx_v']) for j in info['joints']]
    theirs = [(n, j.idx_q, j.idx_v) for n, j in zip(peer.model.names[1:], peer.model.joints[1:])]
    skip = 1 if base == 'floating' else 0  # what the root joint is called is free
    if (info['nq'], info['nv'], ours[skip:]) != (peer.model.nq, peer.model.nv, theirs[skip:]):
        raise RuntimeError(f'joints differ: {ours} here, {theirs} there')
    peer.frame = peer.model.getFrameId(info['frames'][-1]['name'], pinocchio.FrameType.BODY)


ONLY_Q = {'crba', 'gravity', 'minverse', 'gravity-derivatives', 'frame-placement', 'frame-jacobian', 'com', 'com-jacobian',
          'centroidal-matrix'}
Q_AND_V = {'nonlinear-effects', 'energy', 'frame-velocity', 'frame-jacobian-rate', 'frame-velocity-derivatives',
           'centroidal-momentum', 'centroidal-matrix-rate'}


def compare_function(dyntape, urdf, base, peer, function, samples, routes):
    """Largest relative difference of any block, for each route."""
    third = 'tau' if function in ('aba', 'fd-derivatives') else 'a'
    parts = [('q', peer.model.nq), ('v', peer.model.nv), (third, peer.model.nv)]
    parts = parts[:1 if function in ONLY_Q else 2 if function in Q_AND_V else 3]
    expected = [peer.blocks(function, *s) for s in samples]
    worst = {}
    with tempfile.TemporaryDirectory() as folder:
        source, result = pathlib.Path(folder, 'states.csv'), pathlib.Path(folder, 'result.csv')
        rows = [','.join(f'{name}{i}' for name, n in parts for i in range(n))]
        rows += [','.join(repr(float(x)) for x in np.concatenate(s[:len(parts)])) for s in samples]
        source.write_text('\n'.join(rows) + '\n')
        for route in routes:
            frame = 'local' if function == 'frame-velocity-derivatives' else 'aligned'
            run([dyntape, 'eval', urdf, '--base', base, '--snap', 0, '--function', function, '--in', frame, '--route', route,
                 '--input', source, '--output', result])
            got = np.loadtxt(result, delimiter=',', skiprows=1, ndmin=2)
            worst[route] = 0.0
            for row, blocks in zip(got, expected):
                ends = np.cumsum([b.size for b in blocks])
                if row.size != ends[-1]:
                    raise RuntimeError(f'{function}: {row.size} columns, expected {ends[-1]}')
                for block, part in zip(blocks, np.split(row, ends[:-1])):
                    scale = max(np.abs(block).max(), 1e-300)
                    error = np.abs(part - np.asarray(block).ravel()).max() / scale
                    worst[route] = max(worst[route], error if np.isfinite(error) else np.inf)
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('dyntape')
    parser.add_argument('robots', nargs='+', metavar='ROBOT.urdf[:floating]')
    parser.add_argument('--states', type=int, default=100)
    parser.add_argument('--seed', type=int, default=20)
    options = parser.parse_args()
    print(f'Pinocchio {pinocchio.__version__}, {options.states} states, seed {options.seed}')
    failed = False
    for robot in options.robots:
        urdf, _, base = robot.partition(':')
        base = base or 'fixed'
        label = f'{pathlib.Path(urdf).stem} {base}'
        try:
            peer = Peer(urdf, base)
            compare_tree(options.dyntape, urdf, base, peer)
            samples = list(states(peer, options.states, options.seed))
            compiled = peer.model.nv <= MOST_COMPILED
            for function, tolerance in {**CORE, **PLAIN}.items():
                routes = ROUTES[:1] if function not in CORE else ROUTES if compiled else ROUTES[:2]
                worst = compare_function(options.dyntape, urdf, base, peer, function, samples, routes)
                ok = max(worst.values()) <= tolerance
                failed |= not ok
                print(f'{label:28} {function:26}', *(f'{r} {worst[r]:.1e}' for r in routes), 'ok' if ok else 'DISAGREES')
        except RuntimeError as error:
            failed = True
            print(f'{label}: {error}')
    return 1 if failed else 0


sys.exit(main())
