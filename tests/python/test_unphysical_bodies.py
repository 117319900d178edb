"""Tests of bodies that no mass distribution can realize."""

import copy
import dataclasses
import math
import pickle
import re
import warnings
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from toolbox import python
from tops import TILT, matrix, words_for

CENTRAL, COM = (2e-4, 2e-4, 1e-4), (0, 0, 0.1)
MISTAKE = {"mass": 0.5, "inertia": CENTRAL, "com": COM}
MADE_UP = {"mass": 1, "inertia": (1, 1, 0.5), "com": (0, 0, 1)}
WATER = (0.345, 0.653, 1.0)
TOLD = "no body has this inertia about the fixed point"


def call_and_warning(make):
    """Call `make`, and return its result and its only warning."""
    with pytest.warns(UserWarning, match=TOLD) as caught_warnings:
        result = make()
    assert len(caught_warnings) == 1
    return result, caught_warnings[0]


# The inertia about the centre of mass


def test_moments_about_the_centre_of_mass_are_a_named_argument():
    body = kr.Body(0.5, inertia_about_com=CENTRAL, com=COM)
    np.testing.assert_allclose(body.moments, (0.0052, 0.0052, 1e-4), rtol=1e-15)
    assert body == kr.Body.from_com(0.5, CENTRAL, COM, (0, 0, 0)) and not body.unphysical
    assert dataclasses.replace(body, mass=0.4).inertia == body.inertia
    text = "mass = 0.5\ninertia_about_com = [2e-4, 2e-4, 1e-4]\ncom = [0, 0, 0.1]"
    scene = kr.Scene.from_toml(f"momentum = [0, 0, 1]\ngravity = 1\n[body]\n{text}")
    assert scene.body == body


@pytest.mark.parametrize(
    "words, exception, message",
    [
        (
            {"inertia": CENTRAL, "inertia_about_com": CENTRAL},
            ValueError,
            "exactly one .*, not both",
        ),
        ({"inertia": None}, ValueError, "exactly one of inertia and inertia_about_com, not none"),
        (
            {"com": None},
            TypeError,
            "com is missing: give the centre of mass relative to the fixed point",
        ),
        ({"inertia": None, "inertia_about_com": (1, 2)}, ValueError, "inertia_about_com must be 3"),
        ({"unphysical": 1}, TypeError, "unphysical must be True or False, not 1"),
        (
            {"inertia_rtol": -0.1},
            ValueError,
            "inertia_rtol must be at least 0 and less than 1, not -0.1",
        ),
        ({"inertia_rtol": 1}, ValueError, "inertia_rtol must be at least 0 and less than 1, not 1"),
        ({"inertia_rtol": "1"}, TypeError, "inertia_rtol must be a number"),
        ({"inertia_rtol": np.nan}, ValueError, "inertia_rtol must be finite"),
    ],
)
def test_invalid_arguments_of_a_body_are_refused(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.Body(**{**MISTAKE, **words})


# Impossible bodies


@pytest.mark.parametrize(
    "make",
    [
        lambda: kr.Body(**MISTAKE),
        lambda: kr.Body.symmetric(0.5, 2e-4, 1e-4, 0.1),
        lambda: kr.Body(0.5, np.diag(CENTRAL), COM),
        lambda: kr.Body(1, matrix(TILT) @ np.diag((1, 1, 0.5)) @ matrix(TILT).T, (0.3, 0, 1.0)),
        lambda: kr.Body(1, (1, 2, 3), (0.1, 0.2, 0.01)),
        lambda: kr.Body(1, (1, 2, 2), (1e200, 1e200, 0)),
        lambda: kr.Body.from_com(1, (1, 1, 2.1), (0, 0, 1), (0, 0, 0)),
        lambda: dataclasses.replace(kr.Body.cone(1, 2, (0, 0, 0), mass=1), mass=2),
        lambda: (
            kr.Scene.from_toml(
                "momentum = [0, 0, 1]\ngravity = 1\n"
                "[body]\nmass = 1\ninertia = [1, 1, 0.5]\ncom = [0, 0, 1]"
            ).body
        ),
    ],
)
def test_unphysical_bodies_warn_at_the_calling_line(make):
    body, warning = call_and_warning(make)
    assert body.unphysical and Path(warning.filename) == Path(__file__)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert dataclasses.replace(body) == body


def test_the_warning_shows_the_remaining_moments_and_a_remedy():
    _, warning = call_and_warning(lambda: kr.Body(**MISTAKE))
    text = str(warning.message)
    assert "-0.0048, -0.0048, 0.0001" in text
    assert "inertia_about_com" in text and "unphysical=True" in text


@pytest.mark.parametrize("scale", [1e-30, 1, 1e30])
def test_physical_bodies_do_not_warn(scale):
    rng = np.random.default_rng(11)
    for _ in range(200):
        points = rng.normal(size=(rng.integers(3, 6), 3)) * scale
        points[:, 2] *= rng.choice([1.0, 1e-9, 0.0])
        points += rng.normal(size=3) * scale * 10 ** rng.uniform(-3, 3)
        masses = rng.uniform(0.1, 1, len(points))
        products = np.einsum("n,ni,nj->ij", masses, points, points)
        body = kr.Body(
            masses.sum(),
            np.eye(3) * np.trace(products) - products,
            masses @ points / masses.sum(),
        )
        assert not body.unphysical


def test_a_body_warns_once():
    body, _ = call_and_warning(lambda: kr.Body(**MISTAKE))
    scene = kr.Scene(body, body_velocity=(0, 0, 30.0), gravity=1)
    run = kr.start(scene, "rk4", step=0.01)
    run.to(0.5)
    for again in (
        kr.Scene.from_toml(scene.to_toml()).body,
        kr.resume(run.checkpoint).scene.body,
        pickle.loads(pickle.dumps(run)).scene.body,
        pickle.loads(pickle.dumps(scene)).body,
        copy.deepcopy(scene).body,
        dataclasses.replace(body, mass=0.6),
        scene.replace(gravity=2).body,
        eval(repr(body), {"Body": kr.Body}),
        kr.solve(scene, 1, "rk4", step=0.01).scene.body,
    ):
        assert again.unphysical and again.inertia == body.inertia


def test_bodies_passed_as_unphysical_do_not_warn():
    body = kr.Body(**MADE_UP, unphysical=True)
    assert body.unphysical and repr(body).endswith("com=(0.0, 0.0, 1.0), unphysical=True)")
    assert kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True) == body
    assert kr.Body.from_com(1, (0.1, 0.1, 0.5), (0, 0, 1), (0, 0, 0), unphysical=True).unphysical
    assert "unphysical = true" in kr.Scene(body, (0, 0, 1), gravity=1).to_toml()
    real = kr.Body.cone(1, 2, (0, 0, 0), mass=1)
    assert "unphysical" not in repr(real) + kr.Scene(real, (0, 0, 1), gravity=1).to_toml()
    assert dataclasses.replace(real, unphysical=True) == real


