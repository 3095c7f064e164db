# SPDX-License-Identifier: BSD-3-Clause
"""A robot's dynamics in CasADi's symbols, as somebody would write them who uses CasADi and not dyntape.

    f = function_of(model, ('id-derivatives', 'analytic'))     # model: what bench_kernels --model prints

Recursions are those of R. Featherstone, Rigid Body Dynamics Algorithms, 2008 (body frames, linear part first);
derivatives of inverse dynamics once by CasADi's jacobian() and once by the recursion of J. Carpentier and N. Mansard,
RSS 2018 (world frame), those of forward dynamics from the latter and the inverse inertia: CasADi's jacobian() of the
articulated-body algorithm is many times longer.  Tangents: a quaternion (x y z w) and a (cos, sin) move by d, whose
exponential is exact to second order.
"""
import casadi as ca

cross, skew, stack = ca.cross, ca.skew, ca.vertcat


def symmetric(A):  # by the upper triangle alone: the lower one is then never computed
    return ca.triu(A) + ca.triu(A, False).T


class Robot:
    """Placements and motion subspaces at symbols q, v and a third one; `tangent` is what to derive by."""

    def __init__(self, model):
        self.model, self.joints = model, model['joints']
        n = model['nv']
        self.q, self.v, self.w, self.mu = (ca.SX.sym(name, k) for name, k in
                                           (('q', model['nq']), ('v', n), ('w', n), ('mu', n)))
        self.gravity = ca.DM(model['gravity'])
        tangent, self.steps, self.R, self.p, self.S, self.cols = [], [], [], [], [], []
        for joint in self.joints:
            fixed = ca.SX(ca.sparsify(ca.reshape(ca.DM(joint['rotation']), 3, 3).T))
            moved, entries, S = self.motion(joint)
            tangent += entries
            self.R.append(fixed @ moved[0])
            self.p.append(ca.DM(joint['translation']) + fixed @ moved[1])
            self.S.append(ca.SX(ca.sparsify(ca.DM(S))))
            self.cols.append(list(range(joint['idx_v'], joint['idx_v'] + self.S[-1].shape[1])))
        self.tangent, self.step = stack(*tangent), stack(*self.steps) if self.steps else ca.SX(0, 1)

    def motion(self, joint):
        at, a = joint['idx_q'], ca.sparsify(ca.DM(joint['axis']))
        turned = lambda c, s: a @ a.T + c * (ca.DM.eye(3) - a @ a.T) + s * ca.sparsify(skew(a))
        still, none = ca.SX.eye(3), ca.SX(3, 1)
        axis = [[x] for x in joint['axis']]
        if joint['type'] == 'revolute':
            x = self.q[at]
            return (turned(ca.cos(x), ca.sin(x)), none), [x], [[0]] * 3 + axis
        if joint['type'] == 'prismatic':
            return (still, a * self.q[at]), [self.q[at]], axis + [[0]] * 3
        if joint['type'] == 'continuous':
            c, s, d = self.q[at], self.q[at + 1], self.new_step(1)
            return (turned(c - s * d - c * d * d / 2, s + c * d - s * d * d / 2), none), [d], [[0]] * 3 + axis
        if joint['type'] == 'free-flyer':
            d, u, w = self.new_step(6), self.q[at + 3:at + 6], self.q[at + 6]
            R = still + 2 * w * skew(u) + 2 * skew(u) @ skew(u)
            turn = skew(d[3:])  # where the base is has no effect
            return (R @ (still + turn + turn @ turn / 2), none), [d], ca.DM.eye(6).full().tolist()
        raise SystemExit(f'casadi_peer.py: no joints of type {joint["type"]}')

    def new_step(self, n):
        self.steps.append(ca.SX.sym(f'd{len(self.steps)}', n))
        return self.steps[-1]

    def parts(self, i):
        joint = self.joints[i]
        return joint['mass'], ca.DM(joint['com']), ca.sparsify(ca.reshape(ca.DM(joint['inertia']), 3, 3))

    def momentum(self, i, m):
        mass, com, inertia = self.parts(i)
        linear = mass * (m[:3] + cross(m[3:], com))
        return stack(linear, inertia @ m[3:] + cross(com, linear))

    def down(self, i, m):  # a motion of the parent, seen from body i
        return stack(self.R[i].T @ (m[:3] + cross(m[3:], self.p[i])), self.R[i].T @ m[3:])

    def up(self, i, f):  # a force on body i, seen from the parent
        linear = self.R[i] @ f[:3]
        return stack(linear, self.R[i] @ f[3:] + cross(self.p[i], linear))

    def parent(self, i):
        return self.joints[i]['parent']

    def __len__(self):
        return len(self.joints)


