"""Tests of the analogy between tops and elastic rods, and of the trace of the apex."""

import kreisel as kr
import numpy as np
import pytest

NAMES = [
    "thesis",
    "cusps",
    "kowalewski",
    "goryachev_chaplygin",
    "asymmetric_regular",
    "dzhanibekov",
]
CUBOID = kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1))


def path_of(scene, end=20.0, states=4001):
    return kr.solve(scene, np.linspace(0, end, states), method="extrap", tol=1e-13)


@pytest.fixture(scope="module", params=NAMES)
def path(request):
    return path_of(getattr(kr.scenes, request.param))


def test_the_rod_has_the_lagrangian_of_the_top(path):
    """Check theorem 3.8 with alpha1 = I_B, alpha2 = I_N and load = -mass * gravity * |com| e3."""
    rod, size = kr.rod(path), path.kinetic.max()
    assert rod.elastic_energy_density == pytest.approx(path.kinetic, abs=1e-14 * size)
    assert rod.lagrangian_density == pytest.approx(path.kinetic - path.potential, abs=1e-13 * size)


def slope(values, t):
    """Return derivatives computed by fourth-order central differences."""
    h = t[1] - t[0]
    return (8 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) / (12 * h)


def test_curvature_and_twist_of_the_rod_match_its_centre_line(path):
    rod = kr.rod(path)
    n, b, t = rod.frame.transpose(1, 0, 2)
    assert np.cross(n, b) == pytest.approx(t, abs=1e-14), "right-handed"
    tangent_slope = slope(t, rod.s)
    size = np.abs(path.velocity).max()
    for curve, normal in zip(rod.curvature.T, (n, b), strict=True):
        assert (tangent_slope * normal[2:-2]).sum(-1) == pytest.approx(
            curve[2:-2], abs=2e-6 * size**5
        )
    assert (slope(n, rod.s) * b[2:-2]).sum(-1) == pytest.approx(
        rod.torsion[2:-2], abs=2e-6 * size**5
    )
    assert slope(rod.centre, rod.s) == pytest.approx(t[2:-2], abs=2e-8 * size**4), (
        "the centre line has unit speed along T"
    )


def test_the_centre_line_converges_at_fourth_order():
    fine, coarse = (kr.rod(path_of(kr.scenes.thesis, 20.0, n)).centre[-1] for n in (4001, 126))
    middle = kr.rod(path_of(kr.scenes.thesis, 20.0, 251)).centre[-1]
    ratio = np.linalg.norm(coarse - fine) / np.linalg.norm(middle - fine)
    assert 12 < ratio < 20


def test_the_rod_section_follows_from_the_body():
    for name, isotropic, section in [
        ("thesis", True, (1, 1)),
        ("kowalewski", False, (1, 0.5**0.5)),
        ("goryachev_chaplygin", False, (1, 0.5)),
    ]:
        rod = kr.rod(kr.solve(getattr(kr.scenes, name), 1.0))
        assert rod.isotropic == isotropic and rod.section == pytest.approx(section, rel=1e-14)
    assert kr.rod(kr.solve(kr.scenes.dzhanibekov, 1.0)).load == (0, 0, 0)


def test_an_axis_between_equal_moments_is_a_principal_axis_too():
    body = kr.Body(mass=2.0, inertia=(2, 2, 1), com=(0.6, -0.8, 0), unphysical=True)
    path = path_of(kr.Scene(body, momentum=(1.0, 0.3, 0.5), gravity=1), 5.0, 51)
    rod = kr.rod(path)
    assert rod.frame[:, 2] == pytest.approx(path.apex, abs=1e-14)
    assert rod.lagrangian_density == pytest.approx(path.kinetic - path.potential, abs=1e-13)


def test_a_centre_of_mass_off_the_axes_has_no_rod():
    with pytest.raises(
        ValueError,
        match=r"no rod for this top, because its centre of mass, .*, lies on none of them",
    ):
        kr.rod(kr.solve(kr.scenes.asymmetric, 1.0))


