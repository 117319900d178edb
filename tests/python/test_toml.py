"""Tests of scenes in TOML files."""

import inspect
import re
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from click.testing import CliRunner
from kreisel._cli import main
from tops import CORNER, TILT

THESIS = kr.scenes.thesis

GOOD = "[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 0]\n"


@pytest.mark.parametrize("scale", [1e-40, 1, 1e40])
def test_toml_preserves_every_bit(scale, tmp_path):
    body = kr.Body.cuboid(
        half=np.array((0.6, 0.8, 1)) * scale, pivot=np.array((0.1, -0.2, -1)) * scale
    )
    scene = kr.Scene(
        body,
        velocity=np.array((0.172, -1.862, 1e-5)) / 3,
        attitude=TILT,
        gravity=-0.1 * scale,
    )
    text = scene.to_toml(tmp_path / "top.toml")
    again = kr.Scene.from_toml(tmp_path / "top.toml")
    assert again == scene and again.to_toml() == text == (tmp_path / "top.toml").read_text()
    assert again._block == scene._block


@pytest.mark.parametrize(
    "body, expected",
    [
        ("cuboid = { half = [0.6, 0.8, 1], pivot = [0.1, -0.2, -1] }", CORNER),
        (
            "symmetric = { mass = 1, i1 = 2, i3 = 1.5, height = 0.5 }",
            kr.Body.symmetric(1, 2, 1.5, 0.5),
        ),
        (
            "from_com = { mass = 1, inertia_about_com = [2, 2, 1.5], com = [0, 0, 1], "
            "pivot = [0, 0.5, 0] }",
            kr.Body.from_com(1, (2, 2, 1.5), (0, 0, 1), (0, 0.5, 0)),
        ),
        (
            "mass = 1\ninertia = [[2, 0, 0], [0, 2, 0], [0, 0, 1]]\ncom = [0, 0, 1]",
            kr.Body(1, (2, 2, 1), (0, 0, 1)),
        ),
    ],
)
def test_toml_accepts_the_arguments_of_the_constructors(body, expected, tmp_path):
    file = tmp_path / "top.toml"
    start = "body_velocity = [0, 0.1, 2]\nattitude_xyzw = [0, 0, 1, 0]\ngravity = 1\n"
    file.write_text(f"{start}[body]\n{body}\n")
    assert kr.Scene.from_toml(file) == kr.Scene(
        expected, body_velocity=(0, 0.1, 2), attitude_xyzw=(0, 0, 1, 0), gravity=1
    )


@pytest.mark.parametrize(
    "text, exception, message",
    [
        (
            "momentun = [0, 0, 1]\n" + GOOD,
            ValueError,
            "unknown key in a scene: 'momentun'; did you mean 'momentum'?",
        ),
        (
            "momentum = [0, 0, 1]\n" + GOOD.replace("mass", "mas"),
            ValueError,
            "'mas'; did you mean 'mass'?",
        ),
        ("momentum = [0, 0, 1]\n[body]\ncubiod = {}\n", ValueError, "did you mean 'cuboid'?"),
        (
            "momentum = [0, 0, 1]\n[body]\ncuboid = { half = [1, 1, 1] }\n",
            ValueError,
            "cuboid has no pivot",
        ),
        ("momentum = [0, 0, 1]\n[body]\ncuboid = 3\n", TypeError, "cuboid must be a table"),
        ("momentum = [0, 0, 1]\n" + GOOD + "cuboid = {}\n", ValueError, "described in one way"),
        ("momentum = [0, 0, 1]\n", ValueError, r"table \[body\] is missing"),
        ("body = 1\nmomentum = [0, 0, 1]\n", TypeError, "body must be a table"),
        ("momentum = [0, '0', 1]\n" + GOOD, TypeError, "momentum must be 3 numbers"),
        (GOOD, ValueError, "exactly one of momentum"),
        ("momentum = [0, nan, 1]\n" + GOOD, ValueError, "momentum must be finite"),
        ("momentum = [0, 0, 1\n", ValueError, "Unclosed array"),
    ],
)
def test_invalid_toml_is_refused(text, exception, message, tmp_path):
    file = tmp_path / "top.toml"
    file.write_text(text)
    with pytest.raises(exception, match=f"top.toml: .*{message}"):
        kr.Scene.from_toml(file)


def scene_of(body, **start):
    return kr.Scene(body, **{"momentum": (0, 0, 1), "gravity": 9.81, **start})