def cross_motion(a, b):
    return stack(cross(a[3:], b[:3]) + cross(a[:3], b[3:]), cross(a[3:], b[3:]))


def cross_force(a, f):
    return stack(cross(a[3:], f[:3]), cross(a[3:], f[3:]) + cross(a[:3], f[:3]))


def columns(f, *matrices):
    return ca.horzcat(*[f(*[M[:, j] for M in matrices]) for j in range(matrices[0].shape[1])])


def rnea(r, qdd):
    tau, vs, accelerations, forces = ca.SX(r.model['nv'], 1), [], [], []
    for i in range(len(r)):
        at_rest = ca.SX(6, 1)
        v = r.down(i, vs[r.parent(i)]) if r.parent(i) >= 0 else at_rest
        a = r.down(i, accelerations[r.parent(i)] if r.parent(i) >= 0 else stack(-r.gravity, ca.SX(3, 1)))
        own = r.S[i] @ r.v[r.cols[i]]
        vs.append(v + own)
        accelerations.append(a + r.S[i] @ qdd[r.cols[i]] + cross_motion(vs[i], own))
        forces.append(r.momentum(i, accelerations[i]) + cross_force(vs[i], r.momentum(i, vs[i])))
    for i in reversed(range(len(r))):
        tau[r.cols[i]] = r.S[i].T @ forces[i] + r.joints[i]['armature'] * qdd[r.cols[i]]
        if r.parent(i) >= 0:
            forces[r.parent(i)] += r.up(i, forces[i])
    return tau


def aba(r, tau):
    qdd, vs, bias, inertia, force = ca.SX(r.model['nv'], 1), [], [], [], []
    for i in range(len(r)):
        v = r.down(i, vs[r.parent(i)]) if r.parent(i) >= 0 else ca.SX(6, 1)
        own = r.S[i] @ r.v[r.cols[i]]
        vs.append(v + own)
        bias.append(cross_motion(vs[i], own))
        inertia.append(columns(lambda e: r.momentum(i, e), ca.SX.eye(6)))
        force.append(cross_force(vs[i], r.momentum(i, vs[i])))
    solved = [None] * len(r)
    for i in reversed(range(len(r))):
        U = inertia[i] @ r.S[i]
        D = r.S[i].T @ U + r.joints[i]['armature'] * ca.DM.eye(len(r.cols[i]))
        u = tau[r.cols[i]] - r.S[i].T @ force[i]
        solve = (lambda b, D=D: b / D) if D.shape[0] == 1 else (lambda b, D=D: ca.ldl_solve(b, *ca.ldl(D)))
        solved[i] = U, u, solve
        if r.parent(i) < 0:
            continue
        A = symmetric(inertia[i] - U @ solve(U.T))
        pushed = force[i] + A @ bias[i] + U @ solve(u)
        left = columns(lambda f: r.up(i, f), A)
        inertia[r.parent(i)] += symmetric(columns(lambda f: r.up(i, f), left.T))
        force[r.parent(i)] += r.up(i, pushed)
    accelerations = []
    for i in range(len(r)):
        U, u, solve = solved[i]
        a = r.down(i, accelerations[r.parent(i)] if r.parent(i) >= 0 else stack(-r.gravity, ca.SX(3, 1))) + bias[i]
        qdd[r.cols[i]] = solve(u - U.T @ a)
        accelerations.append(a + r.S[i] @ qdd[r.cols[i]])
    return qdd


