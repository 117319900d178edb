"""Tests that the picture draws the motion, the body and the torque that kreisel computes."""

import kreisel as kr
import numpy as np
import pytest
from browser import PRESETS, UPRIGHT, WIDE, Viewer, wait_for

TOP = "kreisel.view.tops[0]"
TRACE = 2048  # largest number of points in a trace
ROD_SIDES = 12  # number of sides of the cross section of a rod, which is a polygon


def solve_first_top(page, t, every=1):
    """Solve the first top of the page until `t` with its own step."""
    top = page.read_tops()[0]
    scene = page.build_scene()
    if top["method"] == "exact":
        return kr.exact(scene)(np.arange(round(t / top["step"]) + 1) * top["step"])
    return kr.solve(scene, t, top["method"], step=top["step"], every=every)


# Curves


def read_curve(page):
    """Return the points of the trace of the apex, beginning with the newest."""
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.start.data.array), drawRange.count])({TOP}.line.geometry)""")
    return np.reshape(places, (-1, 4, 3))[: count // 6 + 1, 0]


@pytest.mark.parametrize("t, stride", [(5, 1), (45, 2)])
def test_the_trace_is_the_curve_of_the_apex(page, t, stride):
    page.advance(t)
    points = read_curve(page)
    assert len(points) == min(100 * t + 1, TRACE)
    radius = np.linalg.norm(points, axis=1)
    apex = solve_first_top(page, t).apex[::-stride][: len(points)]
    assert points / radius[:, None] == pytest.approx(apex, abs=1e-6)
    fading = 1 - 0.02 * np.arange(len(points)) / TRACE
    assert radius == pytest.approx(radius[0] * fading, rel=1e-6)


def test_the_path_of_m_is_horizontal_and_agrees_with_python(page):
    page.open_exercise("A spinning top", "Why does it not fall?")
    page.advance(0.5)
    places, drawn, zoom = page.evaluate(f"""(({{attributes: {{start}}, index, drawRange}}) => [
        Array.from(start.data.array), Array.from(index.array.slice(0, drawRange.count)),
        kreisel.view.momentumZoom])({TOP}.momentumTrace.geometry)""")
    points = np.reshape(places, (-1, 4, 3))[:501, 0]
    assert points == pytest.approx(zoom * solve_first_top(page, 0.5).m[::-1], abs=1e-6)
    assert np.ptp(points[:, 2]) < 1e-6 < np.ptp(points[:, 0])
    gaps = np.diff(np.unique(np.array(drawn) // 4)) > 1
    assert 0.3 < len(gaps) / 500 < 0.7 and gaps.sum() > 5  # dashed, unlike the trace of the apex


def read_rings(page):
    """Return the mesh of the rod as an array of rings, beginning with the ring added last."""
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.position.array), drawRange.count])({TOP}.rod.geometry)""")
    return np.reshape(places, (-1, ROD_SIDES, 3))[: count // (6 * ROD_SIDES) + 1]


@pytest.mark.parametrize("preset", ["Elastic rod", "Kowalewski"])
def test_the_rod_agrees_with_python_and_grows(page, preset):
    page.load(preset)
    page.get_by_role("checkbox", name="Elastic rod").check()
    lengths = []
    for t in (1, 8, 15):
        page.advance(t)
        lengths.append(len(read_rings(page)))
    assert lengths == [21, 161, 301]
    path = solve_first_top(page, 15)
    scale = page.evaluate("0.5 * kreisel.view.zoom")
    line, expected = read_rings(page).mean(axis=1) / scale, kr.rod(path).centre[::-5]
    ends = path.apex[::-5] - path.apex[-1]
    # the sum of the segments, each along the tangent at the newer end of the segment
    assert np.abs(line - (expected - expected[0]) - 0.025 * ends).max() < 0.002


def test_the_section_of_the_rod_follows_from_the_moments(page):
    for preset, section, ratio in (
        (UPRIGHT, "stiff", 1),
        ("Kowalewski", "stiff", 0.5**0.5),
        ("Goryachev-Chaplygin", "stiff", 0.5),
        ("Goryachev-Chaplygin", "thesis", 0.25),
        ("Goryachev-Chaplygin", "round", 1),
    ):
        page.load(preset, show={"rod": True})
        page.get_by_label("Rod's section").select_option(section)
        page.advance(3)
        ring, path = read_rings(page)[0], solve_first_top(page, 3)
        radii = np.linalg.norm(ring, axis=1)
        assert radii.min() / radii.max() == pytest.approx(ratio, rel=1e-5)
        assert np.abs(ring @ path.apex[-1]).max() < 1e-6
        sides = kr.rod(path).section
        assert section != "stiff" or min(sides) / max(sides) == pytest.approx(ratio)


def test_thumbnails_show_the_traces(page):
    curves = "[...document.querySelectorAll('#presets svg')].map((svg) => svg.querySelector('{}'))"
    curves = curves.format('[stroke-width="1.6"]')
    for preset in ("A spinning top", "Rising top", "Gyroscope"):
        page.load(preset)
        path = page.read_exact()(np.arange(240, -1, -1) * 0.05 * page.read_scene()["speed"])
        data = page.evaluate(f"{curves}[{PRESETS.index(preset)}].getAttribute('d')")
        points = np.array([point.split() for point in data[1:].split("L")], float)
        x, y, z = path.apex.T
        expected = np.transpose([x, -(z + y) / np.sqrt(2)])
        assert points == pytest.approx(expected, abs=0.03)  # older points are nearer the centre
    assert page.evaluate(f"{curves}.every((curve) => curve.getTotalLength() > 0)")


# Arrows


def read_arrow(page, name):
    """Return the starting point and the vector of one of the arrows drawn on the first top."""
    script = f"""(({{position, quaternion, tip}}) =>
        [position, tip.position.clone().applyQuaternion(quaternion)].map((v) => v.toArray())
    )({TOP}.{name})"""
    return map(np.array, page.evaluate(script))


def test_the_torque_is_drawn_at_the_tip_of_m_and_the_weight_at_the_centre(page):
    for preset in PRESETS:
        page.load(preset)
        check_torque(page)


def check_torque(page):
    """Compare the drawn weight, torque and drop lines with those of the scene."""
    for place in ("torque", "momentum", "vertical", "drops"):
        page.set_value(f"show.{place}", True)
    page.advance(1.5)
    scene, state = page.build_scene(), page.read_states()[0]
    lever = np.array(kr.quaternion.turn(state[1:5], scene.body.com))
    torque = np.cross(lever, [0, 0, -scene.body.mass * scene.gravity])
    zoom, momentum_zoom = page.evaluate("[kreisel.view.zoom, kreisel.view.momentumZoom]")
    tip, centre = momentum_zoom * np.array(state[5:]), zoom * lever
    floor = page.evaluate(f"kreisel.view.floor.height - {TOP}.group.position.z")
    drops = page.evaluate(f"""{TOP}.drops.children.map(({{position, children}}) =>
        [...position.toArray(), children[0].scale.z])""")
    expected = [[x, y, floor, z - floor] for x, y, z in (tip, centre)]
    assert np.array(drops) == pytest.approx(np.array(expected), abs=1e-6)
    shown = [page.evaluate(f"{TOP}.{name}.visible") for name in ("weight", "torque", "p")]
    assert shown[0] == shown[1] == bool(scene.gravity)
    if not scene.gravity:
        return
    begin, arrow = read_arrow(page, "torque")
    assert begin == pytest.approx(tip, abs=1e-6)
    if np.linalg.norm(torque) > 1e-9:
        unit = torque / np.linalg.norm(torque)
        assert arrow / np.linalg.norm(arrow) == pytest.approx(unit, abs=1e-6)
    begin, arrow = read_arrow(page, "weight")
    assert begin == pytest.approx(centre, abs=1e-6)
    assert arrow[:2] == pytest.approx([0, 0]) and arrow[2] * scene.gravity < 0


@pytest.mark.parametrize("exercise", [None, "A helix", "A plane curve"])
def test_a_rod_alone_fills_the_picture_without_arrows_and_numbers(page, exercise):
    page.open_exercise("Elastic rod", exercise)
    page.advance(30)
    assert page.read_numbers() == {} and page.locator(".labels .arrow:visible").count() == 0
    heights = page.evaluate("""(({view}, {rod}) => {
        const {position} = rod.geometry.attributes;
        const at = (k) => rod.position.clone().fromBufferAttribute(position, k);
        const all = Array.from({length: rod.geometry.drawRange.count / 6}, (_, k) => at(k));
        return all.map((point) => view.project(rod.localToWorld(point))[1]);
    })(kreisel, (kreisel.view.render(), kreisel.view.tops[0]))""")
    assert min(heights) > 0 and max(heights) < WIDE[1] and np.ptp(heights) > WIDE[1] / 2


def test_labels_stand_at_their_arrows_and_do_not_cover_the_torque(page):
    page.load("A spinning top", show={})
    page.evaluate("kreisel.view.isDirty = true; kreisel.view.render()")
    words = page.locator(".labels span:visible").all_inner_texts()
    assert [each[-1] for each in words[:3]] == ["m", "ω", "p"]
    assert words[3].endswith("30.0°") and words[4].endswith("48.4°")
    page.click_exercise("Why does it not fall?")
    for t in np.arange(0, 0.8, 0.05):
        page.advance(t)
        page.evaluate("kreisel.view.render()")
        begin, end = page.evaluate(f"""[{TOP}.m, {TOP}.torque].map((arrow) =>
            kreisel.view.project(arrow.getEnd()))""")
        points = np.linspace(begin, end, 20)
        for words in ("momentum m", "torque"):
            box = page.locator(".labels .arrow", has_text=words).bounding_box()
            low, size = np.array([box["x"], box["y"]]), np.array([box["width"], box["height"]])
            is_inside = (points > low) & (points < low + size)
            assert not is_inside.all(axis=1).any(), (words, t)
            near = np.clip(begin if words[0] == "m" else end, low, low + size)
            assert np.linalg.norm(near - (begin if words[0] == "m" else end)) < 60


def test_tops_side_by_side_are_labelled(page):
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.1, every=1)
    letters = page.locator(".labels span")
    page.load(methods=["strang", "rk4"])
    assert letters.all_inner_texts()[-1] == "rk4"
    page.load_scene(kr.view(path, open=False).scene)
    assert letters.all_inner_texts()[-1] == "the path: rk4"


