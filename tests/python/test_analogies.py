"""Tests of the analogy between tops and elastic rods, and of the trace of the apex."""

import kreisel as kr
import numpy as np
import pytest

NAMES = "thesis", "cusps", "kowalewski", "goryachev_chaplygin", "asymmetric_regular", "dzhanibekov"
CUBOID = kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1))
BODY = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)
HANGING, LEANING = (0, 1, 0, 0), (0.9, 0.3, -0.1, 0.3)
THESIS, CUSPS = kr.scenes.thesis, kr.scenes.cusps


def solve_evenly(scene, end=20.0, states=4001):
    return kr.solve(scene, np.linspace(0, end, states), method="taylor")


def differentiate(values, t):
    """Return derivatives computed by fourth-order central differences."""
    return (8 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) / (12 * (t[1] - t[0]))


@pytest.mark.parametrize("name", NAMES)
def test_the_rod_has_the_lagrangian_and_the_curvature_of_its_centre_line(name):
    """Check theorem 3.8 with alpha1 = I_B, alpha2 = I_N and load = -mass * gravity * |com| e3."""
    path = solve_evenly(getattr(kr.scenes, name))
    rod, energy, size = kr.rod(path), path.kinetic.max(), np.abs(path.velocity).max()
    assert rod.elastic_energy_density == pytest.approx(path.kinetic, abs=1e-14 * energy)
    lagrangian = path.kinetic - path.potential
    assert rod.lagrangian_density == pytest.approx(lagrangian, abs=1e-13 * energy)
    n, b, t = rod.frame.transpose(1, 0, 2)
    assert np.cross(n, b) == pytest.approx(t, abs=1e-14)
    slope, tolerance = differentiate(t, rod.s), 2e-6 * size**5
    for curve, normal in zip(rod.curvature.T, (n, b), strict=True):
        assert (slope * normal[2:-2]).sum(-1) == pytest.approx(curve[2:-2], abs=tolerance)
    torsion = (differentiate(n, rod.s) * b[2:-2]).sum(-1)
    assert torsion == pytest.approx(rod.torsion[2:-2], abs=tolerance)
    # the centre line has unit speed along t
    assert differentiate(rod.centre, rod.s) == pytest.approx(t[2:-2], abs=2e-8 * size**4)


def test_the_centre_line_converges_at_fourth_order():
    fine, middle, coarse = (
        kr.rod(solve_evenly(THESIS, 20, n)).centre[-1] for n in (4001, 251, 126)
    )
    assert 12 < np.linalg.norm(coarse - fine) / np.linalg.norm(middle - fine) < 20


def test_the_rod_section_follows_from_the_body():
    for name, isotropic, section in [
        ("thesis", True, (1, 1)),
        ("kowalewski", False, (1, 0.5**0.5)),
        ("goryachev_chaplygin", False, (1, 0.5)),
    ]:
        rod = kr.rod(kr.solve(getattr(kr.scenes, name), 1.0))
        assert rod.isotropic == isotropic and rod.section == pytest.approx(section, rel=1e-14)
        assert repr(rod).startswith("<kreisel.Rod: iso" if isotropic else "<kreisel.Rod: aniso")
    assert kr.rod(kr.solve(kr.scenes.dzhanibekov, 1.0)).load == (0, 0, 0)
    body = kr.Body(mass=2.0, inertia=(2, 2, 1), com=(0.6, -0.8, 0), unphysical=True)
    path = solve_evenly(kr.Scene(body, momentum=(1.0, 0.3, 0.5), gravity=1), 5.0, 51)
    assert kr.rod(path).frame[:, 2] == pytest.approx(path.apex, abs=1e-14)


# The trace of the apex


def integrate_nutation(scene, n=400):
    """Return the nutation angles at the turning points, the nutation period and the precession.

    The height u satisfies I1^2 u'^2 = 2 I1 (h - M g a u) (1 - u^2) - (v - c u)^2. Here v is the
    vertical component of the angular momentum, and c is its component along the symmetry axis. The
    energy h does not include the energy of the spin.
    """
    i1, _, i3 = scene.body.moments
    start = kr.solve(scene, [0.0])
    c, v = start.axial_momentum[0], start.vertical_momentum[0]
    lever = scene.body.mass * scene.gravity * np.linalg.norm(scene.body.com)
    h = start.energy[0] - c * c / (2 * i3)
    fall = np.poly1d([-2 * i1 * lever, 2 * i1 * h])
    cubic = fall * np.poly1d([-1, 0, 1]) - np.poly1d([-c, v]) ** 2
    low, high, third = sorted(cubic.roots.real)
    u = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(np.pi * (np.arange(n) + 0.5) / n)
    pace = i1 / np.sqrt(2 * i1 * lever * (third - u))
    period, turn = 2 * np.pi * pace.mean(), pace * (v - c * u) / (i1 * (1 - u * u))
    return np.arccos(high), np.arccos(low), period, 2 * np.pi * turn.mean() / period


