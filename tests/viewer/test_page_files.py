"""Tests that links, downloads, programs and pages from Python carry the same scene."""

import csv
import html
import json

import kreisel as kr
import numpy as np
import pytest
from browser import PRESETS, WIDE, encode_link, make_viewport, scene_in_python, wait_for
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from toolbox import open_context

EVIL = '</script><b id="evil">bold</b><img src="x" onerror="kreisel.evil = 1">'
PROPERTY = settings(
    max_examples=10,
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.generate],  # shrinking would take minutes
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

# Click the buttons of the downloads, and return the texts of the files.
SAVE = """async (names) => {
    const own = [URL.createObjectURL, HTMLAnchorElement.prototype.click], files = [];
    URL.createObjectURL = (blob) => (files.push(blob.text()), '#');
    HTMLAnchorElement.prototype.click = () => {};
    const buttons = [...document.querySelectorAll('#panel button')];
    for (const name of names) buttons.find((each) => each.textContent === name).click();
    [URL.createObjectURL, HTMLAnchorElement.prototype.click] = own;
    return Promise.all(files);
}"""


def share(page):
    """Share the scene, and return the part of the link that encodes it."""
    return page.evaluate("""() => {
        kreisel.share.open();
        const link = location.hash;
        history.replaceState(null, '', '#');
        kreisel.share.place.close();
        kreisel.page.showMessage('');
        return link;
    }""")


def list_numbers(scene):
    """Return all numbers of a scene that a file of the viewer should keep."""
    given = kr.view(scene, open=False).scene
    names = ("attitude", "momentum", "gravity", "damping", "friction", "turning", "rotor")
    body = given["body"]
    rows = [body["mass"], *body["inertia"], *body["com"]]
    return [*rows, *np.hstack([np.atleast_1d(given[name]) for name in names])]


def check_files(page, expected, folder):
    """Check that each file and the link hold the scene that the page shows."""
    shown = page.read_scene()
    toml, text = page.evaluate(SAVE, ["TOML", "JSON"])
    (folder / "top.toml").write_text(toml)
    program = page.run_program(only_start=True)
    for scene in (kr.Scene.from_toml(folder / "top.toml"), program["scene"]):
        assert list_numbers(scene) == pytest.approx(list_numbers(expected), rel=1e-15)
    assert json.loads(text) == shown
    link = share(page)
    page.load("Kowalewski")
    assert page.follow_link(link) == "" and page.read_scene() == shown


# Scenes from Python

NUMBERS = st.floats(-3, 3).map(lambda x: round(x, 9))
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
SIZES = st.floats(0.2, 2)
RATIOS = st.floats(0.1, 1.9)  # of the moments of a symmetric body
AXES = st.tuples(st.just(1.0), NUMBERS, NUMBERS, NUMBERS).map(
    lambda q: tuple((np.array(q) / np.linalg.norm(q)).tolist())
)
BODIES = st.one_of(
    st.builds(lambda n, b, t, p: kr.Body.cuboid((n, b, t), p), SIZES, SIZES, SIZES, VECTORS),
    st.builds(lambda r, h: kr.Body.cone(r, h, (0, 0, 0), mass=1.5), SIZES, SIZES),
    st.builds(lambda r, h: kr.Body.cylinder(r, h, (0, 0, -1), mass=1.5), SIZES, SIZES),
    st.builds(lambda i, r: kr.Body(1.0, (i, i, i * r), (0, 0, 2), unphysical=True), SIZES, RATIOS),
)
OPTIONAL = {
    "damping": st.floats(1e-3, 0.5),
    "friction": st.floats(1e-3, 0.5),
    "turning": VECTORS,
}


@st.composite
def scenes(draw):
    body = draw(BODIES)
    if draw(st.booleans()):
        body = body.turn(draw(AXES))
    if draw(st.booleans()):
        body = body.with_rotor(spin=draw(SIZES), inertia=1.0, axis=(*draw(AXES)[1:3], 1.0))
    words = draw(st.fixed_dictionaries({}, optional=OPTIONAL))
    return kr.Scene(body, draw(VECTORS), draw(AXES), draw(NUMBERS), **words)