# Bodies


# Returns the density of each drawn solid, and its triangles relative to the fixed point.
TRIANGLES = """(({zoom, world, tops: [{body, solid}]}) => {
    world.updateMatrixWorld(true);
    return solid.handles.map((mesh) => {
        const {index, attributes: {position}} = mesh.geometry, at = mesh.position.clone();
        const turn = (place) => body.worldToLocal(mesh.localToWorld(place)).divideScalar(zoom);
        return [mesh.userData.density ?? 0,
            Array.from(index.array, (k) => turn(at.fromBufferAttribute(position, k)).toArray())];
    });
})(kreisel.view)"""
THINGS = ["top", "disk", "gyroscope", "compass", "wheel", "handle", "satellite"]


@pytest.mark.parametrize("thing", THINGS)
def test_things_are_drawn_with_the_centre_and_the_moments_of_any_body(page, thing):
    given = {} if thing == "top" else {"body": {"thing": thing}}
    page.load("A spinning top", **given, show={"solid": thing})
    for change in (None, "body.half.2", "mass"):
        if change:
            page.set_value(change, 0.013)
        drawn = np.zeros((4, 4))  # integrals of the products of x, y, z and 1
        for density, corners in page.evaluate(TRIANGLES):
            tetrahedra = np.pad(np.reshape(corners, (-1, 3, 3)), ((0, 0), (1, 0), (0, 1)))
            tetrahedra[..., 3] = 1  # each has a corner at the origin
            volumes = np.linalg.det(tetrahedra) / 120
            drawn += (
                density
                * np.sign(volumes.sum())
                * sum(
                    np.einsum("n,nij,nik->jk", volumes, each, each)
                    for each in (tetrahedra, tetrahedra.sum(axis=1, keepdims=True))
                )
            )
        body, drawn = page.build_scene().body, drawn / drawn[3, 3]
        squares = 0.5 * np.sum(body.inertia) - np.array(body.inertia)
        size = squares.max() / body.mass
        assert drawn[:3, :3] == pytest.approx(np.diag(squares) / body.mass, abs=0.01 * size)
        assert drawn[3, :3] == pytest.approx(body.com, abs=0.01 * size**0.5)