def nutation_by_quadrature(scene, n=400):
    """Return the apex heights at the turning points, the nutation period and the precession rate.

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
    angle = np.pi * (np.arange(n) + 0.5) / n
    u = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(angle)
    pace = i1 / np.sqrt(2 * i1 * lever * (third - u))
    period = 2 * np.pi * pace.mean()
    return low, high, period, 2 * np.pi * (pace * (v - c * u) / (i1 * (1 - u * u))).mean() / period


@pytest.mark.parametrize(
    "scene",
    [
        kr.scenes.cusps,
        kr.Scene(CUBOID, momentum=(0.172, -1.862, 8), attitude=(0.9, 0.3, -0.1, 0.3), gravity=1),
    ],
    ids=["cusps", "cuboid"],
)
def test_nutation_and_precession_agree_with_the_closed_form(scene):
    scene = scene.replace(attitude=np.array(scene.attitude) / np.linalg.norm(scene.attitude))
    low, high, period, precession = nutation_by_quadrature(scene)
    expected = np.arccos(high), np.arccos(low), period, precession
    for states, accuracy in (50, 1e-4), (400, 1e-7):
        nutation = kr.apex(path_of(scene, 10.3 * period, round(10.3 * states) + 1)).nutation()
        assert nutation == pytest.approx(expected, rel=accuracy, abs=accuracy)


def test_nutation_is_the_same_backward_in_time():
    top = kr.exact(kr.scenes.cusps)
    expected = top.least_nutation, top.greatest_nutation, top.period, top.precession_rate
    for t in np.linspace(0, 40, 1601), -np.linspace(0, 40, 1601), -np.linspace(50, 90, 1601):
        nutation = kr.apex(kr.solve(kr.scenes.cusps, t)).nutation()
        assert nutation == pytest.approx(expected, rel=1e-5)


BODY = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)
HANGING = (0, 1, 0, 0)


@pytest.mark.parametrize("loss", [{"damping": 0.1}, {"friction": 0.05}])
def test_the_precession_with_damping_or_friction_is_that_of_the_azimuth(loss):
    scene = kr.scenes.cusps.replace(**loss)
    path = kr.solve(scene, np.linspace(0.0, 30.0, 3001))
    curve, height = kr.apex(path), path.apex[:, 2]
    lowest = np.flatnonzero((height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:])) + 1
    first, last = lowest[0], lowest[-1]
    rate = (curve.azimuth[last] - curve.azimuth[first]) / (path.t[last] - path.t[first])
    undamped = kr.exact(scene.replace(damping=None, friction=None)).precession_rate
    assert curve.nutation().precession_rate == pytest.approx(rate, rel=0.01)
    assert abs(rate - undamped) > 0.02 * abs(undamped)


@pytest.mark.parametrize(
    "scene",
    [
        kr.scenes.thesis,
        kr.scenes.sleeping,
        kr.scenes.fast,
        kr.Scene(BODY, momentum=(0.3, 0, 1.1), attitude=HANGING, gravity=1),
        kr.Scene(BODY, momentum=(0.5, 0, 0), gravity=1),
        kr.Scene(BODY, momentum=(2.5, 0, 0), attitude=HANGING, gravity=1),
        kr.scenes.sleeping.replace(momentum=(1e-6, 0, 3)),
    ],
    ids=["thesis", "sleeping", "fast", "hanging", "circling", "circling, hanging", "tiny"],
)
@pytest.mark.parametrize("lean", [0.0, 1e-9, -1e-9, 1e-5, -1e-5])
@pytest.mark.parametrize("sign", [1, -1])
def test_passages_of_the_vertical_do_not_change_the_precession(scene, lean, sign):
    """Compare with the closed form, which counts a half turn only if the apex misses the pole."""
    turn = np.cos(lean / 2), 0.0, np.sin(lean / 2), 0.0
    scene = scene.replace(attitude=kr.quaternion.multiply(turn, scene.attitude))
    top = kr.exact(scene)
    for count in 801, 803, 1601:
        path = kr.solve(scene, sign * np.linspace(0, 16 * top.period, count))
        found = kr.apex(path).nutation().precession_rate
        assert found == pytest.approx(top.precession_rate, rel=1e-3, abs=1e-3 / top.period)


@pytest.mark.parametrize("name", ["thesis", "sleeping", "fast", "cusps"])
def test_nutation_and_frequencies_have_the_same_precession(name):
    scene = getattr(kr.scenes, name)
    path = kr.solve(scene, np.linspace(0.0, 40.0 * kr.exact(scene).period, 4001), "taylor")
    precession = kr.frequencies(path).precession_rate
    assert kr.apex(path).nutation().precession_rate == pytest.approx(precession, rel=1e-5)


def test_turning_points_are_interpolated_from_twelve_states_per_nutation():
    period = kr.exact(kr.scenes.cusps).period
    nutation = kr.apex(path_of(kr.scenes.cusps, 10.3 * period, round(10.3 * 12) + 1)).nutation()
    assert nutation.period == pytest.approx(period, rel=5e-6)


FREE = kr.Scene(
    kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True),
    momentum=(1, 2, 3),
    attitude=(0.8, 0.6, 0, 0),
    gravity=0,
)


def test_the_trace_is_the_curve_of_the_apex():
    path = path_of(kr.scenes.cusps, 8.0, 801)
    trace = kr.apex(path)
    assert np.array_equal(trace.trace, path.apex)
    assert slope(trace.trace, trace.t) == pytest.approx(trace.rate[2:-2], abs=1e-6)
    assert np.abs(np.diff(trace.azimuth)).max() < 0.1


def test_steady_precession_has_no_nutation():
    nutation = kr.apex(path_of(kr.scenes.steady_precession, 20.0, 201)).nutation()
    assert np.isnan(nutation.period) and nutation.precession_rate == pytest.approx(1.0, rel=1e-11)


def test_nutation_is_refused_for_motions_without_nutation():
    with pytest.raises(ValueError, match="defined for Lagrange tops"):
        kr.apex(kr.solve(kr.scenes.kowalewski, [0, 1])).nutation()
    with pytest.raises(ValueError, match="1 lowest points in this path, but two are needed"):
        kr.apex(kr.solve(kr.scenes.thesis, np.linspace(0, 8, 81))).nutation()
    with pytest.raises(ValueError, match="without states"):
        kr.apex(kr.solve(kr.scenes.thesis, [])).nutation()


@pytest.mark.parametrize("scene", [kr.scenes.cusps, kr.scenes.thesis, FREE])
def test_nutation_is_refused_between_states_too_far_apart(scene):
    top = kr.exact(scene)
    period = 2 * abs(top.t_least - top.t_greatest)
    for states in 1.2, 2.3, 3.9:
        path = top(np.arange(0, 12 * period, period / states))
        with pytest.raises(ValueError, match="request at least 4 states per nutation"):
            kr.apex(path).nutation()
    nutation = kr.apex(top(np.arange(0, 12 * period, period / 4))).nutation()
    assert nutation.period == pytest.approx(period, rel=1e-2)


def test_nutation_of_a_damped_top_is_measured():
    scene = kr.scenes.cusps.replace(damping=(1e-9, 1e-9, 1e-9))
    nutation = kr.apex(kr.solve(scene, np.linspace(0, 10, 2001))).nutation()
    assert nutation.period == pytest.approx(kr.exact(kr.scenes.cusps).period, rel=1e-6)


def test_nutation_near_a_pole_loses_no_digits():
    """Check that small nutation angles are accurate, although the arc cosine is ill-conditioned."""
    scene = kr.Scene(
        kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True), momentum=(1e-6, 0, 5), gravity=1
    )
    top = kr.exact(scene)
    nutation = kr.apex(top(np.linspace(0, 5 * top.period, 2001))).nutation()
    assert nutation.greatest == pytest.approx(top.greatest_nutation, rel=1e-6)
    assert nutation.greatest < 1e-6 and nutation.least < 1e-15


def test_rods_are_drawn():
    pytest.importorskip("matplotlib")
    path = kr.solve(kr.scenes.kowalewski, np.linspace(0, 10, 101))
    axes = kr.rod(path).plot()
    (tube,) = axes.collections
    assert 1000 < len(tube.get_paths()) < 24 * 100, "of 2424 faces those that face the eye"
    assert kr.rod(path).plot(axes) is axes and len(axes.collections) == 2, "in axes that are there"


# Boundary values


def test_a_path_with_two_lowest_points_has_a_nutation():
    closed = kr.exact(kr.scenes.thesis)
    period = closed.period
    begin = closed.t_greatest + 0.9 * period
    motion = kr.solve(kr.scenes.thesis, np.linspace(begin, begin + 1.2 * period, 400))
    assert kr.apex(motion).nutation().period == pytest.approx(period, rel=1e-5)
    short = kr.solve(kr.scenes.thesis, np.linspace(begin, begin + 1.05 * period, 400))
    with pytest.raises(ValueError, match="the apex has 1 lowest points"):
        kr.apex(short).nutation()


def test_rods_have_a_repr():
    rod = kr.rod(kr.solve(kr.scenes.thesis, np.linspace(0, 1, 20)))
    assert repr(rod).startswith("<kreisel.Rod: isotropic, 20 frames")
    general = kr.rod(kr.solve(kr.scenes.kowalewski, np.linspace(0, 1, 20)))
    assert "anisotropic" in repr(general)
