"""Tests that the numbers in the viewer agree with those computed in Python.

A drawn solid of revolution must have the mass and moments of inertia of the body.
"""

import json
import re

import kreisel as kr
import numpy as np
import pytest
from browser import (
    UPRIGHT,
    WIDE,
    advance,
    load,
    make_viewport,
    read_scene,
    read_states,
    scene_in_python,
    wait_for,
)
from toolbox import ROOT

ALL = json.loads((ROOT / "python/viewer/presets.json").read_text())
TOPS = [preset for preset in ALL if preset.get("shape") == "lagrange"]
STARTED = [  # tops with a start in words and a closed form
    preset
    for preset in TOPS
    if "start" in preset and "damping" not in preset and "turning" not in preset
]
STANDING = [preset for preset in TOPS if preset.get("body", {}).get("pivot") != [0, 0, 0]]
WITHOUT_ROTOR = [preset for preset in STARTED if "rotor" not in preset]
NAMES = {"ids": lambda preset: preset["name"]}


def read_text(page):
    return page.locator("#about").inner_text()


def open_exercise(page, exercise):
    """Open and pause a viewer exercise, and return the closed-form solution of its scene."""
    page.get_by_role("button", name=exercise, exact=True).click()
    page.evaluate("kreisel.page.setRunning(false)")
    return kr.exact(scene_in_python(read_scene(page)))


def read_numbers(page):
    """Return the numbers that the viewer displays over the picture, and the notes below them."""
    return dict(
        page.evaluate("""(kreisel.view.isDirty = true,
            [...document.querySelectorAll('#numbers div')].map((box) => [
                box.querySelector('dt').textContent,
                [box.querySelector('dd').textContent, box.querySelector('small').textContent],
            ]))""")
    )


# Numbers from the closed form


