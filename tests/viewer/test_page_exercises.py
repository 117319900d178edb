"""Tests that the motions of presets and exercises are those that their texts describe."""

import kreisel as kr
import numpy as np
import pytest

COURSES = [
    ("A spinning top", None, "loops"),
    ("Cusps", None, "cusps"),
    ("Waves", None, "waves"),
    ("Steady precession", None, "steady"),
    ("Fast precession", None, "steady"),
    ("Pendulum", None, "pendulum"),
    ("Pendulum", "Turn it upside down", "pendulum"),
    ("Elastic rod", "A plane curve", "pendulum"),
    ("Gyroscope", None, "steady"),
    ("Gyroscope", "Let it go at rest", "cusps"),
    ("Gyroscope", "Half the rotor", "steady"),
    ("Gyroscope", "Stop the rotor", "pendulum"),
]
FOUR = ("red", "yellow", "violet", "green")


def largest_change(page, top, name, end=np.inf):
    """Return the largest change of a measure up to the time `end`."""
    values = page.read_record(top, name)
    return np.nanmax(np.abs(values - values[0])[page.read_times() <= end])


def largest_errors(page, *times):
    """Return, for each time, the largest attitude error of each top up to this time."""
    errors = []
    for t in times:
        page.advance(t)
        tops = (i for i, top in enumerate(page.read_tops()) if top["role"] != "ghost")
        errors.append([np.nanmax(page.read_record(i, "error")) for i in tops])
    return np.array(errors)


# Tops with a closed form


def test_the_axis_moves_as_described(page):
    for preset, exercise, course in COURSES:
        page.open_exercise(preset, exercise)
        assert page.read_exact().motion_type == course, (preset, exercise)


@pytest.mark.parametrize("exercise", [None, "146 and 137", "Both fast"])
def test_the_sleeping_tops_sleep_above_the_critical_spin(page, exercise):
    page.open_exercise("Sleeping top", exercise)
    critical = page.read_exact().critical_spin
    spins = [page.measure_top(i, "spin") for i in (0, 1)]
    page.advance(30)
    tilts = [np.degrees(page.read_record(i, "nutation").max()) for i in (0, 1)]
    assert spins[0] > critical and tilts[0] < 4
    assert (spins[1] > critical) == (tilts[1] < 25) == (exercise == "Both fast")


def test_the_elastic_rods_are_a_helix_a_plane_curve_and_twisted(page):
    rods = {}
    for exercise in (None, "A helix", "A plane curve", "Twist it more"):
        page.open_exercise("Elastic rod", exercise)
        assert page.read_scene()["show"]["rod"]
        rods[exercise] = page.read_exact()
    apex = rods["A plane curve"](np.linspace(0, 40, 801)).apex
    spread = np.linalg.svd(apex, compute_uv=False)
    assert spread[2] < 1e-6 * spread[0]
    assert 20 * abs(rods["A helix"].precession_rate) > 10 * 2 * np.pi
    spins = [rods[exercise](0.0).spin[0] for exercise in (None, "Twist it more")]
    assert abs(spins[1]) > 3 * abs(spins[0])


# Comparison of methods


def test_equal_steps_and_the_exact_motion_rank_the_four_methods(page):
    page.open_exercise("Compare four")
    assert largest_errors(page, 100).argmax() == FOUR.index("yellow")
    yellow, green = 1, 3
    early = [largest_change(page, i, "energy") for i in (yellow, green)]
    page.advance(800)
    late = [largest_change(page, i, "energy") for i in (yellow, green)]
    assert max(largest_change(page, i, "energy") for i in (0, 2, 3)) < late[0] < 1.05 * early[0]
    assert late[1] > 2 * early[1]
    page.open_exercise("Compare four", "Measured against the exact motion")
    assert page.read_scene()["ghost"] and page.read_scene()["chart"] == "error"
    assert largest_errors(page, 100)[0].argmin() == FOUR.index("violet")
    page.open_exercise("Compare four", "Classical Runge-Kutta instead")
    page.advance(400)
    assert page.measure_top(3, "energy") - page.read_record(3, "energy")[0] < -0.1


def test_at_equal_work_the_error_grows_linearly_and_quadratically(page):
    page.open_exercise("Equal work")
    assert [top["step"] for top in page.read_tops()] == [0.03125, 5]
    (red, violet), (later, after) = largest_errors(page, 100, 1000)
    assert after < later / 10 and violet < red / 10
    assert later / red == pytest.approx(10, rel=0.2) and after > 15 * violet
    energy = [largest_change(page, i, "energy", t) for i in (0, 1) for t in (100, 1000)]
    assert energy[1] < 1.1 * energy[0] and energy[3] > 3 * energy[2] and energy[3] < energy[0] / 100
    page.open_exercise("Equal work", "Less work for violet")
    page.advance(300)
    times, (red, violet) = page.read_times(), (page.read_record(i, "error") for i in (0, 1))
    ratio = violet[1:] / red[1:]
    assert (ratio[times[1:] <= 30] < 1.5).all() and (ratio[times[1:] >= 35] > 1.05).all()
    assert (ratio[times[1:] >= 250] > 6).all()