@PROPERTY
@given(scene=scenes(), speed=SIZES, data=st.data())
def test_a_scene_from_python_is_read_back_from_every_file(page, tmp_path, scene, speed, data):
    suitable = [name for name in ("strang", "rk4", "taylor") if kr.methods[name].suits(scene)]
    methods = data.draw(st.lists(st.sampled_from(suitable), min_size=1, max_size=3))
    view = kr.view(scene, methods=methods, step=0.02, speed=speed, open=False)
    page.load_scene(view.scene)
    assert page.read_message() == "" and page.read_scene()["methods"] == methods
    assert page.read_scene()["speed"] == speed and page.read_scene()["step"] == [0.02]
    check_files(page, scene, tmp_path)


CHANGES = st.fixed_dictionaries(
    {},
    optional={
        "gravity": NUMBERS,
        "damping": st.floats(0, 0.5),
        "friction": st.floats(0, 0.5),
        "turning": VECTORS.map(list),
        "rotor": VECTORS.map(list),
        "step": st.sampled_from([[0.02], [0.01, 0.1]]),
        "methods": st.sampled_from([["strang", "rk4"], ["taylor"], ["exact"]]),
        "own": st.booleans(),
        "log": st.booleans(),
        "tol": st.sampled_from([1e-9, 1e-3]),
        "chart": st.sampled_from(["spin", "energy", "kinetic"]),
        "show": st.fixed_dictionaries(
            {},
            optional={"rod": st.booleans(), "opacity": st.floats(0, 1), "torque": st.booleans()},
        ),
        "speed": SIZES,
        "name": st.sampled_from(["My own top", EVIL]),
    },
)


@PROPERTY
@given(preset=st.sampled_from(PRESETS), number=st.integers(-1, 2), changes=CHANGES)
def test_a_preset_with_any_changes_is_read_back_from_every_file(
    page, tmp_path, preset, number, changes
):
    page.load(preset)
    page.evaluate(
        """([number, {show, ...changes}]) => {
            document.querySelectorAll('.exercise')[number]?.click();
            const {page} = kreisel;
            page.setRunning(false);
            page.load({...page.scene, ...changes, show: {...page.scene.show, ...show}});
        }""",
        [number, changes],
    )
    shown = page.read_scene()
    check_files(page, scene_in_python(shown), tmp_path)
    if shown["second"]:
        page.load(preset)
        assert page.run_program(only_start=True)["second"] == scene_in_python(
            page.read_scene(), second=True
        )


def test_each_beat_of_the_story_is_a_link_and_the_last_leads_to_the_page(window):
    page = window.open(fragment="#story")
    page.resize((816, 480))  # as on the first page of the site
    assert not page.locator("#panel").is_visible()
    foot = "kreisel.view.project(kreisel.view.tops[0].group.position)[1]"
    for number in range(1, 6):
        at = "document.querySelector('#story nav')?.textContent"
        wait_for(page, f"{at}.includes('{number} of 5')")
        page.advance(0.3)
        assert (np.degrees(page.read_record(0, "nutation").max()) > 60) == (number == 3)  # falls
        wait_for(page, f"{foot} < document.getElementById('story').getBoundingClientRect().top")
        page.keyboard.press("PageDown")
    wait_for(page, "document.getElementById('panel').offsetParent")
    assert page.locator("#story").inner_text() == "" and page.troubles == []


def test_a_link_to_an_exercise_is_short(page):
    page.open_exercise("A spinning top", "Why does it not fall?")
    assert len(share(page)) < 150


@pytest.mark.parametrize(
    "preset, changes",
    [
        ("Sleeping top", {}),
        ("Compare four", {}),
        ("Equal work", {}),
        ("Kowalewski", {"methods": ["taylor", "strang", "rk4"], "step": [0.03, 0.07]}),
    ],
)
def test_the_program_gives_the_states_of_the_viewer(page, preset, changes):
    page.load(preset, **changes)
    program = page.run_program()
    page.advance(100)
    states = np.array(page.read_states())[:, 1:]
    ends = np.array([[*end.attitude, *end.momentum] for end in program["ends"]])
    tolerance = 1e-7 if "solve_in_steps" in program else 1e-11
    assert ends == pytest.approx(states, abs=tolerance)
    exact = [top["method"] not in {"extrap", "taylor"} for top in page.read_tops()]
    assert ends[exact].tolist() == states[exact].tolist()


