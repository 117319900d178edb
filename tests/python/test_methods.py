"""Tests that every method has the properties stated in the table of methods.

All tops are initially tilted. An upright top would hide first-order errors, because gravity exerts
no torque on it.
"""

import re
from itertools import pairwise

import kreisel as kr
import numpy as np
import pytest
from tilted_tops import BODIES
from tilted_tops import tilt_scene as scene


def cases(**flags):
    """Return all pairs (method, body) in which the method has the given properties."""
    return [
        (name, body)
        for name, method in kr.methods.items()
        if all(getattr(method, flag) == value for flag, value in flags.items())
        for body in BODIES
        if method.applies_to(BODIES[body])
    ]


@pytest.mark.parametrize("name, body", cases(adaptive=True, exact=False))
def test_errors_decrease_with_the_tolerance(name, body):
    top = scene(body)
    truth = kr.solve(top, 5, digits=20)
    errors = [
        kr.attitude_error(kr.solve(top, 5, method=name, tol=tol).q[-1], truth.q[-1])
        for tol in (1e-6, 1e-9, 1e-12)
    ]
    assert errors[0] < 1e-2 and errors[1] < 1e-5 and errors[2] < 1e-8
    # Below 1e-8 the error of the semi-implicit method is due to rounding errors of its matrix.
    floor = 1e-8 if name == "gsl_bsimp" else 0.0
    assert all(a > b or a < floor for a, b in pairwise(errors))


# this method conserves a modified energy, although it is not symplectic
ORBITAL = "bobenko_suris4", "lagrange"


@pytest.mark.parametrize("name, body", [*cases(adaptive=False, symplectic=True), ORBITAL])
def test_energy_neither_drifts_nor_grows(name, body):
    """Check that the energy errors of symplectic methods and ORBITAL are bounded without trend."""
    path = kr.solve(scene(body), 8000, method=name, step=0.05, every=10)
    error = (path.energy - path.energy[0]) / np.abs(path.energy).max()
    quarters = error[1:].reshape(4, -1)
    rounding = 3e-11
    assert 0 < np.ptp(error) < max(2 * 0.05 ** kr.methods[name].order, rounding)
    if np.ptp(error) > rounding:
        assert np.ptp(quarters.mean(axis=1)) < 0.15 * np.ptp(error)
        assert np.ptp(quarters, axis=1).max() < 1.3 * np.ptp(quarters, axis=1).min()


def test_hirota_kimura_conserves_its_rational_integrals():
    """Check (1 - h^2/4 a_k a_i W_j^2) / (1 - h^2/4 a_i a_j W_k^2), where dW_i/dt = a_i W_j W_k."""
    h, (i1, i2, i3) = 0.1, BODIES["free"].moments
    path = kr.solve(scene("free"), 1e3, method="hirota_kimura", step=h, every=10)
    w = np.linalg.matmul(path.frame, path.velocity[:, :, None])[:, :, 0]
    a = np.array([(i2 - i3) / i1, (i3 - i1) / i2, (i1 - i2) / i3])
    one = 1 - h * h / 4 * np.array([a[1] * a[2], a[2] * a[0], a[0] * a[1]]) * w**2
    for i in range(3):
        ratio = one[:, i] / one[:, (i + 1) % 3]
        assert np.ptp(ratio) < 1e-12 and np.ptp(one[:, i]) > 1e-6
    assert np.ptp(np.linalg.norm(path.m, axis=1)) > 1e-6


def is_implicit(name, method):
    return method.implicit and not method.adaptive


@pytest.mark.parametrize("name", [n for n, m in kr.methods.items() if is_implicit(n, m)])
def test_implicit_methods_raise_if_they_do_not_converge(name):
    with pytest.raises(kr.Error, match="converge") as failure:
        top = scene("asymmetric", momentum=(30.0, 40.0, -20.0))
        kr.solve(top, 50, method=name, step=0.01, tol=1e-30)
    assert failure.value.status == "ERR_CONVERGENCE" and failure.value.path.t[-1] < 5
    path = kr.solve(scene("asymmetric"), 1.0, name, step=0.05)
    assert path.stats.iterations > path.stats.steps