def test_a_small_energy_error_does_not_prove_a_good_motion(page):
    page.open_exercise("Energy and motion")
    red, violet = largest_errors(page, 30)[0]
    assert violet > 20 * red
    assert largest_change(page, 1, "energy") < largest_change(page, 0, "energy") / 2
    page.advance(400)
    assert largest_change(page, 1, "energy") > 2 * largest_change(page, 0, "energy")
    page.open_exercise("Energy and motion", "What red conserves")
    page.advance(20)
    changes = [largest_change(page, 0, name) for name in ("modified_energy", "energy")]
    assert changes[0] < 1e-12 < 0.1 < changes[1]
    page.open_exercise("Energy and motion", "Three times the steps")
    red, violet = largest_errors(page, 15)[0]
    assert red < 0.2 and violet > 1


# Tops without a closed form


def test_the_change_of_k_is_a_numerical_error(page):
    changes = []
    for exercise in (None, "A hundredth of the step"):
        page.open_exercise("Kowalewski", exercise)
        page.advance(5)
        changes.append(largest_change(page, 0, "kowalewski"))
    assert changes[1] == pytest.approx(changes[0] / 1e4, rel=0.05)
    page.open_exercise("Kowalewski", "Another start")
    page.advance(50)
    assert largest_change(page, 0, "kowalewski") < 1e-3 * abs(page.read_record(0, "kowalewski")[0])
    page.open_exercise("Kowalewski", "Another box")
    assert (
        page.evaluate("kreisel.page.kind") == "general" and page.read_scene()["chart"] == "energy"
    )


def test_g_is_constant_for_a_horizontal_momentum(page):
    changes = []
    for exercise in (None, "Another level start", "Lift m a little", "Lift m a lot"):
        page.open_exercise("Goryachev-Chaplygin", exercise)
        page.advance(50)
        changes.append(largest_change(page, 0, "goryachev_chaplygin"))
    assert max(changes[:2]) < 1e-5 and changes[2] > 1e-2 and changes[3] > 15 * changes[2]


def test_only_the_middle_axis_flips_over(page):
    axes = {None: 2, "Start more exactly": 2, "About the long axis": 0, "About the short axis": 1}
    for exercise, axis in axes.items():
        page.open_exercise("Dzhanibekov effect", exercise)
        path = kr.solve(page.build_scene(), 60, "strang", step=0.01, every=10)
        component = path.body_momentum[:, axis] / np.linalg.norm(path.m, axis=1)
        assert abs(component[0]) > 0.99 and (np.ptp(np.sign(component)) > 0) == (axis == 2)
        page.advance(60)  # what the chart shows: the tilt, that of the middle axis
        assert (np.ptp(page.read_record(0, "nutation")) > 3) == (axis == 2)


# The right predictions for the exercises that ask.
ANSWERS = {
    "A spinning top": ["only sideways", "down", "more", "deeper"],
    "Cusps": ["waves", "loops", "less deep"],
    "Waves": ["a level circle", "up", "cusps"],
    "Steady precession": ["down", "less", "nowhere"],
    "Fast precession": ["about the same", "more", "more"],
    "Sleeping top": ["only the right one", "none", "only the right one"],
    "Rising top": ["no, it turns back before", "no, it turns back before", "no, it falls at once"],
    "Pendulum": ["less deep", "less deep"],
}


@pytest.mark.parametrize("preset", ANSWERS)
def test_an_exercise_waits_for_a_prediction_and_then_shows_the_answer(page, preset):
    page.load(preset)
    page.keyboard.press(";")
    assert "Choose one" in page.locator("#ask").inner_text()
    asking = page.evaluate(
        "(name) => kreisel.presets.find((each) => each.name === name).exercises"
        ".filter(({ask}) => ask).map(({title}) => title)",
        preset,
    )
    for title, answer in zip(asking, ANSWERS[preset], strict=True):
        page.find_button(title).click()
        assert page.read_clock() == 0 and not page.evaluate("kreisel.page.isRunning")
        assert not page.locator("#about p").is_visible()
        choice = page.locator("#ask button").first
        words = choice.inner_text()
        choice.press("Enter")
        assert page.evaluate("kreisel.page.isRunning && kreisel.page.scene.show.trace")
        assert not page.locator("#about p").is_visible()  # it tells the answer
        page.advance(3.1 * page.read_scene()["speed"])
        page.evaluate("kreisel.page.setRunning(false)")
        mark = "✓" if words == answer else "✗"
        assert page.locator("#ask").inner_text() == f"You: {words}. {mark} The top: {answer}."
    page.keyboard.press(";")
    page.load("Cusps")
    assert page.locator("#ask").inner_text() == ""


def test_a_key_opens_the_next_exercise(page):
    page.load("A spinning top")
    titles = page.evaluate("kreisel.presets[0].exercises.map((each) => each.title)")
    for title in [*titles, titles[0]]:
        page.keyboard.press("y")
        page.evaluate("kreisel.page.setRunning(false)")
        assert page.locator(".exercise[aria-pressed=true]").inner_text().strip() == title
    page.find_button("Back to the start").click()
    assert page.locator(".exercise[aria-pressed=true]").count() == 0
