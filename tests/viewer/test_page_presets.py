"""Tests that the motions in the viewer's presets agree with their descriptions."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    WIDE,
    advance,
    load,
    measure_top,
    read_record,
    read_scene,
    read_states,
    scene_in_python,
)

FOUR = ("red", "yellow", "violet", "green")


def open_exercise(page, preset, exercise=None):
    """Open a preset or one of its exercises."""
    load(page, preset)
    if exercise:
        page.get_by_role("button", name=exercise, exact=True).click()
        page.evaluate("kreisel.page.setRunning(false)")


def largest_change(page, top, name, end=None):
    """Return the largest change of an integral of motion up to the time `end`."""
    values = read_record(page, top, name)
    times = np.array(page.evaluate("kreisel.simulation.getTimes()"))
    return np.nanmax(np.abs(values - values[0])[times <= (end or np.inf)])


def largest_errors(page, *times):
    """Return, for each time, the largest attitude error of each top up to this time."""
    errors = []
    for t in times:
        advance(page, t)
        roles = page.evaluate("kreisel.page.tops.map(({role}) => role)")
        tops = (i for i, role in enumerate(roles) if role != "ghost")
        errors.append([np.nanmax(read_record(page, i, "error")) for i in tops])
    return np.array(errors)


# Comparison of methods


def test_the_text_on_equal_steps_is_true(page):
    open_exercise(page, "Compare four")
    assert largest_errors(page, 100).argmax() == FOUR.index("yellow")
    yellow, green = 1, 3
    early = [largest_change(page, i, "energy") for i in (yellow, green)]
    advance(page, 800)
    late = [largest_change(page, i, "energy") for i in (yellow, green)]
    assert max(largest_change(page, i, "energy") for i in (0, 2, 3)) < late[0] < 1.05 * early[0]
    assert late[1] > 2 * early[1]


def test_the_violet_top_is_nearest_to_the_exact_motion(page):
    open_exercise(page, "Compare four", "Measured against the exact motion")
    assert read_scene(page)["ghost"] and read_scene(page)["chart"] == "error"
    assert largest_errors(page, 100)[0].argmin() == FOUR.index("violet")


def test_the_energy_of_runge_kutta_decreases(page):
    open_exercise(page, "Compare four", "Classical Runge-Kutta instead")
    advance(page, 400)
    assert measure_top(page, 3, "energy") - read_record(page, 3, "energy")[0] < -0.1


def test_the_text_on_equal_work_is_true(page):
    open_exercise(page, "Equal work")
    assert [top["step"] for top in page.evaluate("kreisel.page.tops")] == [0.03125, 5]
    (red, violet), (later, after) = largest_errors(page, 100, 1000)
    assert after < later / 10 and violet < red / 10
    assert later / red == pytest.approx(10, rel=0.2) and after > 15 * violet
    energy = [largest_change(page, i, "energy", t) for i in (0, 1) for t in (100, 1000)]
    assert energy[1] < 1.1 * energy[0] and energy[3] > 3 * energy[2] and energy[3] < energy[0] / 100


def test_the_text_on_less_work_is_true(page):
    open_exercise(page, "Equal work", "Less work for violet")
    advance(page, 300)
    times = np.array(page.evaluate("kreisel.simulation.getTimes()"))
    red, violet = (read_record(page, i, "error") for i in (0, 1))
    ratio = violet[1:] / red[1:]
    assert (ratio[times[1:] <= 30] < 1.5).all() and (ratio[times[1:] >= 35] > 1.05).all()
    assert (ratio[times[1:] >= 250] > 6).all()


def test_a_small_energy_error_does_not_prove_a_good_motion(page):
    open_exercise(page, "Energy and motion")
    red, violet = largest_errors(page, 30)[0]
    assert violet > 20 * red
    energy = [largest_change(page, i, "energy") for i in (0, 1)]
    assert energy[1] < energy[0] / 2
    advance(page, 400)
    assert largest_change(page, 1, "energy") > 2 * largest_change(page, 0, "energy")


def test_the_modified_energy_is_conserved_up_to_rounding(page):
    open_exercise(page, "Energy and motion", "What red conserves")
    path = kr.solve(scene_in_python(read_scene(page)), 20, "bobenko_suris", step=0.05, every=1)
    advance(page, 20)
    assert measure_top(page, 0, "modified_energy") == path.modified_energy(0.05)[-1]
    assert (
        largest_change(page, 0, "modified_energy") < 1e-12 < 0.1 < largest_change(page, 0, "energy")
    )
    assert page.get_by_role("columnheader", name="H_ε").is_visible()


def test_large_steps_lose_runge_kutta(page):
    open_exercise(page, "Energy and motion", "Three times the steps")
    red, violet = largest_errors(page, 15)[0]
    assert red < 0.2 and violet > 1


def test_methods_have_separate_or_common_steps(page):
    load(page, methods=["strang", "rk4"], step=[0.01])
    steps = "kreisel.page.tops.map(({step}) => step)"
    own = page.get_by_label("Second step for the other methods only")
    own.check()
    assert page.evaluate(steps) == [0.01, 0.2]
    advance(page, 2)
    program, names = page.get_by_label("Equivalent Python program").input_value(), {}
    exec(program.replace(", 100, ", ", 2, "), names)
    ends = [[2, *end.attitude, *end.momentum] for end in names["ends"]]
    assert ends == read_states(page)
    page.get_by_label("Each with a second step too").check()
    assert page.evaluate(steps) == [0.01, 0.2] * 2 and not own.is_checked()


@pytest.mark.parametrize(
    "preset, exercise", [("Steady precession", None), ("Elastic rod", "A helix")]
)
def test_steady_precession_keeps_its_tilt(page, preset, exercise):
    open_exercise(page, preset, exercise)
    advance(page, 30)
    assert largest_change(page, 0, "nutation") < 1e-12


# Tops without a closed form


def test_the_change_of_k_is_a_numerical_error(page):
    open_exercise(page, "Kowalewski")
    advance(page, 5)
    coarse = largest_change(page, 0, "kowalewski")
    open_exercise(page, "Kowalewski", "A hundredth of the step")
    advance(page, 5)
    assert largest_change(page, 0, "kowalewski") == pytest.approx(coarse / 1e4, rel=0.05)
    open_exercise(page, "Kowalewski", "Another start")
    advance(page, 50)
    assert largest_change(page, 0, "kowalewski") < 1e-3 * abs(read_record(page, 0, "kowalewski")[0])
    open_exercise(page, "Kowalewski", "Another box")
    assert page.evaluate("kreisel.page.kind") == "general" and read_scene(page)["chart"] == "energy"


def test_g_is_constant_for_a_horizontal_momentum(page):
    changes = []
    for exercise in (None, "Another level start", "Lift m a little", "Lift m a lot"):
        open_exercise(page, "Goryachev-Chaplygin", exercise)
        advance(page, 50)
        assert read_scene(page)["chart"] == "goryachev_chaplygin"
        changes.append(largest_change(page, 0, "goryachev_chaplygin"))
    assert max(changes[:2]) < 1e-5 and changes[2] > 1e-2 and changes[3] > 15 * changes[2]


@pytest.mark.parametrize(
    "exercise, axis, turns",
    [
        (None, 1, True),
        ("Start more exactly", 1, True),
        ("About the long axis", 0, False),
        ("About the short axis", 2, False),
    ],
)
def test_only_the_middle_axis_flips_over(page, exercise, axis, turns):
    open_exercise(page, "Dzhanibekov effect", exercise)
    path = kr.solve(scene_in_python(read_scene(page)), 60, "strang", step=0.01, every=10)
    component = path.body_momentum[:, axis] / np.linalg.norm(path.m, axis=1)
    assert abs(component[0]) > 0.99 and (np.ptp(np.sign(component)) > 0) == turns


def test_the_texts_on_the_elastic_rod_are_true(page):
    rods = {}
    for exercise in (None, "A plane curve", "Twist it more"):
        open_exercise(page, "Elastic rod", exercise)
        path = kr.solve(scene_in_python(read_scene(page)), np.linspace(0, 40, 801), "taylor")
        rods[exercise] = path
    open_exercise(page, "Elastic rod", "A helix")
    advance(page, 20)  # the longest rod that can be drawn
    assert read_scene(page)["show"]["rod"] and read_scene(page)["show"]["solid"] == "none"
    assert 20 * abs(kr.exact(scene_in_python(read_scene(page))).precession_rate) > 10 * 2 * np.pi
    plane = np.linalg.svd(rods["A plane curve"].apex, compute_uv=False)
    assert plane[2] < 1e-6 * plane[0]
    assert abs(rods["Twist it more"].spin[0]) > 3 * abs(rods[None].spin[0])


# Texts


def test_texts_are_visible(page):
    page.set_viewport_size({"width": WIDE[0], "height": WIDE[1]})
    node = "document.getElementById('about')"
    hidden_texts = page.evaluate(f"""kreisel.presets.flatMap((preset) => {{
        kreisel.page.load(preset);
        return [preset, ...preset.exercises].map((each) => {{
            const buttons = [...document.querySelectorAll('.exercise')];
            buttons.find((button) => button.textContent === each.title)?.click();
            kreisel.page.setRunning(false);
            return {node}.scrollHeight > {node}.clientHeight + 1 ? each.title ?? each.name : null;
        }});
    }}).filter(Boolean)""")
    assert hidden_texts == []
