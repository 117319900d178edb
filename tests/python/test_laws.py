"""Laws of all tops and of all pairs of options: each compares two ways that must agree."""

import copy
import itertools
import pickle
from dataclasses import replace

import kreisel as kr
import numpy as np
from drawn_tops import (
    ANGLE,
    ANGULAR_MOMENTUM,
    DERIVED,
    EVENTS,
    LAWS,
    QUANTITIES,
    UNITS,
    Truth,
    assert_same_bits,
    assert_same_path,
    change_body,
    change_parameter,
    event_lists,
    get_parameter,
    has_past,
    join,
    list_methods,
    measure_angle,
    motions,
    numerics,
    outputs,
    scale_scene,
    solve_or_skip,
    subtract_paths,
    tops,
)
from hypothesis import assume, given, settings
from hypothesis import strategies as st

SMOOTH = tops(effects=("rotor", "damping", "turning", "shaking"))
UNDAMPED = "rotor", "turning", "shaking"
CONSERVATIVE, UNMOVED = tops(effects=UNDAMPED), tops(effects=("rotor",))
PRECISE = "exact", "taylor"  # adaptive methods with errors near rounding by default

# Accuracy

WAYS = {  # functions that compute the attitudes at the default precision
    "solve": lambda scene, t: kr.solve(scene, t).q,
    "taylor": lambda scene, t: kr.solve(scene, t, "taylor").q,
    "stream": lambda scene, t: join(kr.stream(scene, t, chunk=4), "q"),
    "run": lambda scene, t: kr.start(scene, back=bool(t[-1] < 0)).to(t).q,
    "ensemble": lambda scene, t: kr.solve(kr.Scene.stack([scene, kr.scenes.cusps]), t).q[0],
    "lanes": lambda scene, t: kr.solve(kr.Scene.stack([scene] * 5), t, "taylor").q[3],
}


@settings(LAWS, max_examples=200)
@given(motions(), st.sampled_from(sorted(WAYS)))
def test_every_way_to_solve_agrees_with_20_digits(motion, way):
    scene, t = motion
    truth = Truth(scene, t)
    assert truth.judge(WAYS[way](scene, t)) <= 1.0


@LAWS
@given(motions(CONSERVATIVE), st.data())
def test_every_method_converges_to_the_motion(motion, data):
    scene, t = motion
    truth = Truth(scene, t)
    method = kr.methods[data.draw(st.sampled_from(list_methods(scene)))]

    def find_error(**words):
        return kr.attitude_error(kr.solve(scene, t, method.name, **words).q, truth.path.q).max()

    limit = 10.0 * truth.allowed.max()
    if method.adaptive:
        assert find_error() <= limit + (0.0 if method.name in PRECISE else 1e-8)
    else:
        rate = np.linalg.norm(truth.path.inertial_velocity[0]) + 3.0
        errors = [find_error(step=x / rate) for x in (0.1, 0.05)]
        assert errors[1] <= errors[0] * 0.75**method.order + limit


@LAWS
@given(motions(), st.data())
def test_the_stated_error_is_the_true_error(motion, data):
    scene, t = motion
    path = solve_or_skip(scene, t, **data.draw(numerics(scene, t)))
    if path.digits == 30:
        assert 0.0 < path.error < 1e-20
        return
    true = measure_angle(path, kr.solve(scene, t, digits=30))
    assert true <= 1.5 * path.error + 1e-30 and path.error <= 1.5 * true + 1e-30


@LAWS
@given(tops(("kowalewski", "goryachev-chaplygin"), effects=()))
def test_certificates_of_closed_forms_bound_their_errors(scene):
    assume(scene.gravity and kr.methods["exact"].suits(scene))
    form = kr.exact(scene)
    assert 1e-17 < form.certificate < 1e-9
    for t in (np.array([0.3, 2.0, 20.0]), np.array([-1.0, -5.0])):
        truth = Truth(scene, t)
        errors = kr.attitude_error(form(t).q, truth.path.q)
        assert np.all(errors <= 10.0 * form.certificate + truth.allowed)
    assert kr.exact([kr.scenes.cusps, scene]).certificate[1] == form.certificate


