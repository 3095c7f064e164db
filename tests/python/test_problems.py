# SPDX-License-Identifier: BSD-3-Clause
"""Problems of robots whose joints follow others, and what problems and tasks say before a solve."""

import shutil
import warnings

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, FINGERS

PANDA = CONFIG / "robots" / "panda.urdf"
READY = np.array([0, -0.5, 0, -2.0, 0, 1.5, 0.8, 0.01])


def test_a_joint_that_does_not_follow_warns_once_and_says_how():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        robot = dyntape.load(PANDA)
    assert len(told) == 1 and told[0].filename == __file__
    assert "mimic=True" in str(told[0].message) and 'joint "panda_finger_joint2" mimics' in str(told[0].message)
    assert str(told[0].message) in robot.notes
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dyntape.load(PANDA, mimic=True)
        dyntape.load(PANDA, lock=FINGERS)  # it does not move
        with pytest.raises(UserWarning):
            dyntape.load(PANDA)


def test_configurations_of_tied_joints():
    robot = dyntape.load(PANDA, mimic=True)
    q = robot.random(200, seed=3)
    assert q.shape == (200, 8) and np.ptp(q[:, 7]) > 0.02
    assert (q >= robot.lower_limits).all() and (q <= robot.upper_limits).all()
    v = np.linspace(-0.1, 0.1, 8)
    moved = robot.integrate(q, v)
    assert np.allclose(moved, q + v, atol=1e-15) and np.allclose(robot.difference(q, moved), np.tile(v, (200, 1)), atol=1e-15)
    assert np.array_equal(robot.neutral(), np.zeros(8))
    assert np.isfinite(robot.rnea(q, 0 * q, 0 * q)).all()


@pytest.mark.parametrize("form", ["forward", "inverse"])
def test_the_fingers_of_a_problem_are_tied(form):
    robot = dyntape.load(PANDA, mimic=True)
    p = robot.problem(0.8, form=form)
    assert len(p.states) == 16 and len(p.controls) == 8 and "q.panda_finger_joint2" not in p.states
    p.start_at(READY)
    goal = READY + np.array([0.2, 0.1, 0, 0.2, 0, 0, 0, 0.02])
    p.end_at(goal)
    p.add_squares("effort", lambda s: s.u, weight=0.1)
    p.limit_positions()
    p.limit_velocities()
    p.limit_efforts()
    s = p.solve()
    assert s.success, s.verdict
    assert s.q.shape[1] == robot.nq
    np.testing.assert_allclose(s.q[-1], goal, atol=1e-7)
    # The dynamics of the robot whose finger follows, by another route.
    if form == "inverse":
        torque = robot.rnea(s.q, s.v, s.a)[1:]  # Radau's scheme does not use the first point
        np.testing.assert_allclose(torque, s.u[1:], atol=1e-7 * np.abs(s.u).max())
    else:
        times = np.linspace(0.1, 0.7, 25)
        slopes = (s.at(times + 1e-5).x[:, 8:] - s.at(times - 1e-5).x[:, 8:]) / 2e-5
        between = s.at(times)
        off = np.abs(robot.aba(between.x[:, :8], between.x[:, 8:], between.u) - slopes).max(axis=1)
        assert np.median(off) < 1e-2 * np.abs(slopes).max()
    assert "<canvas" in s.page()


def test_both_forms_of_a_tied_problem_have_one_optimum():
    robot = dyntape.load(PANDA, mimic=True)
    costs = []
    for form in ("forward", "inverse"):
        p = robot.problem(0.5, form=form)
        p.start_at(READY)
        p.end_at(READY + 0.02)
        p.add_squares("effort", lambda s: s.u)
        s = p.solve()
        assert s.success, s.verdict
        costs.append(s.cost)
    np.testing.assert_allclose(costs[0], costs[1], rtol=1e-4)


def test_terms_see_the_finger_that_follows():
    robot = dyntape.load(PANDA, mimic=True)
    p = robot.problem(0.5, form="inverse")
    p.start_at(READY)
    p.add_squares("effort", lambda s: s.u, weight=0.01)
    # Of the second finger: 0.025 m of its own, which only the first can give.
    wide = READY.copy()
    wide[7] = 0.025
    place = robot.frame_placement(wide, frame="panda_rightfinger").p
    p.add_equality("wide", p.frame_error("panda_rightfinger", place), where="end")
    p.end_at()
    s = p.solve()
    assert s.success, s.verdict
    np.testing.assert_allclose(robot.frame_placement(s.q[-1], frame="panda_rightfinger").p, place, atol=1e-6)
    found = p.inverse_kinematics("panda_hand", robot.frame_placement(READY + 0.1, frame="panda_hand").p)
    assert found.shape == (8,)


