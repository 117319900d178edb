"""Tests of the closed-form solutions for Kowalewski and Goryachev-Chaplygin tops.

Each test runs for a Kowalewski top and for a Goryachev-Chaplygin top.
"""

import itertools
import pickle
from dataclasses import dataclass

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from hypothesis import given
from hypothesis import strategies as st

from validation.references import reference
from validation.references.problems import attitude_errors, problem_of_scene


@dataclass(frozen=True)
class Form:
    """A type of closed-form solution, and a top to which it applies."""

    result: type
    scene: kr.Scene
    ratio: float
    integral: str

    @property
    def name(self):
        return {2.0: "Kowalewski", 4.0: "Goryachev-Chaplygin"}[self.ratio]

    def body(self, moments=None, com=(1.0, 0.0, 0.0)):
        moments = moments or (self.ratio, self.ratio, 1.0)
        return kr.Body(1.0, moments, com, unphysical=True)


def make_form(result, ratio, momentum, integral):
    body = kr.Body(1.0, (ratio, ratio, 1.0), (1.0, 0.0, 0.0), unphysical=True)
    scene = kr.Scene(body, momentum=momentum, attitude=(0.8, 0.4, -0.2, 0.4), gravity=1)
    return Form(result, scene, ratio, integral)


FORMS = [
    make_form(kr.ExactKowalewski, 2.0, (0.3, 1.1, 0.8), "kowalewski"),
    make_form(kr.ExactGoryachevChaplygin, 4.0, (0.9, 2.1, 0.0), "goryachev_chaplygin"),
]


@pytest.fixture(params=FORMS, ids=lambda form: form.integral)
def form(request):
    return request.param


def largest_distance(one, other):
    distances = np.minimum(
        np.linalg.norm(one.q - other.q, axis=1), np.linalg.norm(one.q + other.q, axis=1)
    )
    return float((distances + np.linalg.norm(one.m - other.m, axis=1)).max())


def test_states_agree_with_30_digits(form):
    top = kr.exact(form.scene)
    assert isinstance(top, form.result) and isinstance(top, kr.ExactTorus)
    assert top.certificate < 1e-13
    for t in ([0.5, 7.0, 300.0], [-3.0, -200.0]):
        assert largest_distance(top(t), kr.solve(form.scene, t, digits=30)) < 2e-14


