"""Tests that integrable bodies are recognized in spite of rounding errors."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._results.error_estimate import has_cheap_exact_form
from tops import TILT, matrix, unit

EPS = 2.0**-52
NEARLY = {  # bodies with a small deviation from a Lagrange top
    "com": lambda deviation: kr.Body(1, (1, 1, 0.5), (deviation, 0, 1), unphysical=True),
    "moments": lambda deviation: kr.Body(1, (1, 1 + deviation, 0.5), (0, 0, 1), unphysical=True),
    "sphere": lambda deviation: kr.Body(
        1, (1, 1 + deviation, 1 - deviation / 5), (0.6, 0.5, 0.4), unphysical=True
    ),
}


def random_axes_body(moments, com, random):
    """Return a body whose inertia tensor is given in randomly rotated axes."""
    turn = matrix(unit(random.normal(size=4)))
    tensor = turn @ np.diag(moments) @ turn.T
    return kr.Body(1, 0.5 * (tensor + tensor.T), turn @ com, unphysical=True)


@pytest.mark.parametrize("size", [0.4, 1e-2, 1e-4, 1e-7, 1e-11])
def test_a_rotated_lagrange_top_stays_a_lagrange_top(size):
    random = np.random.default_rng(3)
    for sign in (1, -1) * 100:
        body = random_axes_body((1 + sign * size, 1 + sign * size, 1), (0, 0, sign * 0.7), random)
        assert body.kind == "lagrange" and body.is_symmetric
        assert kr.methods["bobenko_suris4"].applies_to(body)
        assert np.linalg.norm(body.principal_com) == pytest.approx(0.7, rel=4 * EPS)


def test_other_kinds_are_recognized_in_rotated_axes():
    random = np.random.default_rng(4)
    for _ in range(200):
        assert random_axes_body((1, 1, 1), (0.3, -0.2, 0.9), random).kind == "lagrange"
        assert random_axes_body((2, 2, 1), (0.3, 0, 0), random).kind == "kowalewski"
        assert random_axes_body((4, 4, 1), (0.3, 0, 0), random).kind == "goryachev_chaplygin"
        assert random_axes_body((1, 2, 1.5), (0, 0, 0), random).kind == "euler"


def test_rings_of_points_are_lagrange_tops():
    random = np.random.default_rng(5)
    for points in range(3, 9):
        turn, angles = matrix(unit(random.normal(size=4))), 2 * np.pi * np.arange(points) / points
        mass, tensor, com = 0.0, np.zeros((3, 3)), np.zeros(3)
        for _ in range(3):
            each, radius, height = np.exp(random.normal(size=3))
            ring = radius * np.cos(angles), radius * np.sin(angles), np.full(points, height)
            for place in np.stack(ring, -1) @ turn.T:
                mass, com = mass + each, com + each * place
                tensor += each * (place @ place * np.eye(3) - np.outer(place, place))
        assert kr.Body(mass, tensor, com / mass).kind == "lagrange"


def test_tensors_change_only_by_rounding_errors():
    random = np.random.default_rng(6)
    for difference in 10 ** random.uniform(-14, -10, 300):
        turn, com = matrix(unit(random.normal(size=4))), random.normal(size=3)
        tensor = turn @ np.diag((1, 1 + difference, random.uniform(0.3, 1.8))) @ turn.T
        tensor = 0.5 * (tensor + tensor.T)
        body = kr.Body(1, tensor, com, unphysical=True)
        axes = matrix(body.axes)
        again = axes @ np.diag(body.moments) @ axes.T
        assert np.abs(again - tensor).max() < 20 * EPS * np.abs(tensor).max()
        assert np.abs(axes @ body.principal_com - com).max() < 40 * EPS * np.abs(com).max()


@pytest.mark.parametrize("kind", NEARLY)
@pytest.mark.parametrize("difference", [4e-14, 9e-13, 2e-10])
def test_differences_above_rounding_change_the_kind(kind, difference):
    scene = kr.Scene(NEARLY[kind](difference), momentum=(0, 0.3, 1), attitude=TILT, gravity=1)
    assert scene.body.kind == "general"
    assert kr.solve(scene, 1).method == "taylor"
    assert "'lagrange' only up to" in kr.plan(scene).why
    for call in (
        lambda: kr.exact(scene),
        lambda: kr.exact([scene]),
        lambda: kr.solve(scene, 1, "exact"),
        lambda: kr.solve(scene, 1, "bobenko_suris4", step=0.01),
        lambda: kr.exact(scene, map="bobenko_suris", step=0.01),
    ):
        with pytest.raises(ValueError, match="'lagrange' only up to"):
            call()


@pytest.mark.parametrize("kind", NEARLY)
def test_differences_of_rounding_size_keep_the_kind(kind):
    scene = kr.Scene(NEARLY[kind](8 * EPS), momentum=(0, 0.3, 1), attitude=TILT, gravity=1)
    assert scene.body.kind == "lagrange" and kr.solve(scene, 1).method == "exact"
    paths = [kr.solve(scene, 10), kr.solve(scene, 10, "kahan_li8", step=0.01)]
    true = kr.solve(scene, 10, digits=30)
    for path in paths:
        error = kr.attitude_error(path.q[-1], true.q[-1])
        assert error < 2e-13 and path.error == pytest.approx(error, rel=0.5, abs=3e-16)


def test_a_tiny_asymmetry_of_the_body_makes_the_top_fall():
    scene = kr.Scene(
        kr.Body(1, (1, 1, 0.5), (0.9e-12, 0, 1), unphysical=True), momentum=(0, 0, 1), gravity=1
    )
    path, true = kr.solve(scene, 35), kr.solve(scene, 35, digits=30)
    assert kr.attitude_error(path.q[-1], true.q[-1]) < 1e-9
    assert true.apex[-1, 2] < 0.9


@pytest.mark.parametrize("words", [{}, {"method": "strang", "step": 0.001}])
def test_without_gravity_the_centre_of_mass_does_not_matter(words):
    moments, ends = (1, 1 + 0.8e-12, 1 - 0.15e-12), []
    for com in ((0, 0, 0), (0.6, 0.5, 0.4)):
        body = kr.Body(1, moments, com, unphysical=True)
        scene = kr.Scene(body, momentum=(0.3, -0.9, 1.1), attitude=TILT, gravity=0)
        path = kr.solve(scene, 1000, **words)
        ends.append(path.q[-1])
        assert path.error < 2e-12
    assert kr.attitude_error(*ends) < 2e-12


@pytest.mark.parametrize("size", [1e-75, 1e-100, 1e-165, 1e-300])
@pytest.mark.parametrize("words", [{"attitude": 1}, {"momentum": 1}, {"both": 1}])
def test_a_top_with_a_tiny_tilt_falls(size, words):
    """Check that a top falls after a time proportional to the logarithm of its tilt or velocity.

    The tilt and the velocity are too small for a closed form.
    """
    push, lean = ("attitude" not in words) * size, ("momentum" not in words) * size
    body = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)
    scene = kr.Scene(body, momentum=(0, push, 0), attitude=(1, lean, 0, 0), gravity=1)
    with pytest.raises(ValueError, match="tilt and velocity are below 1e-70"):
        kr.exact(scene)
    with pytest.raises(ValueError, match="'exact' does not apply: no closed form can resolve"):
        kr.solve(scene, 1, "exact")
    falls = -np.log(size)
    path = kr.solve(scene, [falls - 5, falls + 1.5])
    assert path.method == "taylor" and "initial tilt" in path.plan.why
    assert path.nutation[0] < 0.2 and path.nutation[1] > 1
    assert path.error < 1e-9
    assert kr.solve(scene.replace(gravity=0), 1).method == "exact"


def test_slightly_tilted_and_upright_tops_have_a_closed_form():
    body, falls = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True), -np.log(1e-69)
    little = kr.Scene(body, momentum=(0, 0, 0), attitude=(1, 1e-69, 0, 0), gravity=1)
    path = kr.solve(little, [falls - 5, falls + 1])
    assert path.method == "exact" and kr.exact(little).period > falls
    assert path.error < 1e-8
    for upright in ((1, 0, 0, 0), (0, 1, 0, 0), (0.6, 0, 0, 0.8)):
        stands = kr.Scene(body, momentum=(0, 0, 0.5), attitude=upright, gravity=1)
        assert kr.exact(stands).period == np.inf and kr.exact(stands)(1e3).nutation[0] in (0, np.pi)


@pytest.mark.parametrize("across, is_exact", [(0.0, True), (1e-17, False), (-1e-17, False)])
def test_a_rotor_beside_the_axis_has_no_exact_closed_form(across, is_exact):
    body = kr.Body(1.0, (2.0, 2.0, 0.5), (0, 0, 1), rotor=(across, 0.0, 1.0))
    top = kr.Scene(body, momentum=(0.1, 0.0, 1.0), attitude=unit((0.9, 0.3, 0.1, 0.3)), gravity=1)
    assert body.kind == "lagrange" and has_cheap_exact_form(top) is is_exact