# Symmetries


@LAWS
@given(motions(), st.tuples(*[st.integers(-40, 40)] * 3), st.data())
def test_results_scale_with_the_units_of_mass_length_and_time(motion, powers, data):
    def scale(unit):
        return 2.0 ** int(np.dot(unit, powers))

    (scene, t), unit_of_time = motion, scale((0, 0, 1))
    both = ((scene, t), (scale_scene(scene, scale), t * unit_of_time))
    words = data.draw(numerics(scene, t))
    scaled = words | ({"step": words["step"] * unit_of_time} if "step" in words else {})
    one, two = (
        solve_or_skip(*way, **more) for way, more in zip(both, (words, scaled), strict=True)
    )
    if one.method in ("extrap_kirchhoff", "gsl_rk8pd", "gsl_bsimp"):
        assert kr.attitude_error(one.q, two.q).max() < 1e-9
    else:
        for name, unit in (("t", (0, 0, 1)), ("q", ANGLE), ("m", ANGULAR_MOMENTUM)):
            assert_same_bits(getattr(one, name) * scale(unit), getattr(two, name), name)
    names = [name for name in UNITS if np.any(get_parameter(scene, name))]
    one, two = (kr.solve(*way, tangents=names).tangents for way in both)
    columns = [unit for name in names for unit in UNITS[name]]
    factors = [[scale(np.subtract(row, column)) for column in columns] for row in UNITS["start"]]
    np.testing.assert_allclose(two, one * factors, rtol=1e-13)
    events = data.draw(event_lists())
    one, two = (kr.solve(*way, events=events).events for way in both)
    assert_same_bits(one.t * unit_of_time, two.t)
    assert_same_bits(one.direction, two.direction)


TURN = (0.8, 0.0, 0.0, 0.6)  # about the vertical
FRAME = (0.6, 0.0, 0.48, -0.64)  # from other axes of the body


def mirror(scene):
    """Return the mirror image of a top in the plane of e2 and e3."""
    flip, inertia = np.array([-1.0, 1.0, 1.0]), np.array(scene.body.inertia)
    inertia = inertia if inertia.ndim == 1 else inertia * np.outer(flip, flip)
    com, rotor = flip * scene.body.com, -flip * scene.body.rotor
    return change_body(scene, inertia=inertia, com=com, rotor=rotor).replace(
        attitude=np.array([1.0, 1.0, -1.0, -1.0]) * scene.attitude,
        momentum=-flip * scene.momentum,
        turning=-flip * scene.turning,
    )


def reverse(scene):
    """Return the top that moves backward in time like the given one forward."""
    return change_body(scene, rotor=-np.array(scene.body.rotor)).replace(
        momentum=-np.array(scene.momentum),
        turning=-np.array(scene.turning),
        shaking=np.array(scene.shaking) * [1.0, 1.0, -1.0],
    )


def turn_about_vertical(scene):
    momentum, turning = (kr.quaternion.turn(TURN, v) for v in (scene.momentum, scene.turning))
    attitude = kr.quaternion.multiply(TURN, scene.attitude)
    return scene.replace(attitude=attitude, momentum=momentum, turning=turning)


def describe_in_other_axes(scene):
    attitude = kr.quaternion.multiply(scene.attitude, kr.quaternion.conjugate(FRAME))
    return scene.replace(body=scene.body.turn(FRAME), attitude=attitude, momentum=scene.momentum)