@pytest.mark.parametrize("axes", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("gravity", [9.81, -2.5])
def test_states_are_right_for_any_axis_order_and_sign_of_gravity(form, axes, gravity):
    moments = np.array((form.ratio, form.ratio, 1.0))[list(axes)]
    com = np.array((0.0, -0.7, 0.0))[list(axes)]
    scene = form.scene.replace(body=form.body(tuple(moments), tuple(com)), gravity=gravity)
    # Some tops are near a resonance: one rounding error of the start moves them by 2e-14 rad.
    assert (
        largest_distance(kr.exact(scene)([5.0, 40.0]), kr.solve(scene, [5.0, 40.0], digits=30))
        < 2e-13
    )


def test_many_times_equal_single_times_bitwise(form):
    top, t = kr.exact(form.scene), np.linspace(-1e5, 1e6, 13)
    path = top(t)
    for i, time in enumerate(t):
        alone = top(time)
        assert same_bits(alone.q[0], path.q[i])
        assert same_bits(alone.m[0], path.m[i])


def test_integrals_are_constant_at_any_time(form):
    path = kr.exact(form.scene)(np.linspace(-1e6, 1e6, 101))
    assert np.ptp(path.energy) < 1e-13 and np.ptp(path.m[:, 2]) < 1e-13
    assert np.ptp(getattr(path, form.integral)) < 1e-13


def test_method_exact_equals_the_closed_form(form):
    t = [1.0, 20.0]
    path = kr.solve(form.scene, t, method="exact")
    assert path.method == "exact" and largest_distance(path, kr.exact(form.scene)(t)) < 5e-15


def test_motions_without_closed_form_are_refused_by_name(form):
    still, level = (0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    rest = kr.Scene(form.body(), momentum=still, attitude=level, gravity=1)
    with pytest.raises(ValueError, match=f"{form.name} top has no closed form"):
        kr.exact(rest)
    with pytest.raises(ValueError, match="does not apply: this motion"):
        kr.solve(rest, 1.0, method="exact")
    with pytest.raises(ValueError, match="damping"):
        kr.exact(form.scene.replace(damping=(0.1, 0.1, 0.1)))


@pytest.mark.parametrize(
    "change",
    [
        lambda form: {"body": form.body((form.ratio, form.ratio, float(np.nextafter(1.0, 2.0))))},
        lambda form: {"body": form.body((form.ratio, float(np.nextafter(form.ratio, 0.0)), 1.0))},
        lambda form: {"body": form.body(com=(1.0, 0.0, 1e-15))},
        lambda form: {"momentum": (0.9, 2.1, 1e-16)},
    ],
)
def test_tops_that_are_integrable_only_up_to_rounding_are_refused(form, change):
    """Near a separatrix, tops that differ by a rounding error move apart by up to 2.5 rad."""
    scene = form.scene.replace(**change(form))
    if form.ratio == 2.0 and scene.body == form.scene.body:
        assert kr.exact(scene).certificate < 1e-13
        return
    for call in (
        lambda: kr.exact(scene),
        lambda: kr.exact([form.scene, scene]).certificate,
        lambda: kr.solve(scene, 1.0, method="exact"),
    ):
        with pytest.raises(ValueError, match=r"only up to rounding|vertical component"):
            call()
    paths = kr.solve(kr.Ensemble.of([form.scene, scene]), 1.0, method="exact")
    assert paths.failed.tolist() == [1]


@given(st.floats(1e-30, 1e30))
def test_products_of_any_moment_and_the_ratio_are_exact(moment):
    for form in FORMS:
        body = form.body((form.ratio * moment, form.ratio * moment, moment))
        assert kr.exact(form.scene.replace(body=body, gravity=1.0 / moment)).certificate < 1e-13


def draw_near_an_edge(form, random):
    """Draw a top beside an equilibrium, a swing in a plane or a rotation about a principal axis."""
    edges = {  # vertical and angular velocity in the body frame
        "hanging": lambda a, b: ((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        "swing about axis 2": lambda a, b: ((np.cos(a), 0.0, np.sin(a)), (0.0, b, 0.0)),
        "swing about axis 3": lambda a, b: ((np.cos(a), np.sin(a), 0.0), (0.0, 0.0, b)),
        "rotation about axis 3": lambda a, b: ((np.cos(a), np.sin(a), 1.0), (0.0, 0.0, 3.0 * b)),
    }
    edge = edges[random.choice(list(edges))](random.uniform(0.0, 6.0), random.normal())
    size = 10.0 ** random.uniform(-8.0, -1.0)
    up, velocity = (x + size * random.normal(size=3) for x in map(np.array, edge))
    up /= np.linalg.norm(up)
    attitude = np.array((1.0 + up[2], up[1], -up[0], 0.0))  # turns `up` to e3
    momentum = np.array(
        kr.quaternion.turn(
            tuple(attitude / np.linalg.norm(attitude)),
            tuple(velocity * (form.ratio, form.ratio, 1.0)),
        )
    )
    momentum[2] *= form.ratio == 2.0
    return kr.Scene(form.body(), momentum, attitude / np.linalg.norm(attitude), gravity=1.0)


# The heading of these tops makes a quick half turn and back. Their starts are on one side of it.
QUICK_TURNS = [
    kr.Scene(
        kr.Body(1.6944244049895523, (0.8533732882976663, 0.8533732882976663, 0.21334332207441659),
                (3.922908266969125, 2.8748975450782583, 0.0), unphysical=True),
        (-0.5824155178201763, -0.9748701649070326, 0.0),
        (-0.39795741206403334, -0.6930484630047241, -0.03256489423839981, -0.6002110077075634),
        gravity=-0.293264530697308,
    ),
    kr.Scene(
        kr.Body(1.3037891295177786, (21.933997591516157, 5.483499397879039, 21.933997591516157),
                (-5.451130205507806, 0.0, 0.0), unphysical=True),
        (8.558978183163026, 9.800516424800104, 0.0),
        (-0.5461195326878039, 0.7067974237321547, -0.020914101402384814, 0.44916974317620095),
        gravity=1.0,
    ),
]  # fmt: skip


def test_certificates_bound_the_true_errors(form):
    """Compare states near the edges of both closed forms with heyoka in 128-bit arithmetic."""
    random, ratios = np.random.default_rng(7), []
    scenes = [draw_near_an_edge(form, random) for _ in range(24)]
    for scene in scenes + (QUICK_TURNS if form.ratio == 4.0 else []):
        try:
            top = kr.exact(scene)
        except ValueError:
            continue
        t = np.linspace(3.0, 20.0, 6) / scene._rotation_rate
        states = reference.integrate_states(problem_of_scene("top", scene), t)
        truth = [[np.longdouble(str(x)) for x in state[:4]] for state in states]
        q = top(t).q
        ratios.append(attitude_errors(q, truth).max() / (top.certificate + 3e-16))
    assert len(ratios) >= 12 and max(ratios) < 10.0 and np.median(ratios) > 0.1


def test_the_closed_form_survives_pickling(form):
    top = kr.exact(form.scene)
    assert np.array_equal(pickle.loads(pickle.dumps(top))(12.0).q, top(12.0).q)


def test_times_beyond_the_horizon_are_refused(form):
    with pytest.raises(ValueError, match="double precision cannot resolve its attitude"):
        kr.exact(form.scene)(1e300)


def test_every_line_of_the_spectrum_is_a_sum_of_the_frequencies(form):
    # Small multiples of the frequencies suffice for these starts.
    scene = form.scene if form.ratio == 2.0 else form.scene.replace(momentum=(2.0, 1.0, 0.0))
    top = kr.exact(scene)
    first, second, precession = top.frequencies
    assert (precession == 0.0) == (form.ratio == 4.0)
    lines = kr.frequencies(top(np.linspace(0.0, 4000.0, 20001))).lines[:4]
    for line in lines:
        miss = min(
            abs(line - (i * first + j * second + sign * precession))
            for i, j in itertools.product(range(-10, 11), repeat=2)
            for sign in (-1, 0, 1)
            if sign or not precession
        )
        assert miss < 1e-7, line
