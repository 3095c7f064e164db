# SPDX-License-Identifier: BSD-3-Clause
"""Wrong calls end in one sentence with the name of the argument; displays and equality of functions."""

import pathlib
import re
import warnings

import numpy as np
import pytest

import dyntape

ARM = dyntape.load(dyntape.config_folder() / "robots" / "ur5.urdf")
SCENE = dyntape.config_folder() / "scenes" / "pendulum.info"


def square():
    return dyntape.record(lambda x: x * x, 2)


def car(goal=(1.0,)):
    p = dyntape.Problem("car", ["x"], ["u"], 1.0, lambda s: s.u)
    p.add_squares("effort", lambda s: s.u)
    p.start, p.goal = [0.0], goal
    return p


WRONG = [
    (lambda: ARM.rnea(None, None, None), "Robot.rnea: q is None; expected an array of numbers"),
    (lambda: ARM.rnea(np.zeros(6)), "Robot.rnea needs v and a: Robot.rnea(q, v, a, *, route, device, single)"),
    (lambda: ARM.rnea(q=np.zeros(6), w=1), 'has no argument "w"'),
    (lambda: ARM.rnea(np.zeros(6), np.zeros(6), np.zeros(6), rout="tape"), 'did you mean "route"?'),
    (lambda: ARM.rnea(np.zeros(6), np.zeros(6), np.zeros(6), "tape"), "expected at most 3"),
    (lambda: ARM.rnea(np.zeros(6), np.zeros(6), np.zeros(6), q=1), "given twice"),
    (lambda: ARM.random(-3), "Robot.random: count is -3; expected int | None, not negative"),
    (lambda: ARM.random(2.5), "count is 2.5; expected int | None"),
    (lambda: dyntape.record(lambda x: x, -2), "record: n_x is -2; expected int, not negative"),
    (lambda: dyntape.record(3, 2), "record: f is 3; expected Callable"),
    (lambda: dyntape.record(lambda x: x), "record needs n_x"),
    (lambda: dyntape.load(), "load needs file"),
    (lambda: dyntape.record(lambda x: x, 2**70), "record: n_x is 1180591620717411303424; expected int, below 2**63"),
    (lambda: dyntape.Function.jacobian(3, [1, 2]), "Function.jacobian: expected a Function before the arguments, got int"),
    (lambda: dyntape.Problem("car", ["x"], ["u"], "long", lambda s: s.u), "duration is 'long'; expected float"),
]


def bounded(*bounds):
    p = car()
    p.bound_states(*bounds)
    return p


def held():
    p = ARM.problem(1)
    p.add_squares("effort", lambda s: s.u)
    p.start_at(np.zeros(6))
    return p


def plain_car():
    p = dyntape.Problem("car", ["x"], ["u"], 1.0, lambda s: s.u)
    p.add_cost("effort", lambda s: s.u[0] ** 2)
    p.start = [0.0]
    return p


WRONG += [
    (lambda: car().solve(2**80), "Problem.solve: intervals is 1208925819614629174706176; expected int | None, below 2**63"),
    (lambda: car().solve(2**40), "Problem.solve: intervals is 1099511627776; expected int | None, below 2**31"),
    (lambda: car().solve(4, max_iterations=2**80), "Problem.solve: max_iterations is 1208925819614629174706176; expected int, below 2**63"),
    (lambda: dyntape.Mpc(car(), intervals=2**80), "Mpc: intervals is 1208925819614629174706176; expected int, below 2**63"),
    (lambda: dyntape.Mpc(car(), iterations=2**40), "Mpc: iterations is 1099511627776; expected int, below 2**31"),
    (lambda: ARM.random(2**80), "Robot.random: count is 1208925819614629174706176; expected int | None, below 2**63"),
    (lambda: ARM.random(3, seed=2**80), "Robot.random: seed is 1208925819614629174706176; expected int, below 2**63"),
    (lambda: dyntape.Scene(SCENE).rollout([0, 0], policy=lambda x: x),
     "Scene.rollout: policy: got a Python function; expected a recorded one, dyntape.record(f, nx, n_parameters)"),
]


WRONG += [
    (lambda: dyntape.simulate(SCENE, set=["simulation.duration=1"]), "set: expected a dictionary, {\"simulation.duration\": 2}, got <class 'list'>"),
    (lambda: car().solve(4, tolerence=1e-6), 'Problem.solve has no argument "tolerence"; did you mean "tolerance"?'),
    (lambda: car().solve(4, tolerance="fine"), "Problem.solve: tolerance is 'fine'; expected float"),
    (lambda: car().solve(4, max_iterations=2.5), "Problem.solve: max_iterations is 2.5; expected int"),
]