SYMMETRIES = {  # the changed scene, the sign of time, the changed attitude and momentum
    "mirror": (mirror, 1.0, lambda q: q * [1, 1, -1, -1], lambda m: m * [1, -1, -1]),
    "reversal": (reverse, -1.0, lambda q: q, lambda m: -m),
    "turn": (
        turn_about_vertical,
        1.0,
        lambda q: np.array([kr.quaternion.multiply(TURN, x) for x in q]),
        lambda m: np.array([kr.quaternion.turn(TURN, x) for x in m]),
    ),
    "frame": (
        describe_in_other_axes,
        1.0,
        lambda q: np.stack(kr.quaternion.multiply(q.T, kr.quaternion.conjugate(FRAME)), axis=-1),
        lambda m: m,
    ),
}
ROUNDED = tops(("general", "axial", "lagrange", "spherical", "free"), effects=UNDAMPED)


@settings(LAWS, max_examples=100)
@given(st.sampled_from(sorted(SYMMETRIES)), st.data())
def test_mirrored_reversed_and_turned_tops_move_alike(name, data):
    change, sign, change_q, change_m = SYMMETRIES[name]
    scenes = {"reversal": CONSERVATIVE, "frame": ROUNDED}.get(name, tops())
    scene, t = data.draw(motions(scenes))
    truth, words = Truth(scene, t), data.draw(numerics(scene, t))
    method = kr.methods["taylor" if words["method"] == "auto" else words["method"]]
    assume(method.adaptive or method.reversible)
    slack = 1e-8 if method.adaptive and method.name not in PRECISE else 0.0
    limit = 100.0 * truth.allowed + 1e3 * words.get("tol", slack)
    one, two = solve_or_skip(scene, t, **words), solve_or_skip(change(scene), sign * t, **words)
    assert np.all(kr.attitude_error(change_q(one.q), two.q) <= limit)
    momenta = np.abs(change_m(one.m) - two.m).max(axis=1)
    assert np.all(momenta <= 100.0 * limit * (1.0 + np.abs(one.m).max()))
    if np.ptp(kr.solve(scene, np.linspace(0, 3, 40)).apex[:, 2]) > 1e-3 and not scene.friction:
        found = [
            kr.solve(top, end, events=EVENTS[0]).events.t
            for top, end in ((scene, t[-1]), (change(scene), sign * t[-1]))
        ]
        assert np.abs(sign * found[0] - found[1]).max(initial=0.0) < 1e-7 + 100.0 * limit.max()


@LAWS
@given(motions(SMOOTH), st.integers(0, 5))
def test_a_motion_continues_from_each_of_its_states(motion, k):
    scene, t = motion
    truth = Truth(scene, t)
    scene_at, limit = kr.solve(scene, t).scene_at(k), 100.0 * truth.allowed.max()
    rest = kr.solve(scene_at, t[k:] - t[k])
    assert kr.attitude_error(rest.q, truth.path.q[k:]).max() <= limit
    if not any(scene.damping):
        back = kr.solve(scene_at, [-t[k]])
        assert kr.attitude_error(back.q[0], scene.attitude) <= 10.0 * limit


# Pieces of a motion


def save_to_file(run, folder):
    run.save(folder / "run")
    return kr.resume(folder / "run")


PASS_ON = {
    "checkpoint": lambda run, _: kr.resume(run.checkpoint),
    "file": save_to_file,
    "pickle": lambda run, _: pickle.loads(pickle.dumps(run)),
    "copy": lambda run, _: copy.deepcopy(run),
}