def test_a_leader_keeps_the_limits_of_its_follower_in_problems():
    text = PANDA.read_text()
    at = text.index("panda_finger_joint2")
    limit = text.index('upper="0.04"', at)
    robot = dyntape.load_text(text[:limit] + 'upper="0.02"' + text[limit + 12 :], mimic=True)
    p = robot.problem(0.5, form="inverse")
    p.start_at(READY)
    p.end_at()
    p.limit_positions()
    p.add_squares("open", lambda s: s.q[7] - 0.04, weight=1000)
    p.add_squares("effort", lambda s: s.u, weight=1e-3)
    s = p.solve()
    assert s.success, s.verdict
    assert 0.0195 < s.q[:, 7].max() < 0.02 + 1e-6


def test_a_follower_has_no_motor():
    robot = dyntape.load(PANDA, mimic=True)
    with pytest.raises(dyntape.ArgumentError, match='"panda_finger_joint2" follows "panda_finger_joint1"'):
        robot.problem(1, driven=["panda_joint1", "panda_finger_joint2"])


# --- What problems say of themselves ---


def test_what_is_not_finite_is_told_by_its_line():
    def root(s):
        shift = s.x[0] - 2
        return np.sqrt(shift)  # HERE

    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.start, p.goal = [0, 0], [1, 0]
    p.add_squares("effort", lambda s: s.u)
    p.add_cost("root", root)
    line = next(k for k, text in enumerate(open(__file__), 1) if text.rstrip().endswith("# HERE"))
    p_ddp = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p_ddp.start = [0, 0]
    p_ddp.add_squares("effort", lambda s: s.u)
    p_ddp.add_cost("root", root)
    for solve in p.solve, p_ddp.solve_ddp:
        with pytest.raises(dyntape.NumericalError) as told:
            solve(10)
        assert f'{__file__}:{line}: sqrt of -2 is no number, in "root"' in str(told.value)
        assert "node" not in str(told.value)


def test_what_has_no_slope_is_told_by_its_line():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.start, p.goal = [0, 0], [1, 0]
    p.add_squares("effort", lambda s: s.u)
    p.add_cost("length", lambda s: np.sqrt(s.x[0] ** 2 + s.x[1] ** 2))
    with pytest.raises(dyntape.NumericalError, match=r"test_problems.py:\d+: sqrt of 0 has no slope, in \"length\".*write norm"):
        p.solve(10)


def test_a_quotient_is_told_with_its_numbers():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0] / s.x[0]])
    p.start, p.goal = [0, 0], [1, 0]
    p.add_squares("effort", lambda s: s.u)
    with pytest.raises(dyntape.NumericalError, match=r"test_problems.py:\d+: 0 / 0 is no number, in \"block: rate\""):
        p.solve(10)


def test_a_problem_in_a_notebook():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.start = [0, 0]
    p.bound_controls(-3, 3)
    p.add_squares("effort <b>", lambda s: s.u)
    p.add_inequality("low", lambda s: s.x[0], 0, where=0.5)
    assert p.terms == [("effort <b>", "running", "squares"), ("low", "0.5 of the duration", "inequality")]
    assert p.control_bounds[0] == [-3] and np.isinf(p.state_bounds[1]).all()
    page = p._repr_html_()
    assert "<td>free</td>" in page and "effort &lt;b&gt;" in page and "<td>-3</td>" in page
    assert page.count("<table>") == page.count("</table>") == 3


def test_functions_that_refer_to_their_problem_are_collected():
    import gc
    import weakref

    class Mark:
        pass

    def make():
        mark, p = Mark(), dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
        p.add_cost("own", lambda s: s.u[0] ** 2 + 0 * len(p.states) * bool(mark))
        return weakref.ref(mark)

    mark = make()
    gc.collect()
    assert mark() is None


# --- Tasks that cannot be met ---


def warned(task, **settings):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        dyntape.solve(CONFIG / "tasks" / task, set={"solver.max_iterations": 1, **settings})
    return [str(w.message) for w in told]