def test_the_mark_is_spread_over_the_angle_that_it_turns_in_a_frame(page):
    page.load("A spinning top", start={"tilt": 30, "spin": 2 * np.pi / 0.03})
    ring = """(({geometry: {attributes: {color}, looks}}) =>
        Array.from({length: 96}, (_, k) => color.getY(k * looks.length + looks.indexOf('paint')))
    )(kreisel.view.tops[0].solid.handles[0])"""
    sharp = np.array(page.evaluate(ring))
    run = f"(kreisel.page.isRunning = true, kreisel.advance(0.03), {ring})"  # for a full turn
    spread = np.array(page.evaluate(run))
    assert np.ptp(sharp) > 0.5 and np.abs(spread - sharp.mean()).max() < 0.01
    page.evaluate("kreisel.page.setRunning(false)")
    assert np.ptp(page.evaluate(ring)) > 0.5


def draw_solid(page, body):
    """Show a body as a solid of revolution, and return the drawn profile."""
    scene = kr.view(kr.Scene(body, (0.0, 0.0, 1.0), gravity=1), open=False).scene
    page.load_scene({**scene, "show": {"solid": "top"}})
    return np.array(page.evaluate("kreisel.view.revolution.profile.map((at) => at.slice(0, 2))"))


@pytest.mark.parametrize("turn", [(0.5, 0.5, 0.5, 0.5), (0.8, 0.36, 0.48, 0.0)])
def test_cones_and_cylinders_are_drawn_along_their_axis(page, turn):
    height, radius = draw_solid(page, kr.Body.cylinder(1.0, 2.0, (0, 0, -1), mass=1.5)).T
    assert radius[1:-1] == pytest.approx(1, rel=0.01) and np.ptp(height) == pytest.approx(2, 0.01)
    cone = kr.Body.cone(1.0, 2.0, (0, 0, 0), mass=1.5)
    profile = draw_solid(page, cone)
    height, radius = profile.T
    assert radius[0] == 0 and height[0] == pytest.approx(0, abs=1e-6)
    assert radius[1:3] / height[1:3] == pytest.approx(0.5, rel=1e-6)
    assert height[2:] == pytest.approx(2, rel=1e-3) and radius.max() == pytest.approx(1, rel=1e-6)
    assert draw_solid(page, cone.turn(turn)) == pytest.approx(profile, abs=1e-6)
    drawn_axis = page.evaluate("""(({world, tops: [{solid}]}) => {
        world.updateMatrixWorld(true);
        return solid.handles[0].matrixWorld.elements.slice(4, 7);
    })(kreisel.view)""")
    axis = kr.solve(page.build_scene(), [0.0]).apex[0]
    assert drawn_axis / np.linalg.norm(drawn_axis) == pytest.approx(axis, abs=1e-6)


