"""Scenes as TOML files, which keep every bit and take the words of the constructors."""

import kreisel as kr
import numpy as np
import pytest
from tops import CORNER, TILT

GOOD = "[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 1]\n"


@pytest.mark.parametrize("scale", [1e-40, 1, 1e40])
def test_toml_keeps_every_bit(scale, tmp_path):
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
def test_toml_takes_the_words_of_the_constructors(body, expected, tmp_path):
    file = tmp_path / "top.toml"
    file.write_text(f"body_velocity = [0, 0.1, 2]\nattitude_xyzw = [0, 0, 1, 0]\n[body]\n{body}\n")
    assert kr.Scene.from_toml(file) == kr.Scene(
        expected, body_velocity=(0, 0.1, 2), attitude_xyzw=(0, 0, 1, 0)
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
def test_toml_that_is_wrong_is_refused(text, exception, message, tmp_path):
    file = tmp_path / "top.toml"
    file.write_text(text)
    with pytest.raises(exception, match=f"top.toml: .*{message}"):
        kr.Scene.from_toml(file)
