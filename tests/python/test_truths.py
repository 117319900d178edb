"""Tests of all ways to compute a path against the table of true states, and of the table itself."""

import random
from decimal import Decimal

import kreisel as kr
import pytest
from truth import ROWS, find_error, make_scene, select_rows

from validation.references import truths

SUPPORTS, STIFF, LEANING = map(select_rows, ("support", "stiff", "leaning"))
CLOSED = {
    name: select_rows(name)
    for name in ("closed form", "kowalewski", "goryachev_chaplygin", "gyrostat")
}
BRIEF = [row for row in STIFF if row["maker"] == "series"]
# Errors of the methods of each order with steps of 0.005, and of methods without an order.
ERRORS = {0: 3e-9, 1: 0.03, 2: 3e-5, 4: 1e-8, 6: 1e-9, 8: 1e-9}


def list_misses(rows, limit, **options):
    """Return the rows whose truth a path misses by more than the limit, with the error."""
    errors = {
        row["name"]: find_error(kr.solve(make_scene(row), [row["t"]], **options), row)
        for row in rows
    }
    return {name: error for name, error in errors.items() if not error < limit}


def list_misses_of_ensembles(rows, limit, method):
    """Return the rows whose truth the member of an ensemble misses, forward or backward in time."""
    misses, parts = {}, [[row for row in rows if row["t"] * sign > 0] for sign in (1, -1)]
    for chosen in filter(None, parts):
        tops = kr.Scene.stack([make_scene(row) for row in chosen])
        paths = kr.solve(tops, [[row["t"]] for row in chosen], method).check()
        errors = {row["name"]: find_error(paths[i], row) for i, row in enumerate(chosen)}
        misses |= {name: error for name, error in errors.items() if not error < limit}
    return misses


@pytest.mark.parametrize("digits, limit", [(None, 2e-14), (16, 2e-14), (20, 1e-19), (30, 1e-28)])
def test_paths_on_all_supports_are_accurate_to_their_digits(digits, limit):
    assert len(SUPPORTS) > 50 and not list_misses(SUPPORTS, limit, digits=digits)


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_ensembles_on_all_supports_are_accurate(method):
    assert not list_misses_of_ensembles(SUPPORTS, 2e-14, method)


@pytest.mark.parametrize("digits", [None, 20, 30])
def test_error_estimates_are_not_far_below_the_true_error(digits):
    for row in SUPPORTS:
        path = kr.solve(make_scene(row), [row["t"]], digits=digits)
        assert find_error(path, row) < 4 * path.error + (0 if digits == 30 else 5e-16), row


@pytest.mark.parametrize("effect", ["rotor", "turning", "shaking", "damping", "gradient"])
def test_every_method_that_suits_a_scene_follows_it(effect):
    is_known = effect in ("rotor", "gradient")
    fewest = {"taylor", "strang", "rk4", "extrap", "implicit_midpoint"} if is_known else ()
    used = set()
    for row in select_rows("support", effect):
        scene = make_scene(row)
        for method in kr.methods.values():
            if method.suits(scene) and not scene.friction and abs(row["t"]) < 3:
                step = {} if method.adaptive or method.exact else {"step": 0.005}
                path = kr.solve(scene, [0.0, row["t"]], method.name, **step)
                assert find_error(path, row) < ERRORS[method.order], (method.name, row["name"])
                used.add(method.name)
    assert used >= {"taylor", *fewest}


@pytest.mark.parametrize("family", CLOSED)
def test_closed_forms_are_accurate_at_any_time(family):
    rows, limit = CLOSED[family], 2e-14
    assert not list_misses(rows, limit, method="exact")
    assert not list_misses_of_ensembles(rows, limit, "exact")


@pytest.mark.parametrize("family", ["kowalewski", "goryachev_chaplygin", "gyrostat"])
def test_certificates_of_closed_forms_bound_the_error(family):
    for row in CLOSED[family]:
        top = kr.exact(make_scene(row))
        assert 0.0 < top.certificate < 1e-13
        assert find_error(top(row["t"]), row) < 5e-15 + 30 * top.certificate, row["name"]


@pytest.mark.parametrize("family", CLOSED)
def test_series_follow_tops_with_closed_forms(family):
    rows = [row for row in CLOSED[family] if abs(row["t"]) < 10 and "1e4" not in row["name"]]
    for row in rows:
        path = kr.solve(make_scene(row), [row["t"]], "taylor", digits=20)
        assert find_error(path, row) < 1e-13, row["name"]


def test_strongly_damped_tops_need_few_steps():
    assert not list_misses(STIFF, 3e-14, max_steps=400)
    assert not list_misses_of_ensembles(STIFF, 3e-14, "auto")


@pytest.mark.parametrize("digits, limit", [(20, 1e-18), (30, 1e-27)])
def test_strongly_damped_tops_are_accurate_to_their_digits(digits, limit):
    assert len(BRIEF) == 8 and not list_misses(BRIEF, limit, digits=digits, max_steps=1000)


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_a_tiny_tilt_from_an_unstable_equilibrium_is_not_lost(method):
    assert not list_misses(LEANING, 1e-11, method=method)
    assert not list_misses_of_ensembles(LEANING, 1e-11, method)


def test_the_table_has_small_certificates():
    """Check that the truths are better than 30 digits, unless they judge doubles alone."""
    limits = {"radau": 1e-15, "quadrature": 1e-32, "series": 1e-36}
    assert len(ROWS) >= 220 and len({row["name"] for row in ROWS}) == len(ROWS)
    for row in ROWS:
        limit = 1e-20 if row["family"] == "leaning" else limits[row["maker"]]
        assert 0.0 < row["certificate"] < limit, row["name"]


def find_change(row, q, m):
    """Return the largest difference of new results from those of a row."""
    pairs = zip([*map(Decimal, row["q"]), *map(Decimal, row["m"])], [*q, *m], strict=True)
    return float(max(abs(a - b) for a, b in pairs))


def test_ten_random_rows_are_computed_again():
    families = "closed form", "support"
    quick = [row for row in ROWS if row["family"] in families and row["t"] in (7, 2.5, -1)]
    brief = [row for row in BRIEF if row["t"] == 0.004]
    for row in random.sample(quick, 8) + random.sample(brief, 2):
        q, m, certificate = truths.MAKERS[row["maker"]](row["scene"], row["t"])
        size = max(1, *(abs(float(x)) for x in row["m"]))
        assert find_change(row, q, m) < 1e-34 * size and certificate < 1e-35, row["name"]


@pytest.mark.parametrize(
    "name, maker, limit",
    [
        ("tilted, t = 7", "series", 1e-33),
        ("free, t = 7", "series", 1e-33),
        ("spherical, rotor and turning, t = 2.5", "radau", 1e-15),
        ("largest first, rotor and shaking, t = 6", "radau", 1e-15),
        ("kowalewski, damping and turning, t = 2.5", "radau", 1e-15),
    ],
)
def test_another_maker_gives_the_same_state(name, maker, limit):
    """Compare quadrature with Taylor series, and these with Radau's method in 80 bits."""
    (row,) = (row for row in ROWS if row["name"] == name)
    q, m, _ = truths.MAKERS[maker](row["scene"], row["t"])
    assert find_change(row, q, m) < limit