@pytest.mark.parametrize(
    "options, message",
    [
        ({"tolerance": -1}, "solve: tolerance must be positive, got -1"),
        ({"tolerance": float("nan")}, "solve: tolerance must be finite, got nan"),
        ({"max_iterations": -1}, "solve: max_iterations must be zero or more, got -1"),
        ({"print_level": 13}, "solve: print_level must be between 0 and 12, got 13"),
        ({"barrier_update": "up"}, 'solve: barrier_update: expected "adaptive" or "monotone", got "up"'),
        ({"hessian": "newton"}, 'solve: hessian: expected "exact", "gauss_newton" or "limited_memory", got "newton"'),
    ],
)
def test_options_of_the_solver_have_the_ranges_of_files(options, message):
    with pytest.raises(dyntape.ArgumentError, match=f"^{re.escape(message)}$"):
        plain_car().solve(4, **options)


def test_options_of_the_solver_have_the_names_of_files():
    page = (pathlib.Path(__file__).resolve().parents[2] / "docs/reference/task_keys.md").read_text()
    block = re.search(r"^  solver +the solver.*?(?=^  \S)", page, re.M | re.S).group()
    names = set(re.findall(r"^    (\w+) ", block, re.M)) - {"check_derivatives", "ipopt"}
    assert len(names) >= 9
    assert names <= set(re.findall(r"(\w+): ", dyntape.Problem.solve.__nb_signature__[0][0]))


LONG = 10**400
WRONG += [
    (lambda: ARM.random(LONG), "Robot.random: count is 10000000000000000000... (401 digits); expected int | None, below 2**63"),
    (lambda: ARM.random(-LONG), "Robot.random: count is -10000000000000000000... (401 digits); expected int | None, not negative"),
    (lambda: ARM.random(10**5000 - 1), "count is 99999999999999999999... (5000 digits); expected"),
    (lambda: dyntape.Problem("car", ["x"], ["u"], LONG, lambda s: s.u), "duration is 10000000000000000000... (401 digits); expected float, below 1.8e308"),
    (lambda: dyntape.Problem("car", ["x"], ["u"], "x" * 500, lambda s: s.u), "duration is 'xxxxxxxxxxxxxxxxxxx... (500 characters); expected float"),
]


@pytest.mark.parametrize("call, sentence", WRONG, ids=[sentence for _, sentence in WRONG])
def test_a_wrong_call_is_one_sentence(call, sentence):
    with pytest.raises(TypeError) as error:
        call()
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)
    assert "incompatible function arguments" not in str(error.value)


def test_a_type_error_of_the_users_code_passes_through():
    def wrong(x):
        raise TypeError("incompatible in my own words")

    with pytest.raises(TypeError, match="^incompatible in my own words$"):
        dyntape.record(wrong, 2)


def test_errors_of_other_libraries_pass_through():
    text = "frob(): incompatible function arguments. The following argument types are supported: none"

    def wrong(x):
        raise TypeError(text)

    for call in (lambda: dyntape.record(wrong, 2), lambda: dyntape.Problem("p", ["x"], ["u"], 1.0, wrong)):
        with pytest.raises(TypeError) as error:
            call()
        assert str(error.value) == text

    def wrong_in_our_words(x):
        raise TypeError("record(): incompatible function arguments")

    with pytest.raises(TypeError, match="^record..: incompatible function arguments$"):
        dyntape.record(wrong_in_our_words, 2)


def test_entries_that_numpy_did_not_write_are_refused():
    empty = np.add(np.array([1.0, 2.0], dtype=object), 1, where=[True, False])
    with pytest.raises(dyntape.ArgumentError):
        square()(empty)
    with pytest.raises(dyntape.ArgumentError):
        dyntape.record(lambda x: np.add(x, 1, where=[True, False, True]), 3)


@pytest.mark.parametrize(
    "call, name",
    [
        (lambda x: np.interp(x[0], [0, 1], [0, 1]), "np.interp"),
        (lambda x: np.fft.fft(x), "fft"),
        (lambda x: np.linalg.matrix_rank(x.reshape(1, 2)), "np.linalg"),
    ],
)
def test_what_cannot_be_recorded_is_named(call, name):
    with pytest.raises((dyntape.RecordingError, dyntape.ArgumentError)) as error:
        dyntape.record(call, 2)
    assert name in str(error.value)


def test_a_recording_point_outside_of_a_domain_does_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        f = dyntape.record(lambda x: np.sqrt(x - 5) + np.log(x - 5) + np.divide(1, x - x[0]), 2)
        assert np.isnan(f([1.0, 2.0])).all()