@settings(LAWS, max_examples=100)
@given(motion=motions(n=10), data=st.data())
def test_a_motion_in_pieces_is_the_whole_motion_bitwise(motion, data, tmp_path_factory):
    (scene, t), folder = motion, tmp_path_factory.mktemp("runs")
    words = data.draw(numerics(scene, t))
    words |= data.draw(outputs(words["method"]))
    whole = solve_or_skip(scene, t, **words)
    words["method"] = whole.method  # 'auto' may depend on the times
    cuts = sorted(data.draw(st.sets(st.integers(1, 9), max_size=4)))
    if words["events"]:  # each time is a piece, also at and beside the events
        at = abs(whole.events.t)
        t = [*abs(t), *at, *np.nextafter(at, 0.0), *np.nextafter(at, 99.0)]
        t = np.copysign(np.unique(t), whole.t[-1] or 1.0)
        whole, cuts = kr.solve(scene, t, **words), range(1, len(t))
    run, parts = kr.start(scene, back=bool(t[-1] < 0), **words), []
    for piece in np.split(t, cuts):
        parts += [] if run.ended else [run.to(piece)]
        run = PASS_ON[data.draw(st.sampled_from(sorted(PASS_ON)))](run, folder)
    assert_same_path(parts, whole)
    assert run.t == whole.t[-1] and run.stats == whole.stats and run.scene == scene
    times = data.draw(st.sampled_from((list, iter)))(t)
    parts = list(kr.stream(scene, times, chunk=data.draw(st.integers(1, 11)), **words))
    assert_same_path(parts, whole)
    again = whole(whole.t[(order := data.draw(st.permutations(range(len(whole)))))])
    for name in whole.want or ("q", "m", "q_low"):
        assert_same_bits(getattr(again, name), getattr(whole, name)[order], name)


@LAWS
@given(motions(SMOOTH), st.data())
def test_the_grid_of_a_fixed_step_is_the_same_in_pieces(motion, data):
    scene, t = motion
    words = data.draw(numerics(scene, t, kinds=("any",)))
    assume("step" in words)
    every, end = data.draw(st.integers(1, 4)), float(t[-1]) * 1.03
    whole = solve_or_skip(scene, end, every=every, **words)
    interval = every * words["step"]
    np.testing.assert_allclose(np.abs(whole.t), interval * np.arange(len(whole)), rtol=1e-15)
    assert np.all(whole.t * end >= 0) and -1e-12 <= abs(end) - abs(whole.t[-1]) < interval
    assert_same_path(list(kr.stream(scene, end, every=every, chunk=3, **words)), whole)
    assert_same_bits(kr.solve(scene, whole.t, **words).states, whole.states)


CHANGES = {
    "push": lambda run: run.push((0.25, -0.125, 0.5)),
    "reset": lambda run: run.reset((0.5, 0.25, -1.0), attitude=(0.6, 0.0, 0.8, 0.0)),
    "velocity": lambda run: run.reset(body_velocity=(0.5, 0.25, -1.0)),
    "gravity": lambda run: run.change(gravity=2.0),
    "mass": lambda run: run.change(body=double_mass(run.scene).body, keep="velocity"),
}


def double_mass(scene):
    body = scene.body
    return change_body(scene, mass=2.0 * body.mass, inertia=2.0 * np.array(body.inertia))


@LAWS
@given(motions(), st.sampled_from(sorted(CHANGES)), st.data())
def test_a_changed_run_is_a_new_run_from_the_changed_state(motion, change, data):
    scene, t = motion
    words = data.draw(numerics(scene, t, kinds=("taylor", "any")))
    assume(words.get("digits", 16) == 16)
    try:
        run = kr.start(scene, back=bool(t[-1] < 0), **words)
        end = run.to([t[2]]).end
        CHANGES[change](run)
    except (kr.Error, ValueError):  # the method does not suit the changed motion
        assume(False)
    after = run.scene.replace(shaking=end.shaking)  # the phase of a run is that at t = 0
    if change == "push":
        assert_same_bits(np.add(end.momentum, (0.25, -0.125, 0.5)), after.momentum)
    elif change == "reset":
        assert after.attitude == (0.6, 0.0, 0.8, 0.0) and after.momentum == (0.5, 0.25, -1.0)
    else:
        one, two = (kr.solve(top, [0.0]) for top in (end, after))
        expected = (0.5, 0.25, -1.0) if change == "velocity" else one.body_velocity[0]
        np.testing.assert_allclose(two.body_velocity[0], expected, rtol=1e-13, atol=1e-13)
    start_time, run = run.t, kr.resume(run.checkpoint)
    assert run.start_time == run.t == start_time == t[2]
    path, fresh = run.to(t[3:]), kr.solve(after, t[3:] - t[2], **words)
    assert path.scene == run.scene and kr.attitude_error(path.q, fresh.q).max() < 1e-9