@pytest.mark.parametrize("preset", STARTED, **NAMES)
def test_circles_and_critical_spin_agree_with_python(page, preset):
    load(page, preset["name"])
    scene, limits = read_scene(page), page.evaluate("kreisel.page.tops.map((top) => top.limits)")
    for i, top in enumerate(limits):
        exact = kr.exact(scene_in_python(scene, second=i == 1))
        expected = [exact.least_nutation, exact.greatest_nutation, exact.critical_spin]
        assert [top[key] for key in ("least", "greatest", "critical")] == pytest.approx(
            expected, rel=1e-12, abs=1e-12
        )
        assert top["motionType"] == exact.motion_type
        assert top["precession"] == pytest.approx(exact.precession_rate, rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("preset", WITHOUT_ROTOR, **NAMES)
def test_textbook_starts_agree_with_python(page, preset):
    load(page, preset["name"])
    scene, words = read_scene(page), preset["start"]
    rate = words.get("precession", 0.0)
    options = {"precession": rate} if not isinstance(rate, str) else {"steady": True}
    expected = kr.Scene.spinning(
        kr.Body.cuboid(**preset["body"]),
        tilt=np.radians(words["tilt"]),
        spin=words["spin"],
        gravity=preset["gravity"],
        **options,
        **({"fast": True} if rate == "fast" else {}),
    )
    own = scene_in_python(scene)
    assert kr.exact(own).least_nutation == pytest.approx(
        kr.exact(expected).least_nutation, abs=1e-7
    )
    size = np.linalg.norm(expected.momentum)
    assert own.momentum[2] == pytest.approx(expected.momentum[2], abs=1e-12 * size)
    assert np.linalg.norm(own.momentum) == pytest.approx(size, rel=1e-12)


def test_starts_in_words_refer_to_the_axis_of_a_body_in_any_axes(page):
    body = kr.Body.cuboid(half=(0.8, 0.8, 1.0), pivot=(0.0, 0.0, -1.0), mass=2.0)
    turned = body.turn((0.8, 0.36, -0.48, 0.0))
    numbers = {
        "mass": turned.mass,
        "inertia": np.ravel(turned.inertia).tolist(),
        "com": list(turned.com),
    }
    words = {"tilt": 40, "spin": 12, "precession": 0.5}
    load(page, "A spinning top", body=numbers, start=words)
    own = scene_in_python(read_scene(page))
    expected = kr.Scene.spinning(
        body, tilt=np.radians(40), spin=12, precession=0.5, gravity=own.gravity
    )
    for name in ("least_nutation", "greatest_nutation", "precession_rate"):
        value = getattr(kr.exact(own), name)
        assert value == pytest.approx(getattr(kr.exact(expected), name), abs=1e-7)


@pytest.mark.parametrize(
    "start",
    [
        {"tilt": 200, "spin": 1},
        {"spin": 1},
        {"tilt": 30, "spin": "x"},
        {"tilt": 1, "spin": 2, "nod": 3},
    ],
)
def test_impossible_starts_are_refused_with_a_message(page, start):
    before = read_scene(page)
    page.evaluate("start => kreisel.page.load({...kreisel.page.scene, start})", start)
    assert "start cannot be" in page.locator("#words").inner_text() and read_scene(page) == before


def test_too_little_spin_for_steady_precession_shows_a_message(page):
    before, start = read_scene(page), {"tilt": 30, "spin": 1, "precession": "slow"}
    page.evaluate("start => kreisel.page.load({...kreisel.page.scene, start})", start)
    assert "no steady precession" in page.locator("#words").inner_text()
    assert read_scene(page) == before


def test_slow_precession_is_slow_for_either_sign_of_the_spin(page):
    for kind in ("slow", "fast"):
        rates = []
        for spin in (22, -22):
            load(page, "A spinning top", start={"tilt": 30, "spin": spin, "precession": kind})
            rates.append(kr.exact(scene_in_python(read_scene(page))).precession_rate)
        assert rates[0] == pytest.approx(-rates[1], rel=1e-9)
        # the roots of I1 W^2 cos - I3 spin W + mass gravity height = 0
        body = scene_in_python(read_scene(page)).body
        transverse, axial = np.sort(body.moments)[[1, 0]]
        cos, torque = np.cos(np.pi / 6), body.mass * 4 * np.linalg.norm(body.com)
        roots = np.roots([transverse * cos, -axial * 22, torque])
        assert rates[0] == pytest.approx((min if kind == "slow" else max)(roots), rel=1e-9)


# Numbers in the texts


@pytest.mark.parametrize("preset", ALL, **NAMES)
def test_every_preset_has_exercises_without_empty_numbers(page, preset):
    assert len(preset["exercises"]) >= 3
    page.evaluate(
        """name => {
        kreisel.page.load(kreisel.presets.find((preset) => preset.name === name));
        kreisel.page.showMessage("");
    }""",
        preset["name"],
    )
    for each in [None, *preset["exercises"]]:
        if each:
            click_exercise(page, each["title"])
            assert page.locator(".exercise[aria-pressed=true]").inner_text() == each["title"]
        assert read_text(page) and not re.search(r"[{}]|NaN|undefined|Infinity", read_text(page))
        assert page.locator("#words").inner_text() == ""


def click_exercise(page, exercise):
    page.get_by_role("button", name=exercise, exact=True).click()
    page.evaluate("kreisel.page.setRunning(false)")


def test_doubled_spin_halves_the_precession(page):
    load(page, "A spinning top")
    slow = kr.exact(scene_in_python(read_scene(page)))
    fast = open_exercise(page, "Double the spin")
    assert 0.45 < fast.precession_rate / slow.precession_rate < 0.52
    assert f"from {slow.precession_rate:.3g} to {fast.precession_rate:.3g} rad/s" in read_text(page)
    nods = 2 * np.pi / fast.precession_rate / fast.period
    assert f"{nods:.3g} times in one turn" in read_text(page)


@pytest.mark.parametrize(
    "preset, exercise, course",
    [
        ("A spinning top", None, "loops"),
        ("A spinning top", "Why does it not fall?", "steady"),
        ("A spinning top", "Without spin", "pendulum"),
        ("Cusps", None, "cusps"),
        ("Cusps", "Push it forward", "waves"),
        ("Cusps", "Push it back", "loops"),
        ("Waves", None, "waves"),
        ("Waves", "Push just right", "steady"),
        ("Waves", "No push", "cusps"),
        ("Steady precession", None, "steady"),
        ("Steady precession", "Twice the gravity", "steady"),
        ("Steady precession", "No gravity", "resting"),
        ("Fast precession", None, "steady"),
        ("Fast precession", "Twice the gravity", "steady"),
        ("Pendulum", None, "pendulum"),
        ("Pendulum", "Turn it upside down", "pendulum"),
        ("Elastic rod", "A helix", "steady"),
        ("Elastic rod", "A plane curve", "pendulum"),
    ],
)
def test_the_axis_moves_as_described(page, preset, exercise, course):
    load(page, preset)
    exact = (
        open_exercise(page, exercise) if exercise else kr.exact(scene_in_python(read_scene(page)))
    )
    assert exact.motion_type == course
    degrees = np.degrees([exact.least_nutation, exact.greatest_nutation])
    angles = [float(word) for word in re.findall(r"([\d.]+)°", read_text(page))]
    assert all(np.abs(degrees - each).min() < 0.051 for each in angles)


@pytest.mark.parametrize("exercise", [None, "14.6 and 13.8", "Both fast"])
def test_the_sleeping_tops_move_as_described(page, exercise):
    load(page, "Sleeping top")
    if exercise:
        click_exercise(page, exercise)
    red, violet = (kr.exact(scene_in_python(read_scene(page), second=k)) for k in (False, True))
    spins = [states_spin(page, i) for i in (0, 1)]
    assert spins[0] > red.critical_spin and np.degrees(red.greatest_nutation) < 4
    assert (spins[1] > red.critical_spin) == (exercise == "Both fast")
    assert (np.degrees(violet.greatest_nutation) > 25) == (exercise != "Both fast")


def states_spin(page, top):
    return page.evaluate(f"kreisel.simulation.measureTop({top}).spin")


def test_the_description_follows_a_change_of_the_scene(page):
    load(page, "A spinning top")
    page.evaluate("kreisel.page.setValue('gravity', 2)")
    exact = kr.exact(scene_in_python(read_scene(page)))
    least, greatest = np.degrees([exact.least_nutation, exact.greatest_nutation])
    assert f"{least:.1f}° and {greatest:.1f}°" in read_text(page) and exact.motion_type == "loops"
    assert "It leans" not in read_text(page)


def test_a_scene_without_description_gets_one(page):
    load(page, "A spinning top", name="mine", about="")
    assert read_text(page) == "The axis draws loops between 30.0° and 48.6°."
    load(page, "Kowalewski", name="mine", about="")
    assert read_text(page) == "A scene of your own."


# Numbers beside and in the picture


@pytest.mark.parametrize("t", [0, 2.5, 7])
def test_live_numbers_agree_with_python(page, t):
    load(page, "A spinning top")
    advance(page, t)
    exact = kr.exact(scene_in_python(read_scene(page)))
    path = kr.solve(
        scene_in_python(read_scene(page)), [t - 1e-4, t, t + 1e-4] if t else [0, 1e-4, 2e-4]
    )
    tilt, spin = np.degrees(path.nutation[min(1, int(10 * t))]), path.spin[1]
    wait_for(
        page, "tilt => document.querySelector('#numbers dd')?.textContent === tilt", f"{tilt:.1f}°"
    )
    numbers = read_numbers(page)
    assert numbers["spin"] == [f"{spin:#.3g}", ""]
    rate = np.diff(np.unwrap(path.precession_angle)).mean() / 1e-4
    assert float(numbers["precession"][0]) == pytest.approx(rate, abs=6e-3)
    mean, round_trip = exact.precession_rate, 2 * np.pi / exact.precession_rate
    assert numbers["precession"][1] == f"mean {mean:.3g}: once round in {round_trip:.1f} s"
    assert float(numbers["turns"][0]) == pytest.approx(t * spin / (2 * np.pi), abs=0.051)


def test_arrows_and_circles_are_labelled(page):
    load(page, "A spinning top")
    page.evaluate("kreisel.view.isDirty = true; kreisel.view.render()")
    letters = page.locator(".labels span:not([hidden])").all_inner_texts()
    assert letters == [
        "momentum m",
        "rotation axis ω",
        "vertical p",
        "highest 30.0°",
        "lowest 48.6°",
    ]
    positions = page.evaluate("""[...document.querySelectorAll('.labels span:not([hidden])')].map(
        (span) => span.style.transform.match(/[\\d.]+/g).map(Number))""")
    assert positions[0] == pytest.approx(page.evaluate("kreisel.locate('tip')"), abs=40)


# The drawn body


@pytest.mark.parametrize("preset", STANDING, **NAMES)
def test_the_solid_of_revolution_has_the_mass_and_moments_of_the_scene(page, preset):
    load(page, preset["name"], show={"solid": "top"})
    profile = np.array(page.evaluate("kreisel.view.revolution.profile"))
    body = scene_in_python(read_scene(page)).body
    fractions = np.linspace(0, 1, 2001)
    z = np.concatenate(
        [
            a + fractions * (b - a)
            for a, b in zip(*(profile[k:][: len(profile) - 1, 0] for k in (0, 1)), strict=True)
        ]
    )
    r = np.concatenate(
        [
            a + fractions * (b - a)
            for a, b in zip(*(profile[k:][: len(profile) - 1, 1] for k in (0, 1)), strict=True)
        ]
    )

    def mean(values):
        return np.trapezoid(values * r**2, z) / np.trapezoid(r**2, z)

    axial, transverse = mean(r**2) / 2, mean(z**2 + r**2 / 4)
    assert np.linalg.norm(body.com) == pytest.approx(mean(z), rel=1e-5)
    assert body.mass * np.array([transverse, transverse, axial]) == pytest.approx(
        body.moments, rel=1e-5
    )
    assert profile[0, 0] > -0.02 and page.evaluate("kreisel.view.tops[0].solid.handles.length") == 4


def draw_solid(page, body):
    """Show a body as a solid of revolution, and return the drawn profile."""
    scene = kr.view(kr.Scene(body, (0.0, 0.0, 1.0), gravity=1), open=False).scene
    page.evaluate("given => kreisel.page.load(given)", {**scene, "show": {"solid": "top"}})
    return np.array(page.evaluate("kreisel.view.revolution.profile"))


def test_a_cone_is_drawn_as_a_cone_and_a_cylinder_as_a_drum(page):
    height, radius = draw_solid(page, kr.Body.cone(1.0, 2.0, (0, 0, 0), mass=1.5)).T
    assert radius[0] == 0 and height[0] == pytest.approx(0, abs=1e-6)
    assert radius[1:3] / height[1:3] == pytest.approx(0.5, rel=1e-6)
    assert height[2:] == pytest.approx(2, rel=1e-3) and radius.max() == pytest.approx(1, rel=1e-6)
    height, radius = draw_solid(page, kr.Body.cylinder(1.0, 2.0, (0, 0, -1), mass=1.5)).T
    assert radius[1:-1] == pytest.approx(1, rel=0.01)
    assert np.ptp(height) == pytest.approx(2, rel=0.01)


@pytest.mark.parametrize("turn", [(0.5, 0.5, 0.5, 0.5), (0.8, 0.36, 0.48, 0.0)])
def test_a_cone_in_any_axes_is_drawn_along_its_axis(page, turn):
    cone = kr.Body.cone(1.0, 2.0, (0, 0, 0), mass=1.5)
    profile = draw_solid(page, cone)
    assert draw_solid(page, cone.turn(turn)) == pytest.approx(profile, abs=1e-6)
    drawn_axis = page.evaluate("""(({world, tops: [{solid}]}) => {
        world.updateMatrixWorld(true);
        return solid.handles[0].matrixWorld.elements.slice(4, 7);
    })(kreisel.view)""")
    axis = kr.solve(scene_in_python(read_scene(page)), [0.0]).apex[0]
    assert drawn_axis / np.linalg.norm(drawn_axis) == pytest.approx(axis, abs=1e-6)


def test_only_symmetric_bodies_are_drawn_as_solids_of_revolution(page):
    choice, handle_count = page.get_by_label("Show as"), "kreisel.view.tops[0].solid.handles.length"
    assert page.evaluate(handle_count) == 21  # faces, corners and edges
    advance(page, 2)
    before = read_states(page)
    choice.select_option("top")
    assert page.evaluate(handle_count) == 4 and read_states(page) == before
    page.get_by_label("Shape").select_option("kowalewski")
    assert page.evaluate(handle_count) == 21
    assert choice.locator("option[value=top]").is_disabled()
    load(page, UPRIGHT, show={"solid": "top"}, body={"half": [1, 1, 0.1], "pivot": [0, 0, -1.5]})
    assert page.evaluate(handle_count) == 4


@pytest.mark.parametrize("size", [(480, 320), (390, 780)], ids=str)
def test_labels_do_not_cover_the_numbers(page, size):
    page.set_viewport_size(make_viewport(size))
    load(page, "A spinning top")
    page.evaluate("kreisel.page.showMessage('')")
    wait_for(page, "kreisel.view.labels.texts.length === 1")  # the button Panel
    corner = page.evaluate("""(() => {
        const {right} = document.querySelector('#numbers div:nth-child(2)').getBoundingClientRect();
        const {bottom} = document.getElementById('numbers').getBoundingClientRect();
        return [right, bottom];
    })()""")
    wait_for(page, f"kreisel.view.labels.corner[1] >= {corner[1]} - 1")
    overlaps = page.evaluate(
        """([right, bottom]) => {
        const {labels, pixels} = kreisel.view, over = [];
        const span = document.createElement('span');
        span.textContent = 'ω';
        labels.container.append(span);
        labels.all = [{span, wide: 20}];
        for (let x = 5; x < right; x += 9)
            for (let y = 5; y < bottom; y += 9) {
                labels.all[0].at = () => [x, y];
                labels.placeLabels(pixels);
                if (span.hidden || span.getBoundingClientRect().top < bottom - 6) over.push([x, y]);
            }
        span.remove();
        return over;
    }""",
        corner,
    )
    page.set_viewport_size(make_viewport(WIDE))
    assert overlaps == []


def test_arrows_of_all_tops_are_visible(page):
    script = "kreisel.view.tops.map(({m}) => m.children[0].material.depthTest)"
    load(page, "Sleeping top")
    assert page.evaluate(script) == [True, True]  # the arrows protrude from both bodies
    open_exercise(page, "Both fast")
    # the second arrow would be hidden in the body of the second top
    assert page.evaluate(script) == [False, False]


# The critical spin


@pytest.mark.parametrize("tilt, is_shown", [(0.5, True), (1.9, True), (2.1, False), (30, False)])
def test_the_critical_spin_is_shown_for_tops_that_start_near_the_vertical(page, tilt, is_shown):
    load(page, "A spinning top", start={"tilt": tilt, "spin": 22})
    page.evaluate("kreisel.page.onChange()")
    assert read_numbers(page)["spin"][1] == ("critical 14.2" if is_shown else "")


def test_texts_state_the_critical_spin_only_for_upright_tops(page):
    for preset in ALL:
        for each in [preset, *preset["exercises"]]:
            if "{critical}" in each.get("about", "") + each.get("text", ""):
                assert each.get("start", preset.get("start"))["tilt"] <= 2, preset["name"]


def test_slower_tops_fall_deeper_without_a_critical_spin_at_30_degrees(page):
    load(page, "A spinning top")
    body, gravity = scene_in_python(read_scene(page)).body, read_scene(page)["gravity"]
    spins = np.arange(8, 22.1, 0.5)
    falls = [
        kr.exact(
            kr.Scene.spinning(
                body, tilt=np.radians(30), spin=spin, precession=-0.8, gravity=gravity
            )
        ).greatest_nutation
        for spin in spins
    ]
    change = np.diff(falls)
    assert (change < 0).all() and np.abs(np.diff(change)).max() < 0.25 * np.abs(change).max()
    click_exercise(page, "Spin it slowly")
    assert "Slower spin, deeper fall" in read_text(page) and "critical" not in read_text(page)


def test_numbers_name_their_top(page):
    load(page, "A spinning top")
    page.evaluate("kreisel.page.onChange()")
    assert "top" not in read_numbers(page)
    load(page, "Compare four")
    page.evaluate("kreisel.page.onChange()")
    assert read_numbers(page)["top"] == ["left", "bobenko_suris 0.01"]
    assert read_numbers(page)["tilt"][1].startswith("exact: ")


def test_numbers_have_units(page):
    load(page, "A spinning top")
    page.evaluate("kreisel.page.onChange()")
    units = dict(
        page.evaluate("""[...document.querySelectorAll('#numbers div')].map((box) =>
            [box.querySelector('dt').textContent, box.querySelector('.value').dataset.unit])""")
    )
    assert units["spin"] == units["precession"] == " rad/s"
    assert read_numbers(page)["tilt"][0].endswith("°") and read_numbers(page)["precession"][
        1
    ].endswith(" s")
    assert "Units: s, m, kg" in " ".join(page.locator("#panel").inner_text().split())
    assert page.locator("#clock").inner_text().endswith(" s")


def list_round_times(page, *asks):
    """Return the precession periods of a preset of the viewer and of some of its exercises."""
    times = []
    for exercise in asks:
        load(page, "Fast precession")
        exact = (
            open_exercise(page, exercise)
            if exercise
            else kr.exact(scene_in_python(read_scene(page)))
        )
        times.append(2 * np.pi / exact.precession_rate)
    return times


def test_texts_of_fast_precession_are_true(page):
    fast, heavy, near, slow = list_round_times(
        page, None, "Twice the gravity", "Less spin", "The slow one"
    )
    assert heavy / fast < 1.2 and slow > 5 * fast  # gravity hardly changes the fast precession
    less = dict(tilt=np.radians(35), gravity=4, steady=True)
    load(page, "Fast precession")
    body = scene_in_python(read_scene(page)).body
    other = 2 * np.pi / kr.exact(kr.Scene.spinning(body, spin=13, **less)).precession_rate
    assert 1 < other / near < 1.4
    with pytest.raises(ValueError, match=r"steady|spin"):
        kr.Scene.spinning(body, spin=12.8, **less)


@pytest.mark.parametrize("damping, text", [(0, "0"), (1e-6, "1e-6"), (1.2345e-7, "1.23e-7")])
def test_fields_show_small_numbers_completely(page, damping, text):
    load(page, "A spinning top", damping=damping)
    field = page.get_by_label("Damping, number")
    assert field.input_value() == text
    assert page.get_by_role("slider", name="Damping").get_attribute("aria-valuetext") == text
    assert read_scene(page)["damping"] == damping