VERTICAL = {body: ["vertical_momentum"] for body in BODIES}
AXIAL = {**VERTICAL, "lagrange": ["vertical_momentum", "axial_momentum"]}
CONSERVED = {  # the quantities that are conserved according to each word of the table, by body
    "nothing": {},
    "two rational integrals": {},
    "<m,e3>": VERTICAL,
    "<m,e3>; on Lagrange tops <m,apex>": AXIAL,
    "<m,e3>; up to the tolerance of each step, on Lagrange tops <m,apex> and on free tops the "
    "energy": {
        **AXIAL,
        "free": ["vertical_momentum", "energy"],
    },
    "<m,e3>, <m,apex>, a modified energy": AXIAL,
    "all integrals": {"lagrange": ["vertical_momentum", "axial_momentum", "energy"]},
}


@pytest.mark.parametrize("name", kr.methods)
def test_conserved_quantities_in_the_table_are_conserved(name):
    method = kr.methods[name]
    for body, quantities in CONSERVED[method.conserves].items():
        if method.applies_to(BODIES[body]):
            more = {} if method.adaptive else {"step": 0.05}
            path = kr.solve(scene(body), np.linspace(0, 200, 101), method=name, **more)
            for quantity in quantities:
                limit = 1e-12 if quantity == "vertical_momentum" else 1e-11
                assert np.ptp(getattr(path, quantity)) < limit, (body, quantity)


def test_methods_apply_to_the_expected_bodies_and_refuse_others():
    expected = {
        "hirota_kimura": {"free"},
        "blanes_moan6": {"lagrange", "kowalewski", "goryachev_chaplygin"},
        "bobenko_suris": {"lagrange"},
        "strang": set(BODIES),
    }
    for name, bodies in expected.items():
        assert {body for method, body in cases() if method == name} == bodies
    for name, body in {(n, b) for n in kr.methods for b in BODIES} - set(cases()):
        with pytest.raises(ValueError, match="apply"):
            kr.solve(scene(body), 1, method=name, step=0.1)


@pytest.mark.parametrize("method", kr.methods.values(), ids=str)
def test_a_citation_has_the_sources_of_the_method(method):
    text = kr.citation(method)
    years = set(re.findall(r"year = \{(\d+)\}", text))
    assert set(re.findall(r"\b(?:1[89]|20)\d\d\b", method.reference)) <= years and len(years) > 1
    assert text.count("{") == text.count("}") and text == kr.citation(method.name)


def test_a_citation_of_a_result_has_the_sources_of_its_bodies():
    gyrostat = kr.scenes.dzhanibekov.body.with_rotor(spin=1.0, inertia=1.0, axis=(1, 2, 3))
    sources = {
        "klein1897": kr.solve(kr.Scene.stack([kr.scenes.cusps]), 1),
        "jacobi1849": kr.exact(kr.scenes.dzhanibekov),
        "kowalevski1889": kr.exact(kr.scenes.kowalewski),
        "chaplygin1901": kr.exact(kr.scenes.goryachev_chaplygin),
        "volterra1899": kr.exact(kr.scenes.dzhanibekov.replace(body=gyrostat)),
        "jorba2005": kr.solve(kr.scenes.asymmetric, 1, events=kr.events.nutation()).events,
        "cincotta2000": kr.chaos(kr.scenes.asymmetric, 1.0),
    }
    for source, result in sources.items():
        keys = set(re.findall(r"^@\w+\{(\w+),$", kr.citation(result), re.M))
        assert keys & sources.keys() == {source} or isinstance(result, kr.Chaos), source
        assert {source, "kreisel", "bodack2008"} <= keys
    both = kr.solve(kr.Scene.stack([kr.scenes.cusps, kr.scenes.asymmetric]), 1)
    assert "klein1897" in kr.citation(both) and "jorba2005" in kr.citation(both)
