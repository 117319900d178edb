"""Tests that every method has the properties stated in the table of methods.

All tops are initially tilted. An upright top would hide first-order errors, because gravity exerts
no torque on it.
"""

from itertools import pairwise

import kreisel as kr
import numpy as np
import pytest

from validation.references.orders import BODIES, measure_order
from validation.references.orders import tilt_scene as scene


def cases(is_member=lambda name, body: True, **flags):
    """Return all pairs (method, body) in which the method has the given properties."""
    return [
        (name, body)
        for name, method in kr.methods.items()
        if all(getattr(method, flag) == value for flag, value in flags.items())
        for body in BODIES
        if method.applies_to(BODIES[body]) and is_member(name, body)
    ]


def has_visible_leading_error(name, body):
    """Return True unless rounding errors may hide the leading term of the truncation error."""
    return kr.methods[name].order <= 4 or body != "goryachev_chaplygin"


@pytest.mark.parametrize("name, body", cases(has_visible_leading_error, adaptive=False))
def test_orders_agree_with_the_table(name, body):
    """Check that measured orders of convergence agree with the table of methods."""
    order = kr.methods[name].order
    slopes = measure_order(name, body)
    assert all(slope is not None and abs(slope - order) < 0.2 for slope in slopes.values()), slopes


def test_extrapolation_agrees_with_the_reference_of_the_orders():
    for body in BODIES:
        one = kr.solve(scene(body), 2, method="kahan_li8", step=1 / 2000)
        two = kr.solve(scene(body), 2, method="extrap", tol=1e-13)
        assert kr.attitude_error(one.q[-1], two.q[-1]) < 2e-12


@pytest.mark.parametrize("name, body", cases(adaptive=True, exact=False))
def test_errors_decrease_with_the_tolerance(name, body):
    top = scene(body)
    # An extrapolation method would not be accurate enough as a reference here.
    truth = kr.solve(top, 10, method="taylor", digits=20)
    errors = [
        kr.attitude_error(kr.solve(top, 10, method=name, tol=tol).q[-1], truth.q[-1])
        for tol in (1e-6, 1e-9, 1e-12)
    ]
    assert errors[0] < 1e-2 and errors[1] < 1e-5 and errors[2] < 1e-8
    # Below 1e-8 the error of the semi-implicit method is due to rounding errors of its matrix.
    floor = 1e-8 if name == "gsl_bsimp" else 0.0
    assert all(a > b or a < floor for a, b in pairwise(errors))


@pytest.mark.parametrize("name, body", cases(adaptive=False, reversible=True))
def test_reversible_methods_return_to_the_start(name, body):
    path = kr.solve(scene(body), 30, method=name, step=0.05)
    back = kr.solve(path.scene_at(-1), -30, method=name, step=0.05)
    assert kr.attitude_error(back.q[-1], path.q[0]) < 1e-11
    assert np.abs(back.m[-1] - path.m[0]).max() < 1e-11


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
    path = kr.solve(scene("free"), 1e4, method="hirota_kimura", step=h, every=10)
    w = np.linalg.matmul(path.frame, path.velocity[:, :, None])[:, :, 0]
    a = np.array([(i2 - i3) / i1, (i3 - i1) / i2, (i1 - i2) / i3])
    one = 1 - h * h / 4 * np.array([a[1] * a[2], a[2] * a[0], a[0] * a[1]]) * w**2
    for i in range(3):
        ratio = one[:, i] / one[:, (i + 1) % 3]
        assert np.ptp(ratio) < 1e-12 and np.ptp(one[:, i]) > 1e-6
    assert np.ptp(np.linalg.norm(path.m, axis=1)) > 1e-6


def is_compensated(name, body):
    return name in ("kahan_li8", "blanes_moan6") and body in ("kowalewski", "asymmetric")


@pytest.mark.parametrize("name, body", cases(is_compensated))
def test_rounding_errors_do_not_accumulate(name, body):
    """Check that the energy error stays far below the sum of uncompensated rounding errors.

    At the step size 0.01, the truncation error of the tested methods is negligible.
    """
    path = kr.solve(scene(body), 600, method=name, step=0.01, every=50)
    assert np.ptp(path.energy) < 1e-14 * np.abs(path.kinetic).max()