@pytest.mark.parametrize(
    "body, expected",
    [
        (
            "cylinder = { radius = 1, height = 2, pivot = [0, 0, -1], mass = 3 }",
            kr.Body.cylinder(1, 2, (0, 0, -1), mass=3),
        ),
        (
            "tube = { inner = 0.5, outer = 1, height = 2, pivot = [0, 0, -1], density = 3 }",
            kr.Body.tube(0.5, 1, 2, (0, 0, -1), density=3),
        ),
        (
            "disk = { radius = 1, pivot = [0, 0, -1], mass = 3 }",
            kr.Body.disk(1, (0, 0, -1), mass=3),
        ),
        ("rod = { length = 2, pivot = [1, 0, 0], mass = 3 }", kr.Body.rod(2, (1, 0, 0), mass=3)),
        (
            "sphere = { radius = 1, pivot = [0, 0, -1], mass = 3, shell = true }",
            kr.Body.sphere(1, (0, 0, -1), mass=3, shell=True),
        ),
        (
            "ellipsoid = { half = [1, 2, 3], pivot = [0, 0, -1], mass = 3 }",
            kr.Body.ellipsoid((1, 2, 3), (0, 0, -1), mass=3),
        ),
        (
            "cone = { radius = 1, height = 2, pivot = [0, 0, 0], mass = 3 }",
            kr.Body.cone(1, 2, (0, 0, 0), mass=3),
        ),
        (
            "mass = 1\ninertia_about_com = [2, 2, 1]\ncom = [0, 0, 1]",
            kr.Body(1, inertia_about_com=(2, 2, 1), com=(0, 0, 1)),
        ),
        (
            "symmetric = { mass = 1, i1 = 1, i3 = 0.5, height = 1, unphysical = true }",
            kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True),
        ),
        (
            "mass = 1\ninertia = [1, 2, 3.01]\ncom = [0, 0, 0]\ninertia_rtol = 0.004",
            kr.Body(1, (1, 2, 3.01), (0, 0, 0), inertia_rtol=0.004),
        ),
    ],
)
def test_a_scene_is_read_from_text_as_from_a_file(body, expected, tmp_path):
    text = f"momentum = [0, 0, 1]\ngravity = 9.81\n[body]\n{body}\n"
    assert kr.Scene.from_toml(text) == scene_of(expected)
    assert kr.Scene.from_toml(kr.Scene.from_toml(text).to_toml()) == scene_of(expected)
    file = tmp_path / "eps=0.1.toml"
    file.write_text(text)
    assert kr.Scene.from_toml(file) == kr.Scene.from_toml(str(file)) == scene_of(expected)


@pytest.mark.parametrize(
    "start, expected",
    [
        (
            "[from_euler]\nangles = [30, 60, 0]\nrates = [1, 2, 3]\ndegrees = true\ngravity = 9.81",
            lambda body: kr.Scene.from_euler(
                body, (30, 60, 0), (1, 2, 3), degrees=True, gravity=9.81
            ),
        ),
        (
            "[spinning]\nspin = 60\ntilt = 1\nsteady = true\ngravity = 1",
            lambda body: kr.Scene.spinning(body, 60, 1, steady=True, gravity=1),
        ),
        (
            "gravity = 2\nfriction = 0.1\n[spinning]\nspin = 60\ndamping = 0.3",
            lambda body: kr.Scene.spinning(body, 60, gravity=2, damping=0.3, friction=0.1),
        ),
    ],
)
def test_starts_have_a_table(start, expected):
    body = kr.Body.cone(1, 2, (0, 0, 0), mass=3)
    words = "radius = 1\nheight = 2\npivot = [0, 0, 0]\nmass = 3\n"
    assert kr.Scene.from_toml(f"{start}\n[body.cone]\n{words}") == expected(body)


def test_a_byte_order_mark_is_ignored(tmp_path):
    text = "momentum = [0, 0, 1]\ngravity = 9.81\n" + GOOD
    file = tmp_path / "notepad.toml"
    file.write_text(text, encoding="utf-8-sig")
    assert (
        kr.Scene.from_toml(file)
        == kr.Scene.from_toml("\ufeff" + text)
        == scene_of(kr.Body(1, (2, 2, 1), (0, 0, 0)))
    )