def crba(r):
    n = r.model['nv']
    M, bodies = ca.SX(n, n), []
    for i in range(len(r)):  # mass, mass times centre, inertia about the origin
        mass, com, inertia = r.parts(i)
        bodies.append([mass, ca.SX(mass * com), ca.SX(inertia - mass * skew(com) @ skew(com))])
    for i in reversed(range(len(r))):
        mass, h, inertia = bodies[i]
        F = columns(lambda s: stack(mass * s[:3] + cross(s[3:], h), inertia @ s[3:] + cross(h, s[:3])), r.S[i])
        M[r.cols[i], r.cols[i]] = symmetric(r.S[i].T @ F) + r.joints[i]['armature'] * ca.DM.eye(len(r.cols[i]))
        j = i
        while r.parent(j) >= 0:
            F, j = columns(lambda f: r.up(j, f), F), r.parent(j)
            M[r.cols[j], r.cols[i]] = r.S[j].T @ F
            M[r.cols[i], r.cols[j]] = M[r.cols[j], r.cols[i]].T
        if r.parent(i) >= 0:
            R, p, to = r.R[i], r.p[i], bodies[r.parent(i)]
            moved = R @ h
            shift = 2 * ca.dot(p, moved) * ca.DM.eye(3) - p @ moved.T - moved @ p.T - mass * skew(p) @ skew(p)
            to[0], to[1] = to[0] + mass, to[1] + moved + mass * p
            to[2] = to[2] + symmetric(R @ inertia @ R.T + shift)
    return M


def id_derivatives(r, qdd):
    """In the world frame: all increments of a motion are seen by somebody who moves along."""
    n, N = r.model['nv'], len(r)
    R, p, v, a, J, dv, da, da_v, body, B, f = ([None] * N for _ in range(11))
    for i in range(N):
        k = r.parent(i)
        R[i], p[i] = (R[k] @ r.R[i], p[k] + R[k] @ r.p[i]) if k >= 0 else (r.R[i], r.p[i])
        v_k, a_k = (v[k], a[k]) if k >= 0 else (ca.SX(6, 1), stack(-r.gravity, ca.SX(3, 1)))
        J[i] = columns(lambda s: stack(R[i] @ s[:3] + cross(p[i], R[i] @ s[3:]), R[i] @ s[3:]), r.S[i])
        own = J[i] @ r.v[r.cols[i]]
        v[i] = v_k + own
        a[i] = a_k + J[i] @ qdd[r.cols[i]] + cross_motion(v[i], own)
        dv[i] = columns(lambda s: cross_motion(v_k, s), J[i])
        da[i] = columns(lambda s, d: cross_motion(a_k, s) + cross_motion(v_k, d), J[i], dv[i])
        da_v[i] = columns(lambda s, d: cross_motion(v[i], s) + d, J[i], dv[i])
        mass, com, inertia = r.parts(i)
        c = p[i] + R[i] @ com
        about = symmetric(R[i] @ inertia @ R[i].T - mass * skew(c) @ skew(c))
        body[i] = [mass, mass * c, about]
        momentum = apply(body[i], v[i])
        l, w, h = v[i][:3], v[i][3:], mass * c
        B[i] = [momentum[:3], skew(w) @ about - about @ skew(w) - skew(l) @ skew(h) - skew(h) @ skew(l)
                - skew(momentum[3:])]
        f[i] = apply(body[i], a[i]) + cross_force(v[i], momentum)
    dq, dqd, M = ca.SX(n, n), ca.SX(n, n), ca.SX(n, n)
    for i in reversed(range(N)):
        rate = lambda d: stack(-2 * cross(B[i][0], d[3:]), B[i][1] @ d[3:])
        Fq = columns(lambda x, d: apply(body[i], x) + rate(d), da[i], dv[i])
        Fv = columns(lambda x, s: apply(body[i], x) + rate(s), da_v[i], J[i])
        Fa = columns(lambda s: apply(body[i], s), J[i])
        own, j = r.cols[i], i
        while j >= 0:  # rows of body i by its ancestors, rows of the ancestors by body i
            if j != i:
                for row in range(len(own)):
                    s, seen = J[i][:, row], Fa[:, row]
                    turned = stack(ca.SX(3, 1), B[i][1].T @ s[3:] + 2 * cross(B[i][0], s[:3]))
                    dq[own[row], r.cols[j]] = seen.T @ da[j] + turned.T @ dv[j]
                    dqd[own[row], r.cols[j]] = seen.T @ da_v[j] + turned.T @ J[j]
            extra = columns(lambda s: cross_force(s, f[i]), J[i]) if j != i else 0
            dq[r.cols[j], own] = J[j].T @ (Fq + extra)
            dqd[r.cols[j], own] = J[j].T @ Fv
            M[r.cols[j], own] = J[j].T @ Fa
            M[own, r.cols[j]] = M[r.cols[j], own].T
            j = r.parent(j)
        M[own, own] = symmetric(M[own, own]) + r.joints[i]['armature'] * ca.DM.eye(len(own))
        if (k := r.parent(i)) >= 0:
            body[k] = [x + y for x, y in zip(body[k], body[i])]
            B[k] = [x + y for x, y in zip(B[k], B[i])]
            f[k] += f[i]
    return dq, dqd, M


