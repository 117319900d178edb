"""repr, dir and help of the public objects."""

import pydoc
import re

import kreisel as kr
import pytest
from internals import RECORDABLE

TOP = kr.scenes.asymmetric


def public(value):
    return {name for name in dir(value) if not name.startswith("_")}


@pytest.mark.parametrize(
    "words",
    [
        {}, {"want": ("energy",)}, {"want": ("q",)}, {"want": ("q", "q_low", "kinetic", "energy")},
        {"want": ("precession_angle", "nutation", "spin_angle")}, {"want": ("q",), "digits": 20},
        {"want": ("q", "q_low"), "digits": 20}, {"want": ("apex", "kinetic", "energy")},
        {"want": ("frame",), "method": "geometric", "error": 1e-6},
    ],
)  # fmt: skip
def test_dir_lists_the_quantities_of_a_path(words):
    path = kr.solve(TOP, [1.0, 2.0], **words)
    use = {
        "euler": lambda: path.euler(),
        "scene_at": lambda: path.scene_at(0),
        "specific_force": lambda: path.specific_force((1, 0, 0)),
        "modified_energy": lambda: path.modified_energy(0.1),
        "modified_energy4": lambda: path.modified_energy4(0.1),
        "plot": lambda: (path.apex, path.nutation, path.precession_angle),
        "animate": lambda: (path.q, path.apex),
    }
    names = public(kr.solve(TOP, [1.0])) | {"states"}
    for name in names:
        try:
            use.get(name, lambda name=name: getattr(path, name))()
        except AttributeError:
            assert name not in dir(path)
        else:
            assert name in dir(path) or name.endswith("_low")
    if "want" not in words:
        assert public(path) >= {"states", "end", "rotation", "euler", "plot", *RECORDABLE}


def test_the_repr_of_a_trace_is_one_line():
    text = repr(kr.apex(kr.solve(kr.scenes.thesis, [0.0, 1.0, 100.0])))
    assert text.startswith("<kreisel.Apex: 3 points, t = 0 .. 100; heights 0.")
    assert text.endswith("kind 'lagrange'>")
    assert "no points" in repr(kr.apex(kr.solve(kr.scenes.thesis, [])))


def test_the_repr_of_methods_is_a_table():
    lines = repr(kr.methods).splitlines()
    assert [line.split()[0] for line in lines] == list(kr.methods)
    assert "strang             2  kick, free drift, kick" in repr(kr.methods)
    assert repr(type(kr.methods)()) == ""


def test_dir_of_the_scenes_lists_scenes():
    assert set(dir(kr.scenes)) == {*kr.scenes.about, "about", "get_scene", "name_of"}
    assert all(isinstance(getattr(kr.scenes, name), kr.Scene) for name in kr.scenes.about)


def test_dir_lists_the_public_names_of_a_run():
    names = {"checkpoint", "ended", "plan", "save", "start_time", "stream", "to"}
    names |= {"change", "push", "reset"}
    assert {name for name in dir(kr.Run) if not name.startswith("_")} == names


def test_dir_of_events_lists_its_constructors():
    assert dir(kr.events) == sorted(kr.events.__all__)
    assert dir(kr.quaternion) == sorted(kr.quaternion.__all__)


def test_the_repr_of_closed_forms_is_one_line():
    assert repr(kr.exact([kr.scenes.thesis] * 3)) == "<kreisel.ExactEnsemble: 3 scenes>"


def test_help_describes_the_numbers_of_a_closed_form():
    text = pydoc.plain(pydoc.render_doc(kr.Exact)).split("Method resolution order")[0]
    for name in ("period", "precession_rate", "spin_angle_rate"):
        assert re.search(rf"^ \|  {name} +the ", text, re.MULTILINE)


def test_the_repr_of_an_indicator_is_one_line():
    one = kr.megno(kr.scenes.asymmetric, 5.0)
    assert repr(one).endswith(f": {one.value:.6g} at t = 5; regular, in doubt: under 100 turns>")
    three = kr.megno(kr.scenes.asymmetric.scatter(3, seed=1, momentum=0.1), [2.0, 5.0])
    assert repr(three).endswith(": 3 tops at t = 5; 0 chaotic, 3 in doubt, 0 failed>")