def test_weak_motors_are_told_before_the_solve():
    assert not [s for s in warned("quadruped_jump.info") if "motors" in s]
    told = [s for s in warned("quadruped_jump.info", **{"bounds.efforts": 0.3}) if "motors cannot hold" in s]
    assert len(told) == 1 and "N m at least, and its limit is 0.3" in told[0]


def test_weak_motors_of_a_problem_are_told():
    arm = dyntape.load(CONFIG / "robots" / "arm_2r.urdf")
    p = arm.problem(1)
    p.start_at([0.3, 0.2])
    p.add_effort()
    for limit, told in (1.0, 1), (1e3, 0):
        p.bound_controls(-limit, limit)
        for solve in p.solve, p.solve_ddp:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                solve(4, max_iterations=1)
            weak = [str(w.message) for w in said if "motors cannot hold the robot at rest: 'shoulder'" in str(w.message)]
            assert len(weak) == told and all("and its limit is 1.00 N m" in sentence for sentence in weak)


def test_a_swing_clears_its_way():
    """The hand goes over the straight line, by what is asked for, and without it below."""
    arm = dyntape.load(CONFIG / "robots" / "arm_2r.urdf")
    ends = np.array([[-0.6, 1.0], [-1.2, 1.9]])
    first, last = arm.frame_placement(ends, frame="hand").p
    room = {}
    for clearance in 0, 0.05:
        p = arm.problem(1, form="inverse")
        p.start_at(ends[0])
        p.end_at(ends[1])
        p.add_accelerations()
        if clearance:
            p.swing_clearance("hand", first, last, clearance)
        motion = p.solve(40)
        assert motion.success, motion.verdict
        off = arm.frame_placement(motion.q, frame="hand").p - first
        s = off[:, 0] / (last - first)[0]
        room[clearance] = (off[:, 2] - s * (last - first)[2] - 4 * 0.05 * s * (1 - s)).min()
    assert room[0] < -5e-3 and room[0.05] > -1.1e-3
    with pytest.raises(dyntape.ArgumentError, match="a clearance above 0"):
        p.swing_clearance("hand", first, last, -1)
    with pytest.raises(dyntape.ArgumentError, match="hnd"):
        p.swing_clearance("hnd", first, last, 0.1)


def test_a_swing_clears_its_way_between_points():
    """On a coarse mesh too, or the motion is not called verified."""
    arm = dyntape.load(CONFIG / "robots" / "arm_2r.urdf")
    ends = np.array([[-0.6, 1.0], [-1.2, 1.9]])
    first, last = arm.frame_placement(ends, frame="hand").p
    low = []
    for intervals in 4, 6, 10, 20, None:
        p = arm.problem(1, form="inverse")
        p.start_at(ends[0])
        p.end_at(ends[1])
        p.add_accelerations()
        p.swing_clearance("hand", first, last, 0.05)
        motion = p.solve(intervals)
        q = motion.at(np.linspace(0, 1, 2001)).q
        off = arm.frame_placement(q, frame="hand").p - first
        s = off[:, 0] / (last - first)[0]
        inside = (s > 0.1) & (s < 0.9)
        least = (off[:, 2] - s * (last - first)[2] - 4 * 0.05 * s * (1 - s))[inside].min()
        assert least > -6e-5 or not motion.success, (intervals, least)
        low.append(least)
        if not motion.success:
            assert any("hand clears its way" in text for text in motion.passings), motion.verdict
    assert min(low) < -6e-5  # which a coarse mesh would have passed
    assert motion.success and low[-1] > -6e-5


def test_footholds_out_of_reach_are_told_in_metres(tmp_path):
    text = (CONFIG / "tasks" / "quadruped_jump.info").read_text().replace("../robots", str(CONFIG / "robots"))

    def notes(offset):
        changed = text.replace("phase landing {", "phase landing { foothold_offset { FL_FOOT \"" + offset + "\" }")
        (tmp_path / "jump.info").write_text(changed)
        return warned(tmp_path / "jump.info")

    assert not [s for s in notes("0.05 0 0") if "foothold" in s]
    far = notes("1.5 0 0")
    assert any("phase 'landing': no configuration" in s and "misses one by" in s and " m" in s for s in far)
    below = notes("0 0 -0.15")
    assert any("the foothold of 'FL_FOOT' is 0.150 m below the floor" in s for s in below)


def said_before(p, solve="solve"):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        getattr(p, solve)(2, max_iterations=1)
    return [str(w.message) for w in said]