def test_physical_bodies_keep_the_flag():
    one = kr.Body(1, (3, 3, 1), (0, 0, 0.5), unphysical=True)
    assert one.unphysical and dataclasses.replace(one, com=(0, 0, 5)).unphysical
    assert pickle.loads(pickle.dumps(one)).unphysical
    assert kr.Scene.from_toml(kr.Scene(one, (0, 0, 1), gravity=1).to_toml()).body.unphysical


def test_named_scenes_are_flagged_as_unphysical():
    result = python("import warnings; warnings.simplefilter('error'); import kreisel")
    assert result.returncode == 0, result.stderr
    unphysical = [name for name in kr.scenes.about if kr.scenes.get_scene(name).body.unphysical]
    assert len(unphysical) == 10 and "dzhanibekov" not in unphysical


def test_the_command_line_warns_in_one_line(tmp_path):
    file = tmp_path / "top.toml"
    file.write_text(
        "momentum = [0, 0, 1]\ngravity = 1\n"
        "[body]\nmass = 1\ninertia = [1, 1, 0.5]\ncom = [0, 0, 1]"
    )
    result = python("from kreisel._cli import main; main()", "solve", str(file), "--t", "1")
    lines = [line for line in result.stderr.splitlines() if line]
    assert result.returncode == 0 and len(lines) == 1 and lines[0].startswith(f"Warning: {TOLD}")


# Rounded moments


def test_published_moments_are_not_changed():
    body = kr.Body(1, WATER, (0, 0, 0), inertia_rtol=0.0021)
    assert body.moments == WATER and body.inertia_rtol == 0.0021 and not body.unphysical
    assert eval(repr(body), {"Body": kr.Body}) == body
    assert pickle.loads(pickle.dumps(body)) == body
    assert dataclasses.replace(body, mass=2).inertia_rtol == 0.0021
    scene = kr.Scene(body, (0.1, 0.2, 1.0), gravity=1)
    assert kr.Scene.from_toml(scene.to_toml()) == scene
    assert "inertia_rtol = 0.0021\n" in scene.to_toml()
    run = kr.start(scene, "rk4", step=0.01)
    run.to(0.5)
    assert kr.resume(run.checkpoint).scene == scene
    rotated_body = kr.Body(
        1, matrix(TILT) @ np.diag(WATER) @ matrix(TILT).T, (0, 0, 0), inertia_rtol=0.0021
    )
    np.testing.assert_allclose(sorted(rotated_body.moments), WATER, rtol=1e-15)