# Pixels


def read_pixels(page, size=(120, 75)):
    """Draw the picture in full, and return a small copy of it."""
    return np.reshape(
        page.evaluate(
            """([width, height]) => {
            const pen = new OffscreenCanvas(width, height).getContext('2d');
            drawPicture();
            pen.drawImage(kreisel.view.canvas, 0, 0, width, height);
            return Array.from(pen.getImageData(0, 0, width, height).data);
        }""",
            size,
        ),
        (*size[::-1], 4),
    )


@pytest.mark.parametrize("preset", ["A spinning top", "Elastic rod", "Compare four"])
def test_bodies_and_rods_have_shadows_on_the_floor(page, preset):
    page.load(preset)
    page.advance(6)
    shadow = read_pixels(page)
    page.evaluate("kreisel.view.floor.shadows.visible = false")
    full = read_pixels(page)
    page.evaluate("kreisel.view.floor.shadows.visible = true")
    darker = (full - shadow)[..., :3].mean(axis=2)
    assert darker.max() > 15 and darker.min() > -3
    rows, _ = np.nonzero(darker > 10)
    assert len(rows) > (4 if preset == "Elastic rod" else 40) and np.median(rows) > 30
    script = """kreisel.view.floor.shadows.children.every(
        ({visible, userData: {isRod}}) => visible === (isRod ? %s : %s))"""
    assert page.evaluate(script % (("true", "false") if "rod" in preset else ("false", "true")))