def apply(body, m):
    mass, h, inertia = body
    return stack(mass * m[:3] + cross(m[3:], h), inertia @ m[3:] + cross(h, m[:3]))


def by_jacobian(r, _):
    tau = rnea(r, r.w)
    return tuple(ca.jacobian(tau, x) for x in (r.tangent, r.v, r.w))


def fd_derivatives(r, _):
    qdd = aba(r, r.w)
    inverse = ca.jacobian(qdd, r.w)
    dq, dqd, _ = id_derivatives(r, qdd)
    return -inverse @ dq, -inverse @ dqd, inverse


def id_hessian(r, _):
    return ca.hessian(ca.dot(r.mu, rnea(r, r.w)), stack(r.tangent, r.v, r.w))[0],


# Function and variant: inputs, results.
FUNCTIONS = {
    ('rnea', ''): ('qvw', lambda r, w: (rnea(r, w),)),
    ('aba', ''): ('qvw', lambda r, w: (aba(r, w),)),
    ('crba', ''): ('q', lambda r, w: (crba(r),)),
    ('minverse', ''): ('q', lambda r, w: (ca.substitute(ca.jacobian(aba(r, w), w), r.v, ca.DM.zeros(r.model['nv'])),)),
    ('id-derivatives', ''): ('qvw', by_jacobian),
    ('id-derivatives', 'analytic'): ('qvw', id_derivatives),
    ('fd-derivatives', 'analytic'): ('qvw', fd_derivatives),
    ('id-hessian', ''): ('qvwm', id_hessian),
}


def function_of(model, key):
    r = Robot(model)
    inputs, make = FUNCTIONS[key]
    results = [ca.substitute(y, r.step, ca.DM.zeros(*r.step.shape)) if r.steps else y for y in make(r, r.w)]
    return ca.Function('casadi_function', [{'q': r.q, 'v': r.v, 'w': r.w, 'm': r.mu}[x] for x in inputs],
                       [ca.sparsify(y) for y in results], {'cse': True})


def operations(f):
    free = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_PARAMETER}
    return sum(f.instruction_id(k) not in free for k in range(f.n_instructions()))
