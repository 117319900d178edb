"""Scenes in TOML files: the same scene is read back, and each key means what its argument means."""

import inspect
import re
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call
from hypothesis import given, settings
from hypothesis import strategies as st
from tops import CORNER

PAGE = Path(__file__).parents[2] / "docs/scene_files.md"
BODY = "[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 0]\n"
NUMBERS = st.floats(-10.0, 10.0).filter(lambda x: abs(x) > 1e-3)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@settings(max_examples=40, deadline=None)
@given(
    scale=st.sampled_from([1e-40, 1.0, 1e40]),
    pivot=VECTORS,
    rotor=VECTORS,
    attitude=st.tuples(NUMBERS, *[NUMBERS] * 3),
    support=st.fixed_dictionaries(
        {},
        optional={
            "damping": st.tuples(*[st.floats(0.0, 2.0)] * 3),
            "friction": st.floats(0.0, 0.5),
            "turning": VECTORS,
            "shaking": st.tuples(*[st.floats(0.01, 3.0)] * 3),
        },
    ),
    velocity=VECTORS,
)
def test_toml_preserves_every_bit(scale, pivot, rotor, attitude, support, velocity):
    half, pivot = np.array((0.6, 0.8, 1.0)) * scale, np.array(pivot) * scale
    cuboid = kr.Body.cuboid(half=half, pivot=pivot)
    body = kr.Body(cuboid.mass, cuboid.inertia, cuboid.com, rotor=rotor)
    if "friction" in support:
        support.pop("shaking", None)
    attitude = np.array(attitude) / np.linalg.norm(attitude)
    scene = kr.Scene(body, velocity=velocity, attitude=attitude, gravity=-0.1 * scale, **support)
    again = kr.Scene.from_toml(scene.to_toml())
    assert again == scene and again.to_toml() == scene.to_toml()
    for name in ("momentum", "attitude", "gravity", "damping", "friction", "turning", "shaking"):
        assert np.array_equal(getattr(again, name), getattr(scene, name))
    assert again.body.axes == body.axes and again.body.moments == body.moments


BODIES = {  # {text: the same body}
    "cuboid = { half = [0.6, 0.8, 1], pivot = [0.1, -0.2, -1] }": CORNER,
    "symmetric = { mass = 1, i1 = 2, i3 = 1.5, height = 0.5 }": kr.Body.symmetric(1, 2, 1.5, 0.5),
    "from_com = { mass = 1, inertia_about_com = [2, 2, 1.5], com = [0, 0, 1], "
    "pivot = [0, 0.5, 0] }": kr.Body.from_com(1, (2, 2, 1.5), (0, 0, 1), (0, 0.5, 0)),
    "mass = 1\ninertia = [[2, 0, 0], [0, 2, 0], [0, 0, 1]]\ncom = [0, 0, 1]": kr.Body(
        1, (2, 2, 1), (0, 0, 1)
    ),
    "cylinder = { radius = 1, height = 2, pivot = [0, 0, -1], mass = 3 }": kr.Body.cylinder(
        1, 2, (0, 0, -1), mass=3
    ),
    "tube = { inner = 0.5, outer = 1, height = 2, pivot = [0, 0, -1], density = 3 }": kr.Body.tube(
        0.5, 1, 2, (0, 0, -1), density=3
    ),
    "disk = { radius = 1, pivot = [0, 0, -1], mass = 3 }": kr.Body.disk(1, (0, 0, -1), mass=3),
    "rod = { length = 2, pivot = [1, 0, 0], mass = 3 }": kr.Body.rod(2, (1, 0, 0), mass=3),
    "sphere = { radius = 1, pivot = [0, 0, -1], mass = 3, shell = true }": kr.Body.sphere(
        1, (0, 0, -1), mass=3, shell=True
    ),
    "ellipsoid = { half = [1, 2, 3], pivot = [0, 0, -1], mass = 3 }": kr.Body.ellipsoid(
        (1, 2, 3), (0, 0, -1), mass=3
    ),
    "cone = { radius = 1, height = 2, pivot = [0, 0, 0], mass = 3 }": kr.Body.cone(
        1, 2, (0, 0, 0), mass=3
    ),
    "mass = 1\ninertia_about_com = [2, 2, 1]\ncom = [0, 0, 1]": kr.Body(
        1, inertia_about_com=(2, 2, 1), com=(0, 0, 1)
    ),
    "symmetric = { mass = 1, i1 = 1, i3 = 0.5, height = 1, unphysical = true }": kr.Body.symmetric(
        1, 1, 0.5, 1, unphysical=True
    ),
    "mass = 1\ninertia = [1, 2, 3.01]\ncom = [0, 0, 0]\ninertia_rtol = 0.004": kr.Body(
        1, (1, 2, 3.01), (0, 0, 0), inertia_rtol=0.004
    ),
}