def test_the_tip_is_green_and_the_picture_returns_after_a_loss(window):
    page = window.open()
    for width in (900, 1280):
        page.resize((width, 800))
        red, green, blue, _ = page.evaluate("""() => {
            const {view} = kreisel, pen = new OffscreenCanvas(...view.pixels).getContext('2d');
            drawPicture();
            pen.drawImage(view.canvas, 0, 0, ...view.pixels);
            const place = kreisel.locate('tip').map(Math.round);
            return Array.from(pen.getImageData(...place, 1, 1).data);
        }""")
        assert green > 1.1 * blue and green > 2 * red
    page.evaluate("""new Promise((done) => {
        const lose = kreisel.view.renderer.getContext().getExtension('WEBGL_lose_context');
        const on = (type, act) => kreisel.view.canvas.addEventListener(type, act, {once: true});
        on('webglcontextlost', () => setTimeout(() => lose.restoreContext()));
        on('webglcontextrestored', () => requestAnimationFrame(done));
        lose.loseContext();
    })""")
    page.evaluate("new Promise(requestAnimationFrame)")
    assert len(np.unique(read_pixels(page).reshape(-1, 4), axis=0)) > 200


def test_the_viewer_starts_by_itself_and_an_idle_viewer_draws_nothing(browser):
    page = Viewer(browser, reduced_motion="no-preference").open()
    wait_for(page, "kreisel.page.clock > 200000 && kreisel.simulation.countRows() > 2")
    page.find_button("Stop").click()
    assert page.evaluate(f"{TOP}.line.geometry.drawRange.count") > 60
    frames = "kreisel.view.renderer.info.render.frame"
    wait_for(page, "!kreisel.view.isDirty && kreisel.charts.clock === kreisel.page.clock")
    before = page.evaluate(frames)
    page.evaluate("""new Promise((done) => {
        let left = 12;
        const next = () => (left-- ? requestAnimationFrame(next) : done());
        next();
    })""")
    assert page.evaluate(frames) == before
    page.set_value("gravity", 2)
    wait_for(page, f"{frames} > {before}")
    assert page.troubles == []
    page.context.close()


# Parts that are kept