def test_targets_of_a_problem_out_of_reach_are_told_in_metres():
    arm = dyntape.load(CONFIG / "robots" / "arm_2r.urdf")
    q = arm.random(2000, seed=4)
    hand = arm.frame_placement(q, frame="hand").p
    reach = abs(hand).max(axis=0)
    axis = int(reach.argmax())
    start = q[hand[:, axis].argmax()]

    def told(position, where, solve="solve", bounds=None):
        p = arm.problem(1)
        p.start_at(start if bounds is None else sum(bounds) / 2)
        p.limit_positions()
        if bounds is not None:
            p.bound_states([*bounds[0], -9, -9], [*bounds[1], 9, 9])
        p.add_effort()
        p.add_equality("there", p.frame_error("hand", position), where=where)
        return [s for s in said_before(p, solve) if "hand" in s]

    away = np.zeros(3)
    away[axis] = 5.0
    away += arm.frame_placement(start, frame="hand").p * (np.arange(3) != axis)
    for where, head in ("end", "at the end: "), (0.5, "at 0.5 of the duration: "), ("running", "all along: "):
        (sentence,) = told(away, where)
        assert sentence.startswith(head + "no configuration within the limits of the joints was found in which 'hand' is at its target; ")
        missed = float(sentence.split(" by ")[1].split(" m")[0])
        assert missed == pytest.approx(5.0 - reach[axis], abs=0.02)
    for k in range(0, 2000, 100):  # what it reaches is not told
        assert not told(hand[k], "end")
    near = q[7]
    assert not told(hand[7], "end", bounds=(near - 0.1, near + 0.1))
    assert told(hand[7], "end", bounds=(near + [0.3, 0.3], near + [0.4, 0.4]))  # the problem's own bounds


def test_clearances_out_of_reach_are_told(solo):
    arm = dyntape.load(CONFIG / "robots" / "arm_2r.urdf")
    ends = np.array([[-0.6, 1.0], [-1.2, 1.9]])
    first, last = arm.frame_placement(ends, frame="hand").p

    def told(robot, frame, first, last, clearance):
        p = robot.problem(1)
        p.start_at(robot.neutral())
        p.swing_clearance(frame, first, last, clearance)
        p.add_effort()
        return [s for s in said_before(p) if s.startswith("swing_clearance of ")]

    assert not told(arm, "hand", first, last, 0.05)
    (far,) = told(arm, "hand", first, last, 5)
    assert "swing_clearance of 'hand' by 5.00 m: halfway no configuration" in far
    foot = solo.frame_placement(solo.neutral(), frame="FL_FOOT").p
    assert not told(solo, "FL_FOOT", foot, foot + [0.1, 0, 0], 0.1)
    (high,) = told(solo, "FL_FOOT", foot, foot + [0.1, 0, 0], 5)
    assert "in 1.00 s it comes to less than 2." in high


def test_a_swing_of_a_floating_robot_without_contacts_is_told(solo):
    foot = solo.frame_placement(solo.neutral(), frame="FL_FOOT").p

    def told(p):
        p.start_at(solo.neutral())
        p.swing_clearance("FL_FOOT", foot, foot + [0.05, 0, 0], 0.02)
        p.add_effort()
        return [s for s in said_before(p) if "has no contacts" in s]

    (sentence,) = told(solo.problem(1))
    assert sentence.startswith("swing_clearance: 'solo12' floats, and this problem has no contacts, so that it falls; expected")
    assert not told(dyntape.Scene(CONFIG / "scenes" / "solo12_compliant_floor.info").problem(1))


