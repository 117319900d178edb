"""Tests that numbers, starts and texts of the viewer agree with the closed form in Python."""

import re

import kreisel as kr
import numpy as np
import pytest
from browser import ALL, list_changes, scene_in_python, turn_description, wait_for

SPINNING = "A spinning top"
STARTED = [  # tops with a start in words and a closed form
    preset["name"]
    for preset in ALL
    if "start" in preset and not {"damping", "turning", "shaking"} & {*preset}
]
BODY_FIELDS = [  # value typed into a field, and the value of the body
    ("Half edges, N", 0.5, "half", [0.5, 0.8, 1]),
    ("Half edges, T", 2, "half", [0.8, 0.8, 2]),
    ("Fixed point, from the centre, N", 0.25, "pivot", [0.25, 0, -1]),
    ("Fixed point, from the centre, T", -0.5, "pivot", [0, 0, -0.5]),
    ("Density, number", 2.5, "density", 2.5),
    ("Mass, number", 10.24, "density", 2),
]
TURN = (0.8, 0.36, 0.48, 0.0)  # an attitude


def read_text(page):
    return page.locator("#about").inner_text()


# Starts in words


@pytest.mark.parametrize("preset", STARTED)
def test_limits_and_starts_of_presets_agree_with_python(page, preset):
    page.load(preset)
    scene = page.read_scene()
    given = next(each for each in ALL if each["name"] == preset)
    for i, top in enumerate(page.read_tops()):
        exact, limits = page.read_exact(second=i == 1), top["limits"]
        expected = [exact.least_nutation, exact.greatest_nutation, exact.critical_spin]
        found = [limits[key] for key in ("least", "greatest", "critical")]
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
        assert limits["motionType"] == exact.motion_type
        assert limits["precession"] == pytest.approx(exact.precession_rate, rel=1e-10, abs=1e-12)
        if any(scene["rotor"]):
            continue  # kr.Scene.spinning knows no steady precession with a rotor
        words = given["second"] if i else given["start"]
        kind = words.get("precession", 0.0)
        how = {"steady": True, "fast": kind == "fast"} if isinstance(kind, str) else {}
        start = kr.Scene.spinning(
            exact.scene.body,
            tilt=np.radians(words["tilt"]),
            spin=words["spin"],
            gravity=scene["gravity"],
            **(how or {"precession": kind}),
        )
        assert exact.scene.momentum[2] == pytest.approx(start.momentum[2], rel=1e-11, abs=1e-12)
        assert np.linalg.norm(exact.scene.momentum) == pytest.approx(
            np.linalg.norm(start.momentum), rel=1e-11, abs=1e-12
        )


def test_the_first_tops_have_the_size_of_toys(page):
    for entry in ALL[:8]:
        page.load(entry["name"])
        top = page.build_scene()
        assert 0.05 < top.body.mass < 0.5 and top.gravity == 9.81
        assert 0.01 < np.linalg.norm(top.body.com) < 0.1  # metres


@pytest.mark.parametrize("kind, root", [("slow", min), ("fast", max)])
def test_slow_and_fast_precession_are_the_roots_for_either_sign_of_the_spin(page, kind, root):
    rates = []
    for spin in (220, -220):
        page.load(SPINNING, start={"tilt": 30, "spin": spin, "precession": kind})
        rates.append(page.read_exact().precession_rate)
    body = page.build_scene().body
    transverse, axial = np.sort(body.moments)[[1, 0]]
    torque = body.mass * 9.81 * np.linalg.norm(body.com)
    roots = np.roots([transverse * np.cos(np.pi / 6), -axial * 220, torque])
    assert rates == pytest.approx([root(roots), -root(roots)], rel=1e-9)


def test_starts_in_words_refer_to_the_axis_of_a_body_in_any_axes(page):
    body = kr.Body.cuboid(half=(0.8, 0.8, 1.0), pivot=(0.0, 0.0, -1.0), mass=2.0)
    start = kr.Scene.spinning(body.turn(TURN), tilt=0.3, spin=1, gravity=4)
    given = kr.view(start, open=False).scene["body"]
    page.load(SPINNING, body=given, start={"tilt": 40, "spin": 12, "precession": 0.5})
    expected = kr.Scene.spinning(body, tilt=np.radians(40), spin=12, precession=0.5, gravity=9.81)
    for name in ("least_nutation", "greatest_nutation", "precession_rate"):
        value = getattr(page.read_exact(), name)
        assert value == pytest.approx(getattr(kr.exact(expected), name), abs=1e-7)


# Fields of tilt, spin and body