@pytest.mark.parametrize("text", BODIES, ids=[text.partition(" ")[0] for text in BODIES])
def test_the_keys_of_a_body_are_the_arguments_of_its_constructor(text, tmp_path):
    start = "body_velocity = [0, 0.1, 2]\nattitude_xyzw = [0, 0, 1, 0]\ngravity = 1\n"
    expected = kr.Scene(
        BODIES[text], body_velocity=(0, 0.1, 2), attitude_xyzw=(0, 0, 1, 0), gravity=1
    )
    text = f"{start}[body]\n{text}\n"
    file = tmp_path / "eps=0.1.toml"
    file.write_text(text)
    for given_text in (text, file, str(file), expected.to_toml()):
        assert kr.Scene.from_toml(given_text) == expected


STARTS = {  # {text: the same start}
    "[from_euler]\nangles = [30, 60, 0]\nrates = [1, 2, 3]\ndegrees = true\ngravity = 9.81": (
        lambda body: kr.Scene.from_euler(body, (30, 60, 0), (1, 2, 3), degrees=True, gravity=9.81)
    ),
    "[spinning]\nspin = 60\ntilt = 1\nsteady = true\ngravity = 1": (
        lambda body: kr.Scene.spinning(body, 60, 1, steady=True, gravity=1)
    ),
    "gravity = 2\nfriction = 0.1\n[spinning]\nspin = 60\ndamping = 0.3": (
        lambda body: kr.Scene.spinning(body, 60, gravity=2, damping=0.3, friction=0.1)
    ),
}


@pytest.mark.parametrize("text", STARTS)
def test_the_keys_of_a_start_are_the_arguments_of_its_constructor(text):
    body = kr.Body.cone(1, 2, (0, 0, 0), mass=3)
    words = "radius = 1\nheight = 2\npivot = [0, 0, 0]\nmass = 3\n"
    assert kr.Scene.from_toml(f"{text}\n[body.cone]\n{words}") == STARTS[text](body)


def test_a_byte_order_mark_is_ignored(tmp_path):
    text = "momentum = [0, 0, 1]\ngravity = 9.81\n" + BODY
    file = tmp_path / "notepad.toml"
    file.write_text(text, encoding="utf-8-sig")
    assert kr.Scene.from_toml(file) == kr.Scene.from_toml("\ufeff" + text)


def test_a_scene_of_more_than_a_megabyte_is_refused(tmp_path):
    text, file = kr.scenes.thesis.to_toml(), tmp_path / "scene.toml"
    for excess in (0, 1):
        file.write_text(text + "#" + " " * ((1 << 20) - len(text) - 2 + excess) + "\n")
        for load in (kr.Scene.from_toml, kr.load):
            if excess:
                with pytest.raises(ValueError, match=r"bytes|smaller"):
                    load(file)
            else:
                assert load(file) == kr.scenes.thesis