# Pairs of options

OPTIONS = {
    "method": ("auto", "taylor", "exact", "extrap", "strang", "rk4", "veselov2", "geometric"),
    "step": (None, 0.05),
    "tol": (None, 1e-9),
    "digits": (None, None, 16, 20),
    "every": (None, None, 2),
    "error": (None, None, 1e-3),
    "want": (None, QUANTITIES[:3], ("energy", "q_low")),
    "events": (None, EVENTS[:2]),
    "tangents": (None, None, "start", ("gravity", "com")),
    "max_steps": (0, 10**6),
}
CALLS = st.fixed_dictionaries({name: st.sampled_from(x) for name, x in OPTIONS.items()})


def is_allowed(scene, t, words):
    """Return True if kreisel.solve must accept the options, according to its documentation."""
    given = {name for name, value in words.items() if value is not None}
    if words["method"] == "geometric":
        return "error" in given and given <= {"error", "want", "max_steps", "method"}
    name = "taylor" if words["method"] == "auto" else words["method"]
    method = kr.methods[name]
    return (
        method.suits(scene)
        and "error" not in given
        and (method.adaptive or "step" in given)
        and ("tol" not in given or method.adaptive or method.implicit)
        and ("digits" not in given or (method.digits and "tol" not in given))
        and ("every" not in given or not (method.adaptive or np.ndim(t)))
        and (not given & {"events", "tangents"} or name == "taylor")
        and ("tangents" not in given or not given & {"want", "events"})
    )


@settings(LAWS, max_examples=300)
@given(tops(("general", "lagrange", "free"), ("rotor",)), CALLS, st.booleans(), st.booleans())
def test_options_are_refused_before_a_run_or_leave_its_motion_alone(scene, words, is_list, is_many):
    t, reports = [0.0, 0.5, 1.5] if is_list else 1.5, []
    many = kr.Scene.stack([scene]) if is_many else scene
    try:
        path = kr.solve(many, t, **words, progress=reports.append)
    except (TypeError, ValueError):
        assert not is_allowed(scene, t, words) and not reports
        return
    assert is_allowed(scene, t, words) and reports[-1] == (1.0 if is_many else 1.5)
    path = path.check()[0] if is_many else path
    base = {name: getattr(path, name) for name in ("method", "step", "tol", "digits")}
    in_lanes = is_many and not words["events"] and not words["tangents"]
    plain = kr.solve(many, path.t, **base)[0] if in_lanes else kr.solve(scene, path.t, **base)
    if path.want is None:
        assert_same_bits(path.states, plain.states)
    for name in path.want or ():
        np.testing.assert_allclose(getattr(path, name), getattr(plain, name), rtol=0, atol=1e-11)
    if words["tangents"]:
        assert path.tangents.shape == (len(path), 6, 6 if words["tangents"] == "start" else 4)
    if words["events"]:
        again = kr.solve(scene, path.events.t, **base)
        np.testing.assert_allclose(again.q, path.events.path.q, rtol=0, atol=1e-9)


# Events and sections