# Files


@pytest.mark.usefixtures("full_picture")
def test_downloaded_files_have_the_scene_the_states_and_the_record(page, window, tmp_path):
    page.load("Compare four", about=EVIL)
    page.advance(300)
    scene = page.read_scene()
    with page.download("CSV", tmp_path / "top.csv").open() as file:
        head, *rows = csv.reader(file)
    rows = np.array(rows, float)
    assert rows[:, 0].tolist() == page.read_times().tolist() and rows[-1, 0] == 300
    for column, words in enumerate(head[1:], 1):
        name, number, method, step = words.replace(" ", ":").split(":")
        top = page.read_tops()[int(number)]
        assert (method, float(step)) == (top["method"], top["step"])
        record = page.read_record(int(number), name)
        assert rows[:, column] == pytest.approx(record, nan_ok=True, rel=1e-15)
    assert {"energy 0:bobenko_suris:0.01", "error 3:extrap:0.2"} <= {*head}
    picture = page.download("Picture", tmp_path / "top.png").read_bytes()
    assert picture.startswith(b"\x89PNG") and len(picture) > 5000
    other = window.open(page.download("This page", tmp_path / "top.html"))
    other.advance(300)
    assert other.read_scene() == scene and other.read_states() == page.read_states()
    assert other.locator("#evil, img").count() == 0 and other.troubles == []


def test_a_link_loads_in_the_open_viewer(page):
    page.advance(3)
    scene = {"name": EVIL, "about": EVIL, "momentum": [1, 2, 3], "methods": ["strang", "rk4"]}
    assert page.follow_link(encode_link({**scene, "step": [0.02]})) == ""
    assert page.evaluate("[kreisel.page.clock, kreisel.page.tops.length]") == [0, 2]
    page.advance(2)
    start = kr.Scene(kr.Body.cuboid((0.8, 0.8, 1), (0, 0, -1)), (1, 2, 3), gravity=1)
    expected = kr.solve(start, 2, "rk4", step=0.02, every=100).states[-1]
    assert page.read_states()[1] == expected.tolist()
    assert page.locator("#about").inner_text() == EVIL
    assert page.locator("#evil, img").count() == 0 and page.evaluate("kreisel.evil === undefined")


def test_links_accept_eps_and_short_names_of_charts(page):
    for shape, fourth in (("lagrange", "energy"), ("kowalewski", "kowalewski")):
        page.get_by_label("Shape").select_option(shape)
        body = page.read_scene()["body"]
        names = {"vertical": "vertical_momentum", "axial": "axial_momentum", "fourth": fourth}
        for chart, name in names.items():
            scene = {"body": body, "methods": ["strang"], "eps": [0.02, 0.1], "chart": chart}
            assert page.follow_link(encode_link(scene)) == ""
            assert page.read_scene()["step"] == [0.02, 0.1] and page.read_scene()["chart"] == name


# Share, pictures and films


@pytest.mark.parametrize(
    "environment, word",
    [
        ("navigator.clipboard.writeText = async () => {}", "Copied"),
        ("navigator.clipboard.writeText = () => Promise.reject(new Error('no'))", "address"),
        ("history.replaceState = () => { throw new Error('no address'); }", "no address"),
    ],
)
def test_the_dialog_says_where_the_link_is(page, environment, word):
    page.evaluate(f"() => {{ {environment}; }}")
    page.locator("canvas").first.focus()
    page.keyboard.press("k")
    wait_for(page, f"document.querySelector('#share p')?.textContent.includes('{word}')")
    assert page.read_message() == ""  # the dialog says it, and goes with its words
    page.keyboard.press("Escape")
    assert not page.locator("#share").is_visible()
    page.evaluate("delete navigator.clipboard.writeText, delete history.replaceState")
    page.evaluate("history.replaceState(null, '', '#')")


