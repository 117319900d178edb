"""Tests of the closed form of free bodies with a rotor off their axis of symmetry."""

import math

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from tops import unit

MOMENTS, ROTOR = (1.0, 2.0, 2.5), (0.3, 0.5, 0.2)
BODY = kr.Body(1.0, MOMENTS, (0, 0, 0), rotor=ROTOR)
TOP = kr.Scene(BODY, momentum=(1.0, 0.5, 0.7), attitude=(0.8, 0.4, -0.2, 0.4), gravity=9.81)


def steady_momentum(rate):
    """Return a momentum in the body with which the body of `TOP` rotates steadily."""
    return np.array(ROTOR) / (1.0 - rate * np.array(MOMENTS))


def beside(momentum, distance):
    return kr.Scene(BODY, body_momentum=np.add(momentum, (0.0, distance, 0.0)))


def draw(rng, family):
    x, rotor = rng.uniform(0.05, 1.0, 3), rng.normal(size=3)
    moments = (x.sum() - x)[rng.permutation(3)]
    if family == "small rotor":
        rotor *= 10.0 ** rng.uniform(-12, -2)
    elif family == "large rotor":
        rotor *= 10.0 ** rng.uniform(1, 3)
    elif family == "in a plane":
        rotor[rng.integers(3)] = 0.0
    elif family == "along an axis":
        rotor *= np.arange(3) == rng.integers(3)
    elif family == "nearly symmetric":
        moments[0] = moments[1] * (1.0 + 10.0 ** rng.uniform(-15, -2) * rng.integers(2))
        moments[2] = min(moments[2], 1.9 * moments[1])
    body = kr.Body(2.0, tuple(moments), (0, 0, 0), rotor=tuple(rotor), unphysical=True)
    if rng.integers(2):
        body = body.turn(unit(rng.normal(size=4)))
    return kr.Scene(body, momentum=rng.normal(size=3), attitude=unit(rng.normal(size=4)))


FAMILIES = (
    *("any rotor", "small rotor", "large rotor", "in a plane", "along an axis"),
    "nearly symmetric",
)


@pytest.mark.parametrize("family", FAMILIES)
def test_states_agree_with_30_digits(family):
    rng, count = np.random.default_rng(len(family)), 0
    for _ in range(8):
        scene = draw(rng, family)
        if scene.body.kind == "euler":
            continue
        try:
            top = kr.exact(scene)
        except ValueError as error:
            assert "separatrix" in str(error)
            continue
        count += 1
        t = rng.choice((-1.0, 1.0)) * np.array([0.0, 0.3, 20.0, 1e3]) / top.frequencies[0]
        truth, path = kr.solve(scene, t, digits=30), top(t)
        allowed = 10.0 * top.certificate
        assert allowed < 1e-12
        if any(scene.body.axes[1:]):  # rounded moments, so that phases err in proportion to time
            allowed += 2e-14 * abs(t) * top.frequencies[0]
        assert (kr.attitude_error(path.q, truth.q) < allowed).all()
        assert np.abs(path.m - truth.m).max() == 0.0 and len(top.frequencies) == 3
    assert count > 4


def test_the_certificate_bounds_the_error_near_a_separatrix():
    rng = np.random.default_rng(5)
    top = kr.exact([draw(rng, "small rotor") for _ in range(231)][-1])
    t = 2 * np.pi / top.frequencies[0] * np.linspace(0.01, 0.99, 25)
    error = kr.attitude_error(top(t).q, kr.solve(top.scene, t, digits=20).q).max()
    assert 8e-15 < error < 2.0 * top.certificate


@pytest.mark.parametrize("distance", [0.0, 1e-14, 1e-10, 1e-7, 1e-4, 1e-2])
def test_rotations_beside_a_steady_one_are_computed(distance):
    scene = beside(steady_momentum(2.0), distance)
    top, t = kr.exact(scene), np.array([0.0, 7.0, -900.0])
    truth = [kr.solve(scene, [0.0, time], digits=30).q[-1] for time in t]
    assert kr.attitude_error(top(t).q, truth).max() < 3e-14


def test_motions_near_a_separatrix_are_refused_by_name():
    scene = beside(steady_momentum(0.6), 1e-9)
    with pytest.raises(ValueError, match=r"free gyrostat has no closed form: .* separatrix"):
        kr.exact(scene)
    with pytest.raises(ValueError, match="separatrix"):
        kr.solve(scene, 1.0, "exact")
    assert kr.solve(scene, [0.0, 1e5]).method == "taylor"


def test_gravity_friction_and_a_missing_momentum_are_refused():
    heavy = TOP.replace(body=kr.Body(1.0, MOMENTS, (0, 0, 0.5), rotor=ROTOR))
    assert kr.exact(heavy.replace(gravity=0.0)).kind == "gyrostat"
    for scene, word in (
        (heavy, "kind 'general' with a rotor"),
        (TOP.replace(friction=0.1), "friction"),
        (TOP.replace(momentum=(0, 0, 0)), "no closed form"),
    ):
        with pytest.raises(ValueError, match=word):
            kr.exact(scene)


def test_the_frequencies_are_derivatives_of_the_energy_by_the_actions():
    top, h = kr.exact(TOP), 1e-4
    for change in np.eye(3):
        ends = [kr.exact(TOP.replace(momentum=TOP.momentum + s * h * change)) for s in (1.0, -1.0)]
        energies = [form(0.0).energy[0] for form in ends]
        by_actions = np.subtract(ends[0].actions, ends[1].actions) @ top.frequencies
        assert abs(by_actions - (energies[0] - energies[1])) < 1e-7 * h
    assert top.frequencies[2] == 0.0 and math.isnan(top.period)


def test_auto_chooses_the_closed_form_for_long_paths():
    assert kr.solve(TOP, [0.0, 10.0]).method == "taylor"
    path = kr.solve(TOP, [0.0, 1e5])
    assert path.method == kr.plan(TOP, [0.0, 1e5]).method == "exact"
    assert kr.attitude_error(path.q, kr.exact(TOP)([0.0, 1e5]).q).max() < 1e-13
    turning, t = TOP.replace(turning=(0, 0, 0.3)), [0.0, 3.0]
    for scene in (turning, TOP.replace(body=BODY.turn((0.5, 0.5, 0.5, -0.5)))):
        paths = [kr.solve(scene, t, method) for method in ("exact", "taylor")]
        assert kr.attitude_error(paths[0].q, paths[1].q).max() < 1e-13


def test_members_of_an_ensemble_equal_single_tops():
    tops = kr.Scene.stack([TOP, TOP.replace(momentum=(0.1, 2.0, 0.4)), kr.scenes.thesis])
    paths, forms = kr.solve(tops, [1.0, 50.0], "exact"), kr.exact(tops)
    assert not paths.failed.size
    for i in range(2):
        one = kr.exact(tops[i])
        assert same_bits(forms([1.0, 50.0])[i].states, one([1.0, 50.0]).states)
        assert np.array_equal(forms.frequencies[i], one.frequencies)
        assert same_bits(paths[i].states, kr.solve(tops[i], [1.0, 50.0], "exact").states)


def test_tangents_exist_by_the_start_alone():
    t = [0.0, 1.0, 100.0]
    truth = kr.solve(TOP, t, digits=30, tangents="start").tangents
    path = kr.exact(TOP)(t, tangents="start")
    assert np.abs(path.tangents - truth).max() < 1e-9 * np.abs(truth).max()
    with pytest.raises(ValueError, match="no tangents with respect to 'gravity'"):
        kr.exact(TOP)(t, tangents="gravity")