@LAWS
@given(motions(SMOOTH), st.sampled_from(EVENTS), st.data())
def test_no_event_is_missed_or_found_twice(motion, event, data):
    """Compare the events with the changes of sign between the times of a dense grid."""
    scene, t = motion
    t = np.linspace(0.0, 3.0 * t[-1], 3000)
    dense = kr.solve(scene, t, "taylor")
    values, sign = event.value(dense), np.sign(t[-1])
    size = np.abs(values).max() + 1.0
    assume(np.ptp(values) > 1e-6)
    found = kr.solve(scene, t[-1], events=event).events
    if event.extremum:
        values, t, sign = np.diff(values), 0.5 * (t[1:] + t[:-1]), 1.0
    else:
        assert np.abs(event.value(found.path)).max(initial=0.0) < 1e-10 * size
    changes = np.diff(np.sign(values))
    counts = np.histogram(abs(found.t), abs(t))[0]
    is_clear = np.abs(values[1:]) + np.abs(values[:-1]) > 1e-9 * np.abs(values).max()
    assert np.all(counts[is_clear] % 2 == (changes[is_clear] != 0))
    places = np.searchsorted(abs(t), abs(found.t)) - 1
    is_inside = (places >= 0) & (places < len(changes))
    for place, direction in zip(places[is_inside], found.direction[is_inside], strict=True):
        if counts[place] == 1 and is_clear[place]:
            assert np.sign(changes[place]) == sign * direction
    direction, most = (data.draw(st.sampled_from(x)) for x in ((0, 1, -1), (None, 1, 2)))
    high = kr.events.crossing("spin", where={"apex_z": 1.0, "1": -0.1}).where
    picked = replace(event, where=high, direction=direction, max_count=most)
    is_wanted = (found.path.apex[:, 2] > 0.1) & ((direction == 0) | (found.direction == direction))
    some = kr.solve(scene, dense.t[-1], events=picked).events
    assert_same_bits(some.states, found.states[is_wanted][:most])


@LAWS
@given(motions(SMOOTH), st.sampled_from(EVENTS), st.sampled_from((0, 1, -1)))
def test_a_section_consists_of_the_first_events(motion, event, direction):
    scene, t = motion
    event, end = replace(event, direction=direction), float(np.copysign(abs(t[-1]) + 3.0, t[-1]))
    truth = Truth(scene, [end])
    events = kr.solve(scene, end, events=event).events.t
    events = events[np.abs(events) > 1e-9]
    assume(np.all(np.abs(np.diff(events)) > 1e-4))
    words = {"n": len(events) or 1, "max_wait": end}
    section = kr.section(scene, event, **words)
    found = section.t[np.abs(section.t) > 1e-9]
    assert len(found) >= len(events) - 1
    error = np.abs(found[: len(events)] - events[: len(found)]).max(initial=0.0)
    assert error < 1e-7 + 1e3 * truth.allowed.max()
    tops = kr.Scene.stack([kr.scenes.cusps, scene, kr.scenes.asymmetric])
    many = kr.section(tops, event, **words)
    assert_same_bits(many[1].states, section.states)
    assert many.count[1] == section.count and many.status[1] == section.status


# Members of ensembles

TOO_FAST = kr.scenes.cusps.replace(momentum=(0.0, 0.0, 1e300))  # no time is resolved
REDUCTIONS = ("min", "max", "mean", "variance", "last", "where_min", "where_max")


@st.composite
def ensemble_options(draw, scenes):
    """Draw a method that suits all scenes, and the numbers and results that are asked for."""
    name = draw(st.sampled_from(("auto", "taylor", *list_methods(*scenes))))
    if name not in ("auto", "taylor"):
        return {"method": name} | ({} if kr.methods[name].adaptive else {"step": 0.1})
    words = draw(st.sampled_from(({}, {"digits": 20}, {"tol": 1e-7}, {"max_steps": 2})))
    more = draw(st.sampled_from(("outputs", "tangents", "nothing")))
    if more == "tangents":
        words = words | {"tangents": ["start", "gravity", "turning"]}
    return {"method": name, **words, **(draw(outputs(name)) if more == "outputs" else {})}


def solve_alone(scene, t, **words):
    """Return the path of a scene, or as far as it came, and its status."""
    try:
        return kr.solve(scene, t, **words), "OK"
    except kr.Error as error:
        return error.path, error.status
    except ValueError:
        return None, "refused"


def assert_equal_members(path, alone, is_bitwise, slack):
    if is_bitwise:
        assert_same_path([path], alone)
        return
    for name in alone.want or ("q", "m"):
        own, expected = getattr(path, name), getattr(alone, name)
        np.testing.assert_allclose(own, expected, rtol=1e-6, atol=slack)