@pytest.mark.parametrize(
    "call",
    [
        lambda x: np.outer(x, x),
        lambda x: np.stack([x, x]),
        lambda x: np.dot(np.eye(2), x),
        lambda x: np.einsum("i,j->ij", x, x),
        lambda x: np.split(x, 2)[0],
        lambda x: np.cross(np.append(x, 0), np.append(x, 1)),
    ],
)
def test_results_of_numpy_are_recorded_arrays(call):
    """Their maximum leaves no guard."""
    f = dyntape.record(lambda x: np.maximum(call(x), 0.5).ravel(), 2, x0=[1.0, 1.0])
    for x in ([0.1, 0.1], [1.5, 0.3]):
        assert f(x) == pytest.approx(np.maximum(call(np.array(x)), 0.5).ravel())


def test_degrees_and_radians():
    f = dyntape.record(lambda x: np.concatenate([np.deg2rad(x), np.degrees(x), np.fabs(x)]), 2)
    x = np.array([-30.0, 0.5])
    assert f(x) == pytest.approx(np.concatenate([np.deg2rad(x), np.degrees(x), np.fabs(x)]), rel=1e-15)


def test_bools_and_masked_entries_are_refused():
    f = square()
    with pytest.raises(dyntape.ArgumentError, match="bools"):
        f(np.array([True, False]))
    with pytest.raises(dyntape.ArgumentError, match="bools"):
        f([True, False])
    with pytest.raises(dyntape.ArgumentError, match="masked"):
        f(np.ma.array([1.0, 2.0], mask=[False, True]))
    assert np.array_equal(f(np.ma.array([1.0, 2.0])), [1, 4])
    with pytest.raises(dyntape.ArgumentError, match="bools"):
        ARM.rnea(np.zeros(6, dtype=bool), np.zeros(6), np.zeros(6))


def test_an_object_array_of_numbers_is_numbers():
    assert np.array_equal(square()(np.array([1.0, 2], dtype=object)), [1, 4])
    q = np.full(6, 0.1)
    zero = np.zeros(6)
    assert np.array_equal(ARM.rnea(q.astype(object), zero, zero), ARM.rnea(q, zero, zero))


def test_a_missing_file_of_a_shipped_name_points_to_the_folder():
    with pytest.raises(dyntape.FileError, match=re.escape('dyntape.config_folder() / "robots/ur5.urdf"')):
        dyntape.load("ur5.urdf")
    with pytest.raises(dyntape.FileError, match="^nothing.urdf: "):
        dyntape.load("nothing.urdf")


def test_functions_that_compute_the_same_are_equal():
    f, g, h = square(), square(), dyntape.record(lambda x: x + x, 2)
    assert f == g and hash(f) == hash(g) and len({f, g, h}) == 2
    assert f != h and f != 3 and f != None  # noqa: E711


def test_a_folder_that_cannot_be_made_is_a_file_error():
    with pytest.raises(dyntape.FileError, match="^/proc/nothing: "):
        dyntape.simulate(SCENE).write("/proc/nothing")


def test_classes_have_public_names():
    import pickle

    for name in dyntape.__all__:
        value = getattr(dyntape, name)
        if isinstance(value, type):
            assert not value.__module__.endswith("_dyntape"), value
    assert repr(dyntape.Robot) == "<class 'dyntape.Robot'>"
    assert pickle.loads(pickle.dumps(square()))([1.0, 2.0]).tolist() == [1, 4]
    assert pickle.loads(pickle.dumps(ARM)).nq == 6


def test_all_results_have_a_display():
    p = car()
    step = dyntape.Mpc(p).step(0.0, [0.0])
    free = car(goal=[np.nan])
    free.add_squares("there", lambda s: s.x - 1, where="end")
    results = [step, p.solve(4), free.solve_ddp(4), dyntape.Scene(SCENE), dyntape.simulate(SCENE)]
    results += [dyntape.control(CONTROL), dyntape.Task(dyntape.config_folder() / "tasks" / "block_move.info")]
    batch = free.ddp(4).solve_batch(np.zeros((3, 1)))
    pages = [r._repr_html_() for r in [*results, batch]]
    assert all(len(page) > 100 for page in pages)
    assert pages[0].count("<polyline") == 2 and "usable" in pages[0]
    random = np.random.default_rng(0)
    q, v, a = ARM.random(400), random.normal(size=(400, 6)), random.normal(size=(400, 6))
    found = ARM.identify(q, v, a, ARM.rnea(q, v, a) + 1e-3 * random.normal(size=(400, 6)))
    assert found._repr_html_().count("<tr>") == len(found.names) + 1