# Returns all that is visible: the position, shape and colours of each part, and the letters.
SEEN = """window.seen = () => {
    const {view} = kreisel, parts = [];
    view.world.updateMatrixWorld(true);
    view.floor.updateShadows();
    view.world.updateMatrixWorld(true);
    view.labels.placeLabels(view.pixels);
    const digits = (numbers) => Array.from(numbers, (x) => +x.toFixed(5) + 0);
    const sum = ({index, drawRange, attributes}) => {
        const {array} = attributes.position ?? attributes.start.data;
        const drawn = index?.array.subarray(0, drawRange.count);
        let all = 0;
        for (let at = 0; at < (drawn?.length ?? array.length / 3); at++) {
            const k = drawn ? drawn[at] : at;
            for (let i = 0; i < 3; i++) all += ((k + i) % 97) * array[3 * k + i];
        }
        return (all || 0).toFixed(1);
    };
    view.world.traverseVisible(({geometry, material, matrixWorld, renderOrder}) => geometry &&
        parts.push([digits(matrixWorld.elements), material.color?.getHexString(), renderOrder,
            material.opacity, material.transparent, material.depthTest, geometry.drawRange.count,
            sum(geometry)]));
    const letters = [...view.labels.container.children].map((span) => span.outerHTML);
    return JSON.stringify([parts, letters, view.world.background.getHexString()]);
};"""
# Apply all pairs of changes. Return the pairs after which new parts would show another picture, and
# the changes that show nothing.
PAIRS = """(() => {
    const {page, view, presets} = kreisel, {onChange} = page;
    const {style} = document.documentElement;
    const preset = (name) => page.load(presets.find((preset) => preset.name === name));
    const change = (place, value) => () => page.setValue(place, value);
    const changes = {
        later: () => kreisel.advance(2),
        push: () => page.pushTop(page.tops[0], (scene) => (scene.momentum[0] += 1)),
        undo: () => page.undo(),
        weightless: change('gravity', 0),
        beside: change('methods.1', 'rk4'),
        ghost: change('ghost', true),
        box: change('show.solid', 'top'),
        plate: change('shape', 'kowalewski'),
        dark: () => (style.colorScheme = 'dark', view.updateBackground(), view.build(page, false)),
        four: () => preset('Compare four'),
        sleeping: () => preset('Sleeping top'),
    };
    const names = Object.keys(changes), wrong = [], idle = [];
    page.onChange = () => {}; // all but the picture rests
    for (const first of names)
        for (const second of names) {
            style.colorScheme = 'light';
            view.updateBackground();
            preset("Lagrange's top");
            page.undoStack = [];
            const before = first === second && seen();
            changes[first]();
            if (before && before === seen()) idle.push(first);
            changes[second]();
            page.isRunning = false;
            const kept = seen();
            view.partsKey = '';
            view.build(page, false);
            if (kept !== seen()) wrong.push(`${first}, ${second}`);
        }
    page.onChange = onChange;
    style.colorScheme = '';
    view.updateBackground();
    return [wrong, idle];
})()"""


def test_reused_parts_show_the_same_as_new_ones_after_any_two_changes(page):
    page.evaluate(SEEN)
    assert page.evaluate(PAIRS) == [[], ["undo"]]


def test_many_moves_of_the_pointer_leak_no_resources(page):
    script = """(() => {
        const {renderer} = kreisel.view, {memory, programs} = renderer.info;
        kreisel.view.isDirty = true;
        kreisel.view.render();
        const nodes = document.querySelectorAll('*').length;
        return [memory.geometries, memory.textures, programs.length, nodes];
    })()"""
    pulls = """(count) => {
        const {page, view} = kreisel;
        for (let k = 0; k < count; k++) {
            page.beginChange();
            view.isHeld = true;
            page.editScene((scene) => (scene.momentum[0] += 0.01));
            page.editScene((scene) => (scene.body.half[2] *= 1 + 0.01 * (-1) ** k));
            view.isHeld = false;
            view.render();
        }
    }"""
    page.load("Compare four")
    with page.hold("tip", (10, 10)):
        page.evaluate(script)  # draws the highlight
    page.evaluate(pulls, 10)
    before = page.evaluate(script)
    page.evaluate(pulls, 40)
    assert page.evaluate(script) == before
