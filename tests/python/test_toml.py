"""Scenes in TOML files: the same scene is read back, and each key means what its argument means."""

import inspect
import json
import re
from functools import partial
from pathlib import Path

import kreisel as kr
import pytest
from cli_helpers import call

PAGE = Path(__file__).parents[2] / "docs/scene_files.md"
BODY = "[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 0]\n"
BODIES = [  # (name of the constructor, its arguments)
    ("", {"mass": 1, "inertia": [[2, 0, 0], [0, 2, 0], [0, 0, 1]], "com": [0, 0, 1]}),
    ("", {"mass": 1, "inertia_about_com": [2, 2, 1], "com": [0, 0, 1]}),
    ("", {"mass": 1, "inertia": [1, 2, 3.01], "com": [0, 0, 0], "inertia_rtol": 0.004}),
    ("", {"mass": 1, "inertia": [2, 2, 1], "com": [0, 0, 1], "rotor": [0, 1, 0.5]}),
    ("cuboid", {"half": [0.6, 0.8, 1], "pivot": [0.1, -0.2, -1]}),
    ("symmetric", {"mass": 1, "i1": 2, "i3": 1.5, "height": 0.5}),
    ("symmetric", {"mass": 1, "i1": 1, "i3": 0.5, "height": 1, "unphysical": True}),
    (
        "from_com",
        {"mass": 1, "inertia_about_com": [2, 2, 1.5], "com": [0, 0, 1], "pivot": [0, 0.5, 0]},
    ),
    ("cylinder", {"radius": 1, "height": 2, "pivot": [0, 0, -1], "mass": 3}),
    ("tube", {"inner": 0.5, "outer": 1, "height": 2, "pivot": [0, 0, -1], "density": 3}),
    ("disk", {"radius": 1, "pivot": [0, 0, -1], "mass": 3}),
    ("rod", {"length": 2, "pivot": [1, 0, 0], "mass": 3}),
    ("sphere", {"radius": 1, "pivot": [0, 0, -1], "mass": 3, "shell": True}),
    ("ellipsoid", {"half": [1, 2, 3], "pivot": [0, 0, -1], "mass": 3}),
    ("cone", {"radius": 1, "height": 2, "pivot": [0, 0, 0], "mass": 3}),
    ("from_profile", {"profile": [[0, 0], [1, 1], [0, 2]], "pivot": [0, 0, 0], "density": 3}),
]
STARTS = [
    ("from_euler", {"angles": [30, 60, 0], "rates": [1, 2, 3], "degrees": True}),
    ("spinning", {"spin": 60, "tilt": 1, "steady": True}),
    ("from_integrals", {"energy": 60, "vertical": 2, "axial": 1.5, "lower": True, "damping": 0.1}),
    ("spinning", {"spin": 60, "damping": 0.3, "friction": 0.1}),
    ("", {"body_velocity": [0, 0.1, 2], "attitude_xyzw": [0, 0, 1, 0], "turning": [0, 0, 1]}),
]


def write_table(name, words):
    """Return the lines of a TOML table."""
    lines = [f"{word} = {json.dumps(value)}" for word, value in words.items()]
    return "\n".join([f"[{name}]", *lines, ""])


@pytest.mark.parametrize(
    ("body", "start"),
    [*((body, STARTS[-1]) for body in BODIES), *((BODIES[-1], start) for start in STARTS)],
)
def test_the_keys_of_a_table_are_the_arguments_of_a_constructor(body, start, tmp_path):
    (body_name, body_words), (start_name, start_words) = body, start
    make_body = getattr(kr.Body, body_name) if body_name else kr.Body
    make_scene = getattr(kr.Scene, start_name) if start_name else kr.Scene
    expected = make_scene(make_body(**body_words), gravity=2, **start_words)
    head = write_table(start_name, start_words)
    text = f"gravity = 2\n{head.removeprefix('[]')}" + write_table(
        ".".join(filter(None, ["body", body_name])), body_words
    )
    file = tmp_path / "eps=0.1.toml"
    file.write_text(text)
    for source in (text, file, str(file), expected.to_toml()):
        assert kr.Scene.from_toml(source) == expected


def test_a_constructor_may_have_a_rotor_beside_it():
    text = "momentum = [0, 0, 1]\ngravity = 1\n[body]\nrotor = [0, 0, 2]\n"
    disk = kr.Body.disk(1, (0, 0, -1), mass=3)
    expected = kr.Body(disk.mass, disk.inertia, disk.com, rotor=(0, 0, 2))
    text += "disk = { radius = 1, pivot = [0, 0, -1], mass = 3 }\n"
    assert kr.Scene.from_toml(text).body == expected


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
    (START + BODY + "cuboid = {}\n", ValueError, "one way"),
    ("momentum = [0, 0, 1]", FileNotFoundError, "momentum"),  # a single line is a file name
    (START + "gravity = 1\n", ValueError, r"table \[body\] is missing"),
    ("body = 1\n" + START, TypeError, "body must be a table"),
    (BODY, ValueError, "exactly one of momentum"),
    ("momentum = [0, 0, 1\n" + BODY, ValueError, "Unclosed array|line"),
    (BODY + START, ValueError, r"momentum belongs above \[body\]"),
    ("[body.cone]\nradius = 1\nvelocity = [0, 0, 1]\n", ValueError, "velocity belongs above"),
    ("[body]\nmomentum = [0, 0, 1]\ncone = {}\n", ValueError, "momentum belongs above"),
    ("mass = 1\n" + START + BODY, ValueError, r"mass belongs below \[body\]"),
    ("degrees = true\nspinning = { spin = 1 }\n" + BODY, ValueError, r"in \[spinning\]"),
    ("gravity = 2\nspinning = { spin = 1, gravity = 2 }\n" + BODY, ValueError, "twice"),
    (START + "spinning = { spin = 1 }\n" + BODY, ValueError, "momentum, spinning"),
    ("spinning = { spn = 1 }\n" + BODY, ValueError, "did you mean 'spin'"),
    ("spinning = { tilt = 1 }\n" + BODY, TypeError, "spin is missing"),
    ("spinning = 3\n" + BODY, TypeError, "spinning must be a table"),
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
    makers["[from_integrals]"] = kr.Scene.from_integrals
    shapes = "cone cuboid cylinder disk ellipsoid from_com from_mesh from_model "
    shapes += "from_profile rod sphere symmetric tube"
    makers["[body.wheel]"] = partial(kr.Body.with_wheel, None)
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