def test_displays():
    page = square()._repr_html_()
    assert "Jacobian: 2 of 4" in page and page.count("<rect") == 4
    page = ARM._repr_html_()
    assert page.count("<tr>") == 7 and "shoulder_pan_joint" in page
    dog = dyntape.load(dyntape.config_folder() / "robots" / "solo12.urdf", base="floating")
    assert dog._repr_html_().count("<tr>") == 14


@pytest.mark.parametrize("value", [-10**400, "9" * 5000, 10**400])
def test_long_numbers_are_told_by_their_beginning(value):
    with pytest.raises(dyntape.FileError) as told:
        dyntape.simulate(dyntape.config_folder() / "scenes" / "pendulum.info", set={"simulation.duration": value})
    assert len(str(told.value)) < 300 and "characters)" in str(told.value)


# --- A wrong value of a file is one sentence, which holds ---

CONTROL = dyntape.config_folder() / "control" / "arm_holds.info"


@pytest.mark.parametrize(
    "file, key, value, sentence",
    [
        (SCENE, "effects", "abc", "'effects' is a block, which takes no value 'abc'"),
        (SCENE, "effects.gravity.vector", "abc", "'vector' must hold numbers, got 'abc'"),
        (SCENE, "effects.gravity.vector", 3, "'vector' has 1 number, expected three"),
        (SCENE, "effects.gravity.vector", LONG, "'vector' must hold numbers, got '10000000000000000000... (401 characters)'"),
        (CONTROL, "mpc.period", "abc", "'mpc.period' expects a number, got 'abc'"),
        (CONTROL, "mpc.period", -1, "'mpc.period' must be positive, got '-1'"),
    ],
)
def test_a_wrong_setting_is_one_sentence(file, key, value, sentence):
    with pytest.raises(dyntape.FileError) as error:
        (dyntape.Scene if file is SCENE else dyntape.control)(file, set={key: value})
    assert str(error.value).startswith(f"--set {key}: {sentence}") and "\n" not in str(error.value)


def test_a_setting_that_opens_a_block_does_not_deny_itself():
    with pytest.raises(dyntape.FileError) as error:
        dyntape.Scene(SCENE, set={"constraints.contacts.contact.normal": "abc"})
    lines = str(error.value).split("\n")
    assert len(lines) == 2 and "'normal' must hold numbers" in lines[1] and "frames' is missing" in lines[0]
    with pytest.raises(dyntape.FileError) as error:
        dyntape.solve(dyntape.config_folder() / "tasks" / "two_link_arm_reaching.info", set={"thrusters.thruster.upper": 1})
    assert "'thrusters.thruster.frame' is missing" in str(error.value) and "is empty" not in str(error.value)