def check_tilt_and_spin(page, t):
    """Set the tilt and the spin at the time `t`, and compare them with those in Python."""
    page.advance(t)
    spin, is_turning = page.measure_top(0, "spin"), any(page.read_scene()["turning"])
    for name, place, value in (("Tilt [°], number", "nutation", 30), ("Spin, number", "spin", 7.5)):
        assert is_turning or page.measure_top(0, "spin") == pytest.approx(spin, abs=1e-9)
        page.fill_field(name, value)
        number = getattr(kr.solve(page.build_scene(), [0.0]), place)[0]
        assert (np.degrees(number) if place == "nutation" else number) == pytest.approx(value)
    assert page.read_scene()["taken"] == (t or None)
    assert np.degrees(page.measure_top(0, "nutation")) == pytest.approx(30)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"shape": "kowalewski"},
        {"shape": "free", "turning": [0.3, 0.1, -0.2], "rotor": [0.4, 1, -0.6]},
        {"shape": "free", "body": {"half": [0.8, 0.7, 1.1], "pivot": [0, 0, 0], "density": 1}},
    ],
    ids=["lagrange", "kowalewski", "support", "free"],
)
@pytest.mark.parametrize("is_turned", [False, True], ids=["cuboid", "numbers"])
def test_tilt_and_spin_agree_with_python(page, changes, is_turned):
    body = {"half": [0.8, 0.8, 1], "pivot": [0.5, 0.2, -1], "density": 1}
    general = {"body": body} if "turning" in changes else {}
    page.load(**{**general, **changes})
    if is_turned:
        given = turn_description(page.read_scene(), TURN)
        page.load_scene(given)
    check_tilt_and_spin(page, 0)
    check_tilt_and_spin(page, 3)


def test_size_fixed_point_and_mass_have_fields(page):
    for name, value, key, expected in BODY_FIELDS:
        page.load(shape="free")
        before = page.read_scene()
        field = page.fill_field(name, value)
        assert list_changes(before, page.read_scene()) - {"methods"} == {"body"}
        assert page.read_scene()["body"][key] == pytest.approx(expected)
        assert float(field.input_value()) == pytest.approx(value)
        check_described_body(page, page.build_scene().body)


@pytest.mark.parametrize("place, value", [("density", 2), ("body.half.2", 1.2)])
def test_a_changed_body_given_by_numbers_keeps_the_positions_of_both_tops(page, place, value):
    page.load("Sleeping top", shape="free", rotor=[0.5, 1, -2])
    expected = page.read_scene()
    given = turn_description(expected, TURN)
    page.load_scene(given)
    page.set_value(place, value)
    found = page.read_scene()
    # the body is symmetric: its edges may be permuted, but the axis is the same
    for key in ("attitude", "second"):
        axis = kr.quaternion.turn(tuple(found[key][:4]), (0, 0, 1))
        assert axis == pytest.approx(kr.quaternion.turn(tuple(expected[key][:4]), (0, 0, 1)))
        rotor = kr.quaternion.turn(tuple(found[key][:4]), found["rotor"])
        assert rotor == pytest.approx(kr.quaternion.turn(tuple(given[key][:4]), given["rotor"]))


def check_described_body(page, body):
    """Compare the kind, mass, moments and centre of mass in the text with those of a body."""
    text = page.locator("#body").inner_text()
    kind, _, numbers = text.partition(" top: mass ")
    assert kind.lower().replace("-", "_") == body.kind
    found = [float(word) for word in re.findall(r"-?\d[\d.]*(?:e-?\d+)?", numbers)]
    expected = [body.mass, *body.moments, *body.principal_com]
    assert found == pytest.approx(expected, rel=5.1e-4, abs=1e-12)


def test_a_body_from_python_is_described(page):
    for name in ("thesis", "kowalewski", "dzhanibekov", "asymmetric"):
        scene = getattr(kr.scenes, name)
        page.load_scene(kr.view(scene, open=False).scene)
        check_described_body(page, scene.body)


def test_shapes_are_those_of_their_case(page):
    for shape, ratio in (("kowalewski", 2), ("goryachev_chaplygin", 4)):
        page.get_by_label("Shape").select_option(shape)
        body = page.build_scene().body
        assert body.kind == shape == page.evaluate("kreisel.page.kind")
        equal, _, least = sorted(body.moments, reverse=True)
        assert equal / least == pytest.approx(ratio)
    assert page.read_scene()["momentum"][2] == 0


# Numbers over the picture


@pytest.mark.parametrize("t", [0, 2.5, 7])
def test_live_numbers_agree_with_python(page, t):
    page.load(SPINNING)
    page.advance(t)
    exact = page.read_exact()
    path = kr.solve(exact.scene, [t - 1e-4, t, t + 1e-4] if t else [0, 1e-4, 2e-4])
    tilt, spin = np.degrees(path.nutation[1 if t else 0]), path.spin[1]
    numbers = page.read_numbers()
    least, greatest = np.degrees([exact.least_nutation, exact.greatest_nutation])
    assert numbers["tilt"] == [f"{tilt:.1f}°", f"{least:.1f}° to {greatest:.1f}°"]
    assert numbers["spin"] == [f"{spin:#.3g}".rstrip("."), ""]
    rate = np.diff(np.unwrap(path.precession_angle)).mean() / 1e-4
    assert float(numbers["precession"][0]) == pytest.approx(rate, rel=6e-3)
    mean = exact.precession_rate
    assert numbers["precession"][1].startswith(f"mean {mean:.3g}: ")
    assert numbers["precession"][1].endswith(f" {2 * np.pi / mean:#.3g} s")
    units = "document.querySelector('#numbers .{} .value').dataset.unit.trim()"
    assert [page.evaluate(units.format(name)) for name in ("spin", "precession")] == ["rad/s"] * 2
    wait_for(page, f"document.getElementById('clock').textContent === 't = {t:.3f} s'")