def test_footholds_of_a_problem_are_told(solo):
    foot = "FL_FOOT"
    q = solo.neutral()
    q[2] = 0.3
    q[7:] = np.tile([0.0, 0.8, -1.6], 4)
    stands = solo.frame_placement(q, frame=foot).p

    def told(end, **options):
        p = solo.problem(1, form="inverse")
        p.start_at(q)
        p.add_effort()
        p.swing_clearance(foot, stands, stands + end, 0.05, **options)
        return [s for s in said_before(p) if foot in s]

    assert not told([0.05, 0, 0])
    (below,) = told([0.05, 0, -0.15 - stands[2]])
    assert below == "the foothold of 'FL_FOOT' is 0.150 m below the floor, which is at z = 0 m"
    assert not told([0.05, 0, -0.15 - stands[2]], floor=-0.2)
    (below,) = told([0.05, 0, 0.1], floor=stands[2] + 0.3)
    assert "is 0.200 m below the floor" in below
    scene = dyntape.Scene(CONFIG / "scenes" / "solo12_compliant_floor.info")
    p = scene.problem(1)
    p.add_equality("foot", p.frame_error(foot, [0.2, 0.1, -0.05]), where="end")
    assert "the target of 'FL_FOOT' is 0.0500 m below the floor, which is at z = 0 m" in said_before(p)
    p = solo.problem(1, form="inverse")
    p.start_at(q)
    for name in foot, "HR_FOOT":  # a foot each can be there, but not both at once
        p.add_equality(name, p.frame_error(name, stands), where="end")
    ends = solo.frame_placement(q, frame="HR_FOOT").p - stands
    p.add_equality("apart", p.frame_error("FR_FOOT", stands + 3 * ends), where="end")
    assert any("'FL_FOOT', 'HR_FOOT', 'FR_FOOT' are at their targets; the nearest misses one by" in s for s in said_before(p))


@pytest.mark.skipif(not shutil.which("gnuplot"), reason="gnuplot draws them")
def test_pictures_say_what_they_show(tmp_path):
    dyntape.sweep(CONFIG / "sweeps" / "pendulum_amplitudes.info", tmp_path / "grid", set={"samples": 1})
    grid = (tmp_path / "grid" / "sweep.svg").read_text()
    assert "q.hinge [rad]" in grid and "samples" not in grid  # a histogram would tell where the grid is
    dyntape.sweep(CONFIG / "sweeps" / "quadruped_dropped.info", tmp_path / "random", set={"samples": 20})
    random = (tmp_path / "random" / "sweep.svg").read_text()
    assert "start.base.position.z [m]" in random and "q2, base z [m]" in random and "samples" in random
    scene = dyntape.Scene(CONFIG / "scenes" / "quadruped_on_floor.info", set={"simulation.duration": 0.2})
    forces = scene.simulate().plot()["forces"]
    assert forces.count("rigid contact at FL_FOOT") == 1 and "sideways" in forces
    jump = dyntape.solve(CONFIG / "tasks" / "quadruped_jump.info").plot()
    assert "z + 0.35 y [m]" in jump["motion"] and "limit" in jump["trajectory"]


def test_a_start_that_a_constraint_excludes_is_told_before_a_solve():
    p = dyntape.Problem("cart", ["x", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.start, p.goal = [0, 0], [1, 0]
    p.add_squares("effort", lambda s: s.u)
    p.add_inequality("clear", lambda s: [s.x[1] + 5, (s.x[0] + 0.1) ** 2 - 0.04], 0)
    p.add_inequality("push", lambda s: s.u[0] - 3 * s.x[0], -100, 100)
    with pytest.warns(UserWarning, match=r'the start contradicts "clear": clear\[1\] is -0.03000 there, expected at least 0'):
        p.solve(5, max_iterations=3)
    q = dyntape.Problem("cart", ["x", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    q.start, q.goal = [0, 0], [1, 0]
    q.add_squares("effort", lambda s: s.u)
    q.add_inequality("push", lambda s: s.u[0], 0.5, 100)  # the controls decide
    q.add_inequality("edge", lambda s: s.x[0], 0)  # and the start is on its boundary
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        q.solve(5, max_iterations=3)


def test_a_duration_in_which_no_joint_gets_there_is_told_before_a_solve():
    hinge = (
        '<robot name="door"><link name="base"/><joint name="hinge" type="revolute"><parent link="base"/><child link="leaf"/>'
        '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="100" velocity="5"/></joint><link name="leaf"><inertial>'
        '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    said = "'hinge' has to move 2.00 rad in 0.0500 s, and its velocity limit allows 0.250 rad"
    for duration in (0.05, 0.5):
        p = dyntape.load_text(hinge).problem(duration)
        p.start_at([0.5]), p.end_at([-1.5])
        p.limit_velocities(), p.add_effort(1)
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            p.solve(4, max_iterations=2)
        assert [str(w.message) for w in told] == ([said] if duration < 0.1 else [])


def test_a_duration_of_a_task_file_is_checked_too():
    quick = [s for s in warned("arm_reaching.info", **{"horizon.duration": 0.01, "bounds.velocities": 1}) if "has to move" in s]
    assert len(quick) == 1 and "in 0.0100 s, and its velocity limit allows 0.0100 rad" in quick[0]
    assert not [s for s in warned("arm_reaching.info") if "has to move" in s]