REFUSED = [
    (lambda: dyntape.Problem("car", ["x", "x"], ["u"], 1.0, lambda s: s.x), '"x" is given twice, expected a name of its own'),
    (lambda: dyntape.Problem("car", ["x"], ["x"], 1.0, lambda s: s.u), '"x" is given twice, expected a name of its own'),
    (lambda: car().add_inequality("wide", lambda s: s.x), 'add_inequality("wide"): expected a lower or an upper bound'),
    (lambda: car(goal=[np.inf]).solve(4), "or NaN for a free entry"),
    (lambda: dyntape.record(lambda x: x if x[0] > 0 else -x, 1, branches="error"), "use dyntape.where(condition, a, b)"),
    (lambda: dyntape.Mpc(car()).sensitivities(), "expected a step before that"),
    (lambda: ARM.random(2**62), "Robot.random: count is 4611686018427387904, which no memory holds; expected at most "),
    (lambda: ARM.rnea([[0] * 6, [0] * 5], np.zeros(6), np.zeros(6)), "rnea: q: expected an array of numbers: "),
    (lambda: ARM.rnea({}, np.zeros(6), np.zeros(6)), "rnea: q: expected an array of numbers: "),
    *[(lambda wrong=wrong: ARM.rnea(wrong, np.zeros(6), np.zeros(6)), f"rnea: q: expected an array of numbers, got {kind}")
      for kind, all_wrong in {
          "text": ["abc", ["a"] * 6, b"abc", np.array(["a"] * 6), [["a"] * 6] * 2],
          "complex ones; write a.real": [1j, [1j] * 6, (0, 0, 0, 0, 0, 1j), np.full(6, 1j), np.full((2, 6), 1j), np.complex64(1),
              [np.complex128(1)] * 6, [[0, 0, 0, 0, 0, np.complex64(1)]]]
      }.items() for wrong in all_wrong],
    (lambda: square()(np.array([1j, 2])), "x: expected an array of numbers, got complex ones"),
    (lambda: setattr(car(), "start", "here"), "start: expected an array of numbers, got text"),
    (lambda: setattr(car(), "start", None), "start: got None, expected an array of shape (1,); NaN is an entry that is free"),
    (lambda: setattr(car(), "goal", [-np.inf]), "goal: x is -inf; expected a number, or NaN for a free entry"),
    (lambda: bounded(np.nan, 1), "bound_states: x: lower is nan, upper is 1; expected a lower bound of at most"),
    (lambda: bounded(np.inf, np.inf), "bound_states: x: lower is inf, upper is inf; expected a lower bound of at most"),
    (lambda: dyntape.Mpc(car(), tolerance=0).step(0.0, [1.0]), "the tolerance of a step is 0, expected a positive number"),
    (lambda: dyntape.record(lambda x: [x[0], x[:1]], 2), "got an array among them; expected a[0] of an array of one entry, or np.concatenate"),
    (lambda: dyntape.Problem("none", [], ["u"], 1.0, lambda s: []).solve(4), 'problem "none": there are no states; expected one or more'),
    (lambda: car().bound_states("low"), "bound_states: expected an array of numbers, got text"),
    (lambda: car().bound_states(1, -1), "bound_states: x: lower is 1, upper is -1; expected a lower bound of at most the upper, and below infinity"),
    (lambda: car().bound_controls([1], [-1]), "bound_controls: u: lower is 1, upper is -1; expected a lower bound of at most the upper, and below infinity"),
    (lambda: bounded(-2, 3).bound_states(upper=-2.5), "bound_states: x: lower is -2, upper is -2.5; expected"),
    (lambda: bounded(-2, 3).bound_states(4), "bound_states: x: lower is 4, upper is 3; expected"),
    (lambda: car().add_inequality("w", lambda s: s.x, 1, -1), 'add_inequality("w"): lower is 1, upper is -1; expected a lower bound of at most'),
    (lambda: car().add_inequality("w", lambda s: [s.x[0], s.u[0]], 0, [1, -1]), 'add_inequality("w"): entry 1: lower is 0, upper is -1; expected'),
    (lambda: dyntape.Mpc(car()).step(0.0, [np.nan]), "step: x: x is nan; expected a number"),
    (lambda: dyntape.Mpc(held()).step(0.0, [*np.zeros(7), np.inf, *np.zeros(4)]), f"step: x: {held().states[7]} is inf; expected a number"),
    (lambda: dyntape.Mpc(plain_car()), 'Mpc: "effort" is a plain cost (add_cost); expected squares of residuals (add_squares)'),
    (lambda: ARM.problem(-1), "problem: duration is -1 s; expected a positive number"),
    (lambda: ARM.problem(float("nan")), "problem: duration is nan s; expected a positive number"),
    (lambda: dyntape.Scene(SCENE).problem(0), "problem: duration is 0 s; expected a positive number"),
    (lambda: dyntape.Problem("car", ["x"], ["u"], -1, lambda s: s.u), 'Problem("car"): duration is -1 s; expected a positive number'),
    (lambda: dyntape.Problem("car", ["x"], ["u"], np.inf, lambda s: s.u), 'Problem("car"): duration is inf s; expected a positive number'),
    (lambda: car().free_duration(-1, 2), "free_duration: shortest is -1 s; expected a positive number"),
    (lambda: car().free_duration(np.nan, 2), "free_duration: shortest is nan s; expected a positive number"),
    (lambda: car().free_duration(1, 0.5), "free_duration: longest is 0.5 s; expected a number of at least 1"),
    (lambda: car().free_duration(1, np.nan), "free_duration: longest is nan s; expected a number of at least 1"),
]


@pytest.mark.parametrize("call, sentence", REFUSED, ids=[sentence for _, sentence in REFUSED])
def test_what_cannot_be_meant_is_refused_in_python_words(call, sentence):
    with pytest.raises(dyntape.Error) as raised:
        call()
    assert sentence in str(raised.value) and "\n" not in str(raised.value)


def test_refused_bounds_change_nothing():
    p = bounded(-2, 3)
    with pytest.raises(dyntape.ArgumentError):
        p.bound_states(-1, [-4])
    assert [float(side[0]) for side in p.state_bounds] == [-2, 3]
    p.bound_states(3, 3)
    assert p.state_bounds[0] == p.state_bounds[1]