def test_the_critical_spin_is_shown_for_tops_that_start_near_the_vertical(page):
    for tilt in (0.5, 1.9, 2.1, 30):
        page.load(SPINNING, start={"tilt": tilt, "spin": 220})
        critical = page.read_exact().critical_spin
        expected = f"critical {critical:.3g}" if tilt <= 2 else ""
        assert page.read_numbers()["spin"][1] == expected


def test_the_rule_for_fast_tops_is_compared_with_the_mean_precession(page):
    page.load(SPINNING)
    assert "fast-top rule" not in page.read_numbers()
    page.click_exercise("Without spin")
    assert "fast-top rule" not in page.read_numbers()
    page.click_exercise("Why does it not fall?")
    top = page.read_exact()
    body, spin = top.scene.body, page.measure_top(0, "spin")
    moment = body.moments[np.argmax(np.abs(body.principal_com))]
    rule = body.mass * top.scene.gravity * np.linalg.norm(body.com) / (moment * spin)
    value, note = page.read_numbers()["fast-top rule"]
    assert float(value) == pytest.approx(rule, rel=2e-3)
    percent = 100 * (rule / top.precession_rate - 1)
    assert f"{abs(percent):.1f} % {'below' if percent < 0 else 'above'}" in note


# Texts


OPEN_ALL = """([preset, titles]) => titles.map((title) => {
    const {page} = kreisel, about = document.getElementById('about');
    const list = (marks) => [...document.querySelectorAll('.exercise' + marks)];
    page.load(preset);
    if (title) list('').find((each) => each.innerText === title).click();
    page.setRunning(false); page.rewind();
    const pressed = list('[aria-pressed=true]').map((each) => each.innerText);
    const fits = about.scrollHeight <= about.clientHeight + 1;
    const message = document.getElementById('words').innerText;
    return [title, page.scene, about.innerText, message, pressed, fits];
})"""


@pytest.mark.parametrize("preset", ALL, ids=lambda preset: preset["name"])
def test_every_preset_has_exercises_with_numbers_from_the_closed_form(page, preset):
    assert len(preset["exercises"]) >= 3
    titles = [None, *(each["title"] for each in preset["exercises"])]
    for exercise, scene, text, message, pressed, fits in page.evaluate(OPEN_ALL, [preset, titles]):
        assert text and not re.search(r"[{}]|NaN|undefined|Infinity", text)
        assert fits and message == "" and pressed == ([exercise] if exercise else []), exercise
        if exercise is None and preset["name"] in STARTED and not scene["second"]:
            exact = kr.exact(scene_in_python(scene))
            degrees = np.degrees([exact.least_nutation, exact.greatest_nutation])
            angles = [float(word) for word in re.findall(r"([\d.]+)°", text)]
            assert all(np.abs(degrees - each).min() < 0.051 for each in angles)


def test_numbers_in_texts_agree_with_the_closed_form(page):
    page.load(SPINNING)
    slow = page.read_exact()
    page.click_exercise("Double the spin")
    fast = page.read_exact()
    assert 0.45 < fast.precession_rate / slow.precession_rate < 0.52
    assert f"from {slow.precession_rate:.3g} to {fast.precession_rate:.3g}" in read_text(page)
    assert f"{2 * np.pi / fast.precession_rate / fast.period:.3g} times" in read_text(page)


def test_the_description_follows_a_change_of_the_scene(page):
    page.load(SPINNING)
    before = read_text(page)
    page.set_value("gravity", 2)
    exact = page.read_exact()
    least, greatest = np.degrees([exact.least_nutation, exact.greatest_nutation])
    assert f"{exact.motion_type} between {least:.1f}° and {greatest:.1f}°" in read_text(page)
    page.keyboard.press("z")
    assert read_text(page) == before


def test_the_origin_of_the_start_is_told(page):
    page.load(SPINNING)
    before, start = page.read_scene(), page.locator("#start")
    page.advance(3)
    page.get_by_role("button", name="Start from this moment").click()
    assert page.read_scene()["taken"] == 3 and "t = 3.00" in start.inner_text()
    page.get_by_role("button", name="Rewind").click()
    assert page.read_scene()["taken"] == 3
    page.get_by_role("button", name="Reset").click()
    assert page.read_scene() == before and "as given" in start.inner_text()
    page.click_exercise("Double the spin")
    assert "Double the spin" in start.inner_text()
    page.set_value("spin", 10)
    assert "by hand" in start.inner_text()
    page.click_exercise("Back to the start")
    assert page.read_scene() == before and "as given" in start.inner_text()