@pytest.mark.parametrize("scene", [CUSPS, kr.Scene(CUBOID, (0.172, -1.862, 8), LEANING, gravity=1)])
def test_nutation_and_precession_agree_with_a_quadrature(scene):
    expected = integrate_nutation(scene)
    period = expected[2]
    for sign, states, accuracy in (1, 12, 2e-3), (-1, 50, 1e-4), (1, 400, 1e-7):
        path = solve_evenly(scene, sign * 10.3 * period, round(10.3 * states) + 1)
        found = kr.apex(path).nutation()
        assert found == pytest.approx(expected, rel=accuracy, abs=accuracy)
    trace = kr.apex(path)
    assert np.array_equal(trace.trace, path.apex) and np.abs(np.diff(trace.azimuth)).max() < 0.1
    assert differentiate(trace.trace, trace.t) == pytest.approx(trace.rate[2:-2], abs=1e-5)
    form = kr.exact(scene)
    assert (form.least_nutation, form.greatest_nutation) == pytest.approx(expected[:2], abs=1e-12)
    assert (form.period, form.precession_rate) == pytest.approx(expected[2:], rel=1e-12)


@pytest.mark.parametrize("loss", [{"damping": 0.1}, {"friction": 0.05}])
def test_the_precession_with_damping_or_friction_is_that_of_the_azimuth(loss):
    path = kr.solve(CUSPS.replace(**loss), np.linspace(0.0, 30.0, 3001))
    curve, height = kr.apex(path), path.apex[:, 2]
    lowest = np.flatnonzero((height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:])) + 1
    first, last = lowest[0], lowest[-1]
    rate = (curve.azimuth[last] - curve.azimuth[first]) / (path.t[last] - path.t[first])
    assert curve.nutation().precession_rate == pytest.approx(rate, rel=0.01)
    assert abs(rate / kr.exact(CUSPS).precession_rate - 1.0) > 0.02


@pytest.mark.parametrize(
    "scene",
    [
        THESIS,
        kr.scenes.sleeping,
        kr.scenes.fast,
        kr.Scene(BODY, momentum=(0.3, 0, 1.1), attitude=HANGING, gravity=1),
        kr.Scene(BODY, momentum=(0.5, 0, 0), gravity=1),
        kr.Scene(BODY, momentum=(2.5, 0, 0), attitude=HANGING, gravity=1),
        kr.scenes.sleeping.replace(momentum=(1e-6, 0, 3)),
    ],
    ids=["thesis", "sleeping", "fast", "hanging", "circling", "circling, hanging", "tiny"],
)
def test_passages_of_the_vertical_do_not_change_the_precession(scene):
    """Compare with the closed form, which counts a half turn only if the apex misses the pole."""
    for lean, sign in (0.0, 1), (0.0, -1), (1e-9, 1), (-1e-9, -1), (1e-5, -1), (-1e-5, 1):
        turn = np.cos(lean / 2), 0.0, np.sin(lean / 2), 0.0
        leaning = scene.replace(attitude=kr.quaternion.multiply(turn, scene.attitude))
        top = kr.exact(leaning)
        path = kr.solve(leaning, np.linspace(0, sign * 16 * top.period, 802 + sign))
        found = kr.apex(path).nutation().precession_rate
        assert found == pytest.approx(top.precession_rate, rel=1e-3, abs=1e-3 / top.period)


def test_nutation_near_a_pole_loses_no_digits_and_a_steady_precession_has_none():
    """Check small angles, at which the arc cosine is ill-conditioned."""
    top = kr.exact(kr.Scene(BODY, momentum=(1e-6, 0, 5), gravity=1))
    found = kr.apex(top(np.linspace(0, 5 * top.period, 2001))).nutation()
    assert found.greatest == pytest.approx(top.greatest_nutation, rel=1e-6)
    assert found.greatest < 1e-6 and found.least < 1e-15
    steady = kr.apex(solve_evenly(kr.scenes.steady_precession, 20.0, 201)).nutation()
    assert np.isnan(steady.period) and steady.precession_rate == pytest.approx(1.0, rel=1e-11)


@pytest.mark.parametrize("scene", [CUSPS, THESIS])
def test_nutation_is_refused_between_states_too_far_apart(scene):
    top = kr.exact(scene)
    period = 2 * abs(top.t_least - top.t_greatest)
    for states in 1.2, 2.3, 3.9:
        with pytest.raises(ValueError, match="at least 4 states per nutation"):
            kr.apex(top(np.arange(0, 12 * period, period / states))).nutation()
    found = kr.apex(top(np.arange(0, 12 * period, period / 4))).nutation()
    assert found.period == pytest.approx(period, rel=1e-2)
    begin = top.t_greatest + 0.9 * top.period  # two lowest points are enough
    path = kr.solve(scene, np.linspace(begin, begin + 1.2 * top.period, 400))
    assert kr.apex(path).nutation().period == pytest.approx(top.period, rel=1e-5)