@pytest.mark.parametrize(
    "text, exception, message",
    [
        (GOOD + "momentum = [0, 0, 1]\n", ValueError, r"^momentum belongs above \[body\]$"),
        (GOOD + "gravity = 9.81\n", ValueError, r"^gravity belongs above \[body\]$"),
        (
            "[body.cone]\nradius = 1\nheight = 2\nvelocity = [0, 0, 1]\n",
            ValueError,
            r"^velocity belongs above \[body\]$",
        ),
        (
            "[body]\nmomentum = [0, 0, 1]\ncone = { radius = 1 }\n",
            ValueError,
            r"^momentum belongs above \[body\]$",
        ),
        ("[body]\nmass = 1\n[body.spinning]\nspin = 1\n", ValueError, r"^spinning belongs above"),
        ("mass = 1\nmomentum = [0, 0, 1]\n" + GOOD, ValueError, r"^mass belongs below \[body\]$"),
        ("cone = { radius = 1 }\n" + GOOD, ValueError, r"^cone belongs below \[body\]$"),
        (
            "degrees = true\nspinning = { spin = 1 }\n" + GOOD,
            ValueError,
            r"^degrees belongs in \[spinning\]$",
        ),
        (
            "gravity = 2\nspinning = { spin = 1, gravity = 2 }\n" + GOOD,
            ValueError,
            "^gravity is given twice",
        ),
        (
            "momentum = [0, 0, 1]\nspinning = { spin = 1 }\n" + GOOD,
            ValueError,
            "^a scene must be described in one way, not by momentum, spinning$",
        ),
        (
            "from_euler = { angles = [0, 0, 0] }\nspinning = { spin = 1 }\n" + GOOD,
            ValueError,
            "^a scene must be described in one way, not by from_euler, spinning$",
        ),
        (
            "spinning = { spn = 1 }\n" + GOOD,
            ValueError,
            "in \\[spinning\\]: 'spn'; did you mean 'spin'",
        ),
        ("spinning = { tilt = 1 }\n" + GOOD, ValueError, r"^\[spinning\] has no spin$"),
        ("spinning = 3\n" + GOOD, TypeError, "spinning must be a table, not 3"),
        ("momentum = [0, 0, 1]\n[body]\nmass = 1\ncom = [0, 0, 0]\n", ValueError, "exactly one of"),
        (
            "momentum = [0, 0, 1]\n[body]\nmass = 1\ninertia = [1, 1, 1]\n",
            TypeError,
            "com is missing",
        ),
        ("momentum = [0, 0, 1\n", ValueError, "Unclosed array"),
    ],
)
def test_invalid_text_is_refused(text, exception, message):
    with pytest.raises(exception, match=message):
        kr.Scene.from_toml(text)


def test_a_single_line_is_a_file_name():
    with pytest.raises(FileNotFoundError):
        kr.Scene.from_toml("momentum = [0, 0, 1]")


# Boundary values


def test_the_length_of_a_scene_is_limited(tmp_path):
    text = THESIS.to_toml()
    for excess in (0, 1):
        file = tmp_path / "scene.toml"
        file.write_text(text + "#" + " " * ((1 << 20) - len(text) - 2 + excess) + "\n")
        assert file.stat().st_size == (1 << 20) + excess
        for load in (kr.Scene.from_toml, kr.load):
            if excess:
                with pytest.raises(ValueError, match=r"at most 1048576 bytes|would be smaller"):
                    load(file)
            else:
                assert load(file) == THESIS


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
    page = (Path(__file__).parents[2] / "docs/scene_files.md").read_text()
    rows = re.findall(r"^\| `?(the file|\[.+\])`? \| (.+) \|$", page, re.MULTILINE)
    assert {table: re.findall(r"`(\w+)`", keys) for table, keys in rows} == expected
    shown = CliRunner().invoke(main, ["solve", "--help"]).output.partition("Keys of SCENE files")[2]
    assert all(re.search(rf"\b{key}\b", shown) for keys in expected.values() for key in keys)
    assert all(table in shown for table in expected)


def test_the_scene_files_of_the_site_describe_one_top():
    page = (Path(__file__).parents[2] / "docs/scene_files.md").read_text()
    one, other = map(kr.Scene.from_toml, re.findall(r"```toml\n(.+?)```", page, re.DOTALL))
    assert one.body.moments == pytest.approx(other.body.moments, rel=1e-12)
    assert (one.gravity, one.body.com) == (other.gravity, other.body.com)
    assert one.momentum == pytest.approx(other.momentum, rel=1e-12)
    assert one.attitude == pytest.approx(other.attitude, rel=1e-12)
