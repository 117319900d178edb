"""Ways that are taken seldom: devices, folders that cannot be put on the disk, machines that do not
tell their memory, separatrices under gravity, times of no list."""

import math
import os

import kreisel as kr
import numpy as np
import pytest
from kreisel._drawing.solids import turned
from kreisel._sweeping.planned import canonical
from kreisel._verbs import run, tangents

TOP, SYMMETRIC = kr.scenes.asymmetric, kr.scenes.thesis


def test_a_device_is_written_as_it_is():
    TOP.to_toml(os.devnull)
    assert not os.path.isfile(os.devnull)


@pytest.mark.parametrize("call", ["open", "fsync"])
def test_where_a_folder_cannot_be_put_on_the_disk_its_file_is(tmp_path, monkeypatch, call):
    real, folders = getattr(os, call), []

    def no_folder(what, *words, **more):
        is_folder = what == tmp_path if call == "open" else os.path.isdir(f"/proc/self/fd/{what}")
        if is_folder:
            folders.append(what)
            raise OSError(22, "Invalid argument")
        return real(what, *words, **more)

    with monkeypatch.context() as broken:
        broken.setattr(os, call, no_folder)
        TOP.to_toml(tmp_path / "top.toml")
    assert folders and kr.Scene.from_toml(tmp_path / "top.toml") == TOP


def test_a_machine_that_does_not_tell_its_memory_has_enough(monkeypatch):
    def untold(_):
        raise ValueError("unrecognized configuration name")

    with monkeypatch.context() as broken:
        broken.setattr(os, "sysconf", untold)
        assert len(kr.solve(TOP, 1.0, "rk4", step=0.01, every=10)) == 11


def test_an_iterator_of_lists_is_no_iterator_of_times():
    with pytest.raises(ValueError, match="an iterator of times, not of"):
        list(kr.stream(TOP, iter([[1.0, 2.0], [3.0, 4.0]])))


def test_a_step_that_a_method_refuses_is_a_row_of_the_table():
    (row,) = kr.compare(SYMMETRIC, 1.0, ["bobenko_suris4"], steps=[5.0], repeats=1)
    assert "too large" in row.failure and np.isnan(row.attitude_error) and row.steps == 0


def test_a_separatrix_under_gravity_has_its_own_direction():
    for gravity, direction in ((1.0, -1), (-1.0, 1)):
        scene = TOP.replace(gravity=gravity)
        assert kr.events.separatrix(scene).direction == direction
        with pytest.raises(TypeError, match="leave direction out"):
            kr.events.separatrix(scene, direction=1)


def test_closed_forms_of_many_refuse_times_that_no_double_tells():
    many = kr.exact([SYMMETRIC, SYMMETRIC])
    with pytest.raises(ValueError):
        many(1e300)


def test_closed_forms_refuse_what_they_have_none_for():
    with pytest.raises(ValueError, match="no closed form is known"):
        kr.exact(TOP)
    with pytest.raises(ValueError, match=r"scene\[1\]"):
        kr.exact([SYMMETRIC, TOP])
    steps = kr.exact(SYMMETRIC, map="bobenko_suris", step=0.01)
    with pytest.raises(ValueError, match="not an array of shape"):
        steps([[1, 2], [3, 4]])
    with pytest.raises(ValueError):
        kr.exact(SYMMETRIC, map="bobenko_suris", step=1e200)


def test_rods_tell_what_they_are():
    rod = kr.rod(kr.solve(SYMMETRIC, np.linspace(0, 1, 20)))
    assert repr(rod).startswith("<kreisel.Rod: isotropic, 20 frames")
    general = kr.rod(kr.solve(kr.scenes.kowalewski, np.linspace(0, 1, 20)))
    assert "anisotropic" in repr(general)


def test_a_truth_at_other_times_is_refused():
    with pytest.raises(ValueError, match="a path at the times that are compared"):
        kr.compare(TOP, [1.0], ["strang"], steps=[0.1], truth=kr.solve(TOP, [2.0]), repeats=1)


@pytest.mark.parametrize("words", [{"tangents": "start"}, {"events": [kr.events.nutation()]}])
def test_a_top_that_the_core_refuses_has_taken_no_step(words, monkeypatch):
    for verb in run, tangents:
        monkeypatch.setattr(verb, "start_top", lambda *_: ("ERR_NOT_FINITE", None))
    with pytest.raises(kr.Error) as told:
        kr.solve(TOP, [1.0], **words)
    assert tuple(told.value.path.stats) == (0, 0, 0, 0) and len(told.value.path) == 1


def test_a_body_of_revolution_without_a_tip_is_drawn_as_its_cylinder():
    faces, _ = turned(2.0, 0.3, 0.5, False)
    points = faces.reshape(-1, 3)
    assert points.min(axis=0) == pytest.approx([-2.0, -2.0, 0.2])
    assert points.max(axis=0) == pytest.approx([2.0, 2.0, 0.8])
    assert {round(float(z), 12) for z in points[:, 2]} == {0.2, 0.8}


def test_a_plan_tells_no_number_that_json_lacks():
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical({"step": math.nan})


def test_tubes_may_have_no_hole_or_no_wall():
    many = kr.Bodies.tube([0.0, 1.0, 0.5], 1.0, 1.0, (0.0, 0.0, 0.0), mass=1.0)
    one = [kr.Body.tube(hole, 1.0, 1.0, (0.0, 0.0, 0.0), mass=1.0) for hole in (0.0, 1.0, 0.5)]
    assert np.allclose(many.moments, [body.moments for body in one], rtol=1e-15)
    with pytest.raises(ValueError, match="inner"):
        kr.Bodies.tube([0.5, 1.0000001], 1.0, 1.0, (0.0, 0.0, 0.0), mass=1.0)


def test_a_tensor_of_zeros_is_symmetric_but_no_body():
    zeros = np.zeros((2, 3, 3))
    with pytest.raises(ValueError, match=r"0\.0 is not positive"):
        kr.Body(mass=1.0, inertia=zeros[0], com=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"0\.0 is not positive"):
        kr.Bodies(mass=1.0, inertia=zeros, com=(0.0, 0.0, 0.0))