@pytest.mark.parametrize("inertia_rtol", [0, 0.002])
def test_moments_beyond_the_tolerance_are_refused_with_a_hint(inertia_rtol):
    with pytest.raises(ValueError, match=re.escape("1.0 > 0.345 + 0.653")) as error:
        kr.Body(1, WATER, (0, 0, 0), inertia_rtol=inertia_rtol)
    hint = float(re.search(r"inertia_rtol=([\d.]+) would accept it", str(error.value))[1])
    assert kr.Body(1, WATER, (0, 0, 0), inertia_rtol=hint).moments == WATER


def test_moments_far_off_get_no_hint():
    with pytest.raises(ValueError, match=r"4\.0 > 1\.0 \+ 2\.0") as error:
        kr.Body(1, (1, 2, 4), (0, 0, 0))
    assert "would accept it" not in str(error.value)


HEAVY = kr.Body(1, (0.345, 0.653, 1.0), (0.1, 0.2, 0.3), inertia_rtol=0.0021, unphysical=True)
ROUNDED = [
    kr.Body(1, WATER, (0, 0, 0), inertia_rtol=0.0021),
    HEAVY,
    kr.Body(1, (0.4, 0.4, 0.81), (0, 0, 0.3), inertia_rtol=0.02, unphysical=True),
]


def choose_attitude_limit(name):
    """Return an upper limit of the attitude error; the methods of fixed step use 2^-9."""
    if name in ("exact", "taylor"):
        return 3e-15
    method = kr.methods[name]
    return 1e-9 if method.adaptive else {1: 1e-3, 2: 5e-5, 4: 1e-10}.get(method.order, 3e-15)


@pytest.mark.parametrize("name", kr.methods)
@pytest.mark.parametrize("body", ROUNDED, ids=["water", "heavy", "lagrange"])
def test_every_method_solves_or_refuses_rounded_bodies(name, body):
    """Check that energy is conserved and that the attitude agrees with a 20-digit solution."""
    scene = kr.Scene(body, (0.1, 0.2, 1.0), attitude=(0.8, 0.6, 0, 0), gravity=1)
    if not kr.methods[name].suits(scene):
        with pytest.raises(ValueError, match="does not apply to this body"):
            kr.solve(scene, 1, name, **words_for(name))
        return
    step = {} if kr.methods[name].adaptive or name == "exact" else {"step": 2**-9}
    path = kr.solve(scene, [1.0], name, **step)
    true = kr.solve(scene, [1.0], "taylor", digits=20)
    limit = choose_attitude_limit(name)
    assert kr.attitude_error(path.q[-1], true.q[-1]) < limit
    energy = kr.solve(scene, [0.0]).energy[0]
    assert path.energy[0] == pytest.approx(energy, abs=0.1 * limit + 3e-15)


def test_a_rounded_body_follows_eulers_equations():
    """Compare solutions with an independent integration of Euler's equations."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    i1, i2, i3 = WATER

    def euler(_, m):
        return [
            m[1] * m[2] * (1 / i3 - 1 / i2),
            m[2] * m[0] * (1 / i1 - 1 / i3),
            m[0] * m[1] * (1 / i2 - 1 / i1),
        ]

    scene = kr.Scene(ROUNDED[0], (0.1, 0.2, 1.0), gravity=1)
    true = solve_ivp(euler, (0, 20), scene.momentum, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    for method in ("exact", "taylor"):
        momentum = kr.solve(scene, [20.0], method).body_momentum[0]
        np.testing.assert_allclose(momentum, true, atol=1e-9)


def test_the_viewer_refuses_rounded_bodies():
    with pytest.raises(ValueError, match="the viewer does not support a tolerance"):
        kr.view(kr.Scene(ROUNDED[0], (0, 0, 1), gravity=1), open=False)


# Boundary values


def test_inertia_rtol_is_below_one():
    tensor = np.diag([2.0, 3.0, 4.0])
    assert kr.Body(1.0, tensor, (0, 0, 0), inertia_rtol=0.0).moments == (2.0, 3.0, 4.0)
    almost = kr.Body(1.0, tensor, (0, 0, 0), inertia_rtol=math.nextafter(1.0, 0.0))
    assert almost.inertia_rtol < 1.0
    for wrong in (1.0, -5e-324, math.nan):
        with pytest.raises(ValueError, match="inertia_rtol must be"):
            kr.Body(1.0, tensor, (0, 0, 0), inertia_rtol=wrong)