@settings(LAWS, max_examples=120)
@given(st.lists(tops(), min_size=1, max_size=3), st.data())
def test_a_member_of_an_ensemble_is_the_top_alone(scenes, data):
    is_back = data.draw(st.booleans()) and all(has_past(scene) for scene in scenes)
    t, place = [-0.3, -1.1, -2.0] if is_back else [0.0, 0.3, 2.0], data.draw(st.integers(0, 1))
    many = [*scenes[:place], TOO_FAST, *scenes[place:]]
    words, threads = data.draw(ensemble_options(many)), data.draw(st.sampled_from((1, 2)))
    own_times = np.tile(t, (len(many), 1)) if data.draw(st.booleans()) else t
    paths = kr.solve(kr.Scene.stack(many), own_times, threads=threads, **words)
    is_bitwise = bool({n for n in ("step", "digits", "events", "tangents") if words.get(n)})
    assert paths.status[place] != "OK" and place in paths.failed
    for i in set(range(len(many))) - {place}:
        alone, status = solve_alone(many[i], t, **words)
        assert status in (paths.status[i], "refused")
        assert (status == "OK") == (i not in paths.failed)
        single = kr.solve(kr.Scene.stack(many[i : i + 1]), t, **words)
        assert_same_path([single[0]], paths[i])
        if alone is not None:
            slack = words.get("tol", 1e-9) * (1.0 + max(many[i].damping))  # of accelerations
            assert_equal_members(paths[i], alone, is_bitwise, slack)
        if "tangents" in words:
            n = len(alone)
            assert_same_bits(paths.tangents[i][:n], alone.tangents)
            assert_same_bits(paths.derivative("energy")[i][:n], alone.derivative("energy"))


@LAWS
@given(st.lists(UNMOVED, min_size=1, max_size=3), st.data())
def test_the_indicators_of_a_member_are_those_of_the_top_alone(scenes, data):
    t = data.draw(st.sampled_from(([3.0], [2.0, 9.0], [-4.0])))
    threads = data.draw(st.sampled_from((1, 2)))
    found = kr.chaos(kr.Scene.stack([TOO_FAST, *scenes]), t, threads=threads)
    assert found.failed.tolist() == [0]
    for i, scene in enumerate(scenes, 1):
        alone = kr.chaos(scene, t)
        for word in ("lyapunov_curve", "megno_curve", "oli", "certificate", "turns", "doubt"):
            assert np.array_equal(getattr(found, word)[i], getattr(alone, word)), word
        assert 0.0 < alone.certificate < 1e-9


@LAWS
@given(st.lists(tops(), min_size=1, max_size=3), st.data())
def test_reductions_are_those_of_the_states(scenes, data):
    t = np.array([0.0, 0.4, 0.9, 1.7, 2.0])
    names = data.draw(st.lists(st.sampled_from(QUANTITIES), min_size=1, max_size=3, unique=True))
    tops, most = kr.Scene.stack([*scenes, TOO_FAST]), data.draw(st.sampled_from((0, 0, 1)))
    paths = kr.solve(tops, t, max_steps=most, want=names)
    found = kr.reduce(tops, t, dict.fromkeys(names, REDUCTIONS), max_steps=most)
    assert np.array_equal(found.status, paths.status)
    for name, i in itertools.product(names, np.flatnonzero(paths.status == "OK")):
        values, kinds = getattr(paths, name)[i], {k: v[i] for k, v in found[name].items()}
        ranks = np.sort(values, axis=0)
        expected = (ranks[0], ranks[-1], values.mean(axis=0), values.var(axis=0), values[-1])
        for kind, value in zip(REDUCTIONS, expected, strict=False):
            np.testing.assert_allclose(kinds[kind], value, rtol=1e-10, atol=1e-11, err_msg=kind)
        for kind, gap in (("min", ranks[1] - ranks[0]), ("max", ranks[-1] - ranks[-2])):
            where = t[getattr(values, f"arg{kind}")(axis=0)]
            assert np.all((kinds[f"where_{kind}"] == where) | (gap < 1e-9)), (name, kind)
    for name, kind in itertools.product(names, REDUCTIONS[:5]):
        assert np.all(np.isnan(found[name][kind][paths.status != "OK"]))