@pytest.mark.usefixtures("full_picture")
def test_pictures_and_films_are_not_empty(page, tmp_path):
    page.load("A spinning top")
    page.keyboard.press("k")
    before = page.evaluate("[...kreisel.view.pixels, kreisel.view.canvas.width]")
    picture = page.download("Square picture", tmp_path / "top.png").read_bytes()
    assert picture.startswith(b"\x89PNG") and len(picture) > 50_000
    assert [int.from_bytes(picture[k : k + 4], "big") for k in (16, 20)] == [1080, 1080]
    assert page.evaluate("[...kreisel.view.pixels, kreisel.view.canvas.width]") == before
    page.evaluate("Object.assign(kreisel.share, {seconds: 1, size: 120}).draw()")
    assert page.download("Film of 1 seconds", tmp_path / "film").stat().st_size > 1000
    page.evaluate("kreisel.page.setRunning(false)")
    page.evaluate("window.kept = kreisel.share.filmType, kreisel.share.filmType = undefined")
    page.find_button("Film of 1 seconds").click()
    assert "cannot record" in page.read_message()
    page.evaluate("Object.assign(kreisel.share, {seconds: 6, size: 1080, filmType: kept})")
    page.keyboard.press("Escape")
    page.find_button("Video").click()  # of a motion at rest
    for _ in range(5):
        page.evaluate("new Promise(requestAnimationFrame)")
    assert page.download("End video", tmp_path / "video").stat().st_size > 1000
    assert page.find_button("Video").is_visible()
    page.evaluate("history.replaceState(null, '', '#')")


# Pages from Python

FORBIDDEN = """async () => {
    const tried = [];
    const script = document.createElement("script");
    script.textContent = "window.foreign = true";
    document.body.append(script);
    const button = document.createElement("button");
    button.setAttribute("onclick", "window.foreign = true");
    document.body.append(button);
    button.click();
    const link = document.createElement("a");
    link.href = "javascript:window.foreign = true";
    document.body.append(link);
    link.click();
    for (const ask of [() => fetch("data:text/plain,a"), () => import("data:text/javascript,0")])
        await ask().then(() => tried.push("came"), () => tried.push("refused"));
    await new Promise((done) => setTimeout(done, 0));
    return [window.foreign ?? false, ...tried];
}"""


def test_a_page_from_python_shows_its_scene_and_runs_only_its_own_script(window, tmp_path):
    path = kr.solve(kr.scenes.asymmetric, 1, "rk4", step=0.1, every=1)
    kr.view(path, methods="strang", step=0.01, open=False).save(tmp_path / "a.html")
    page = window.open(tmp_path / "a.html")
    page.advance(1)
    expected = kr.solve(kr.scenes.asymmetric, 1, "strang", step=0.01, every=100).states[-1]
    assert page.read_states() == [expected.tolist(), path.states[-1].tolist()]
    assert page.troubles == []
    assert page.evaluate(FORBIDDEN) == [False, "refused", "refused"]
    assert all("Content Security Policy" in trouble for trouble in page.troubles)


def test_a_notebook_scrolls_until_a_click_in_the_viewer(browser):
    page = open_context(browser, offline=True, viewport=make_viewport(WIDE)).new_page()
    text = html.escape(kr.view(kr.scenes.dzhanibekov, open=False).html)
    frame = f'<iframe srcdoc="{text}" style="width:100%;height:600px;border:0"></iframe>'
    page.set_content(f"{frame}<div style='height:3000px'></div>")
    frame = page.frames[1]
    wait_for(frame, "!!window.kreisel")
    assert frame.evaluate("kreisel.page.tops.length") == 1
    distance_script = "kreisel.view.camera.position.length()"
    before = frame.evaluate(distance_script)
    page.mouse.move(60, 200)
    page.mouse.wheel(0, 120)
    wait_for(page, "scrollY === 120")  # the end of a smooth motion
    assert frame.evaluate(distance_script) == pytest.approx(before)
    page.evaluate("scrollTo(0, 0)")
    page.mouse.click(60, 200)
    page.mouse.wheel(0, 120)
    wait_for(frame, f"{distance_script} > {before + 0.1}")
    assert page.evaluate("scrollY") == 0
    page.context.close()