@pytest.mark.parametrize("name", ["veselov2", "veselov4"])
def test_veselov_conserves_the_energy_of_free_tops(name):
    path = kr.solve(scene("free"), 5000, method=name, step=0.05, every=100)
    assert path.energy_error < 1e-11 and path.stats.iterations > path.stats.steps


@pytest.mark.parametrize(
    "name", [name for name, method in kr.methods.items() if method.implicit and not method.adaptive]
)
def test_implicit_methods_raise_if_they_do_not_converge(name):
    with pytest.raises(kr.Error, match="did not converge") as failure:
        kr.solve(
            scene("asymmetric", momentum=(30.0, 40.0, -20.0)), 50, method=name, step=0.01, tol=1e-30
        )
    assert failure.value.status == "ERR_CONVERGENCE" and failure.value.path.t[-1] < 5


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


def has_conserved_quantity(name, body):
    return body in CONSERVED.get(kr.methods[name].conserves, {})


def test_conserved_quantities_in_the_table_are_known():
    assert {method.conserves for method in kr.methods.values()} <= set(CONSERVED)


@pytest.mark.parametrize("name, body", cases(has_conserved_quantity))
def test_conserved_quantities_in_the_table_are_conserved(name, body):
    method = kr.methods[name]
    if method.adaptive:
        path = kr.solve(scene(body), np.linspace(0, 500, 201), method=name)
    else:
        path = kr.solve(scene(body), 500, method=name, step=0.05, every=50)
    for quantity in CONSERVED[method.conserves][body]:
        limit = 1e-12 if quantity == "vertical_momentum" else 1e-11
        assert np.ptp(getattr(path, quantity)) < limit, quantity


@pytest.mark.parametrize("body", ["lagrange", "kowalewski", "goryachev_chaplygin"])
def test_strang_is_exact_for_free_symmetric_bodies(body):
    top = scene(body, gravity=0.0)
    one, many = (kr.solve(top, 12.0, method="strang", step=h) for h in (12.0, 0.1))
    assert kr.attitude_error(one.q[-1], many.q[-1]) < 1e-13
    assert np.abs(one.m[-1] - top.momentum).max() < 1e-15


def test_fourth_integrals_are_constant():
    kowalewski = kr.solve(scene("kowalewski"), np.linspace(0, 50, 101), method="extrap", tol=1e-13)
    assert np.ptp(kowalewski.kowalewski) < 1e-9 * kowalewski.kowalewski[0]
    level = scene("goryachev_chaplygin", momentum=(0.172, -1.862, 0.0))
    path = kr.solve(level, np.linspace(0, 50, 101), method="extrap", tol=1e-13)
    assert np.abs(path.goryachev_chaplygin).max() > 1e-3
    assert np.ptp(path.goryachev_chaplygin) < 1e-9
    other_path = kr.solve(
        scene("goryachev_chaplygin"), np.linspace(0, 50, 101), method="extrap", tol=1e-13
    )
    assert np.ptp(other_path.goryachev_chaplygin) > 1e-2


@pytest.mark.parametrize(
    "name, body",
    [(name, body) for name in kr.methods for body in BODIES if (name, body) not in cases()],
)
def test_methods_refuse_other_bodies(name, body):
    with pytest.raises(ValueError, match=r"does not apply.*it is for"):
        kr.solve(kr.Scene(BODIES[body], momentum=(1, 2, 3), gravity=1), 1, method=name, step=0.1)


@pytest.mark.parametrize(
    "name, bodies",
    [
        ("hirota_kimura", {"free"}),
        ("blanes_moan6", {"lagrange", "kowalewski", "goryachev_chaplygin"}),
        ("strang", set(BODIES)),
    ],
)
def test_methods_apply_to_the_expected_bodies(name, bodies):
    assert {body for method, body in cases() if method == name} == bodies