def has_closed_form(scene):
    try:
        kr.exact(scene)
    except ValueError as error:
        assert not kr.methods["exact"].suits(scene) or "separatrix" in str(error)
        return False
    return True


@LAWS
@given(st.lists(UNMOVED, min_size=1, max_size=5), st.data())
def test_closed_forms_of_many_tops_are_those_of_each(scenes, data):
    scenes = [kr.scenes.cusps, *(s for s in scenes if has_closed_form(s))]
    forms, t = kr.exact(scenes), data.draw(st.sampled_from((2.5, [0.0, 1.0, 1e4], [-3.0, 5.0])))
    for i, scene in enumerate(scenes):
        alone = kr.exact(scene)
        for name in ("period", "precession_rate", "spin_angle_rate"):
            assert_same_bits(getattr(forms, name)[i], getattr(alone, name), name)
        assert_same_bits(forms(t)[i].states, alone(t).states)
        is_heavy = scene.gravity and any(scene.body.com)
        if np.isfinite(alone.period) and is_heavy and not any(scene.body.rotor):
            assert np.ptp(alone([0.7, 0.7 + alone.period]).nutation) < 1e-7


# Tangents


@settings(LAWS, max_examples=100)
@given(motions(tops(("general", "axial", "free"))), st.sampled_from(sorted(UNITS)), st.data())
def test_tangents_are_differences_of_motions(motion, name, data):
    scene, t = motion
    assume(name != "friction" or scene.friction)
    assume(name != "com" or any(scene.body.com))
    k, step = data.draw(st.integers(0, len(UNITS[name]) - 1)), 2.0**-17
    if name in ("damping", "shaking"):
        scene = scene.replace(**{name: np.array(getattr(scene, name)) + 0.1})
    digits = data.draw(st.sampled_from((None, 20)))
    path = kr.solve(scene, t, tangents=[name, "start"], digits=digits)
    column = k + (0 if name == "start" else 6)
    ends = [
        kr.solve(change_parameter(scene, name, k, x * step), t, digits=20) for x in (1, -1, 2, -2)
    ]
    quantity = data.draw(st.sampled_from(DERIVED))
    values = [getattr(end, quantity) for end in ends]
    for own, near, far in (
        (path.tangents, subtract_paths(*ends[:2]), subtract_paths(*ends[2:])),
        (path.derivative(quantity), values[0] - values[1], values[2] - values[3]),
    ):
        slope = (8.0 * near - far) / (12.0 * step)
        size = 1.0 + np.abs(slope).max()
        assert np.abs(own[..., column] - slope).max() < 1e-7 * size**2


# Files


@LAWS
@given(motion=motions(), data=st.data())
def test_a_saved_path_is_read_as_the_same_path(motion, data, tmp_path_factory):
    (scene, t), file = motion, tmp_path_factory.mktemp("paths") / "path"
    words = data.draw(numerics(scene, t))
    has_tangents = words["method"] in ("auto", "taylor") and data.draw(st.booleans())
    more = {"tangents": ["start", "mass"]} if has_tangents else data.draw(outputs(words["method"]))
    path = solve_or_skip(scene, t, **words, **more)
    path.save(file)
    for other in (kr.load(file), pickle.loads(pickle.dumps(path)), copy.deepcopy(path)):
        assert_same_path([other], path)
        for name in ("scene", "method", "step", "tol", "digits", "start_time"):
            assert getattr(other, name) == getattr(path, name), name
        if has_tangents:
            assert_same_bits(other.tangents, path.tangents)
            assert_same_bits(other.derivative("spin"), path.derivative("spin"))
    scene.to_toml(file)
    assert kr.Scene.from_toml(file) == kr.load(file) == kr.Scene.from_toml(scene.to_toml()) == scene
    assert_same_path([kr.solve(kr.load(file), t, **words, **more)], path)