START = "momentum = [0, 0, 1]\n"
REFUSALS = [  # (text, exception, words of the message)
    ("momentun = [0, 0, 1]\n" + BODY, ValueError, "did you mean 'momentum'"),
    (START + BODY.replace("mass", "mas"), ValueError, "did you mean 'mass'"),
    (START + "[body]\ncubiod = {}\n", ValueError, "did you mean 'cuboid'"),
    (START + "[body]\ncuboid = { half = [1, 1, 1] }\n", ValueError, "no pivot"),
    (START + "[body]\ncuboid = 3\n", TypeError, "cuboid must be a table"),
    (START + BODY + "cuboid = {}\n", ValueError, "one way"),
    ("momentum = [0, 0, 1]", FileNotFoundError, "momentum"),  # a single line is a file name
    (START + "gravity = 1\n", ValueError, r"table \[body\] is missing"),
    ("body = 1\n" + START, TypeError, "body must be a table"),
    ("momentum = [0, '0', 1]\n" + BODY, TypeError, "momentum must be 3 numbers"),
    (BODY, ValueError, "exactly one of momentum"),
    ("momentum = [0, nan, 1]\n" + BODY, ValueError, "momentum must be finite"),
    ("momentum = [0, 0, 1\n" + BODY, ValueError, "Unclosed array|line"),
    (BODY + START, ValueError, r"momentum belongs above \[body\]"),
    (BODY + "gravity = 9.81\n", ValueError, r"gravity belongs above \[body\]"),
    ("[body.cone]\nradius = 1\nvelocity = [0, 0, 1]\n", ValueError, "velocity belongs above"),
    ("[body]\nmass = 1\n[body.spinning]\nspin = 1\n", ValueError, "spinning belongs above"),
    ("mass = 1\n" + START + BODY, ValueError, r"mass belongs below \[body\]"),
    ("cone = { radius = 1 }\n" + BODY, ValueError, r"cone belongs below \[body\]"),
    ("degrees = true\nspinning = { spin = 1 }\n" + BODY, ValueError, r"in \[spinning\]"),
    ("gravity = 2\nspinning = { spin = 1, gravity = 2 }\n" + BODY, ValueError, "twice"),
    (START + "spinning = { spin = 1 }\n" + BODY, ValueError, "momentum, spinning"),
    (
        "from_euler = { angles = [0, 0, 0] }\nspinning = { spin = 1 }\n" + BODY,
        ValueError,
        "from_euler, spinning",
    ),
    ("spinning = { spn = 1 }\n" + BODY, ValueError, "did you mean 'spin'"),
    ("spinning = { tilt = 1 }\n" + BODY, ValueError, r"\[spinning\] has no spin"),
    ("spinning = 3\n" + BODY, TypeError, "spinning must be a table"),
    (START + "[body]\nmass = 1\ncom = [0, 0, 0]\n", ValueError, "exactly one of"),
    (START + "[body]\nmass = 1\ninertia = [1, 1, 1]\n", TypeError, "com"),
]


@pytest.mark.parametrize(("text", "exception", "word"), REFUSALS)
def test_bad_texts_are_refused(text, exception, word, tmp_path):
    with pytest.raises(exception, match=word):
        kr.Scene.from_toml(text)
    (tmp_path / "top.toml").write_text(text)
    if exception is not FileNotFoundError:
        with pytest.raises(exception, match=f"top.toml: .*({word})"):
            kr.Scene.from_toml(tmp_path / "top.toml")


def test_the_site_and_the_help_list_every_key_of_scene_files():
    """Compare the table of docs/scene_files.md, and the help of kreisel solve, with signatures."""
    makers = {"the file": kr.Scene, "[spinning]": kr.Scene.spinning, "[body]": kr.Body}
    makers["[from_euler]"] = kr.Scene.from_euler
    shapes = "cone cuboid cylinder disk ellipsoid from_com rod sphere symmetric tube"
    makers |= {f"[body.{name}]": getattr(kr.Body, name) for name in shapes.split()}
    expected = {
        table: [key for key in inspect.signature(make).parameters if key != "body"]
        for table, make in makers.items()
    }
    rows = re.findall(r"^\| `?(the file|\[.+\])`? \| (.+) \|$", PAGE.read_text(), re.MULTILINE)
    assert {table: re.findall(r"`(\w+)`", keys) for table, keys in rows} == expected
    shown = call("solve --help").partition("Keys of SCENE files")[2]
    assert all(re.search(rf"\b{key}\b", shown) for keys in expected.values() for key in keys)
    assert all(table in shown for table in expected)


def test_the_scene_files_of_the_site_describe_one_top():
    texts = re.findall(r"```toml\n(.+?)```", PAGE.read_text(), re.DOTALL)
    one, other = map(kr.Scene.from_toml, texts)
    assert one.body.moments == pytest.approx(other.body.moments, rel=1e-12)
    assert (one.gravity, one.body.com) == (other.gravity, other.body.com)
    assert one.momentum == pytest.approx(other.momentum, rel=1e-12)
    assert one.attitude == pytest.approx(other.attitude, rel=1e-12)
