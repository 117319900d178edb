"""Tests of the classification of motions as regular or chaotic."""

import copy
import pickle

import kreisel as kr
import numpy as np
import pytest
from tops import random_starts

TOP = kr.scenes.asymmetric
INDICATORS = (kr.lyapunov, kr.megno, kr.oli)
INTEGRABLE = {
    "kowalewski": kr.scenes.kowalewski.body,
    "lagrange": kr.scenes.thesis.body,
    "euler": kr.Body(mass=1.0, inertia=(1.0, 1.6, 2.1), com=(0.0, 0.0, 0.0)),
    "goryachev_chaplygin": kr.scenes.goryachev_chaplygin.body,
}


@pytest.mark.parametrize("indicate", INDICATORS)
def test_known_tops_have_the_expected_verdict(indicate):
    for name in ("thesis", "kowalewski", "goryachev_chaplygin", "asymmetric_regular", "cusps"):
        indicator = indicate(kr.scenes.get_scene(name), 3000)
        assert (
            indicator.is_chaotic is False
            and indicator.doubt == ""
            and indicator.is_doubtful is False
        ), name
    indicator = indicate(TOP, 1000)
    assert indicator.is_chaotic is True and indicator.doubt == "" and indicator.is_doubtful is False
    assert indicator.threshold == 4.0 < indicator.final_megno
    assert repr(indicator).endswith("at t = 1000; chaotic>")


@pytest.mark.parametrize("name", INTEGRABLE)
def test_no_integrable_top_is_called_chaotic(name):
    """Check that random integrable tops are not classified as chaotic, unless in doubt."""
    q, m = random_starts(24, 5)
    m[:, 2] *= name != "goryachev_chaplygin"  # integrable only without vertical momentum
    indicator = kr.megno(kr.Ensemble(INTEGRABLE[name], momentum=m, attitude=q, gravity=1), [3000.0])
    assert (
        not indicator.is_chaotic[~indicator.is_doubtful].any()
        and indicator.is_doubtful.mean() < 0.1
    )


def test_all_indicators_give_the_same_verdict():
    tops = TOP.vary(gravity=np.linspace(0.05, 1.0, 9))
    megno = kr.megno(tops, [50.0, 700.0])
    assert np.array_equal(megno.final_megno, megno.value)
    assert 0 < megno.is_chaotic.sum() < 9 and megno.is_doubtful.any()
    for indicate in INDICATORS:
        indicator = indicate(tops, [50.0, 700.0])
        assert np.array_equal(indicator.final_megno, megno.value)
        assert np.array_equal(indicator.is_chaotic, megno.is_chaotic)
        assert np.array_equal(indicator.doubt, megno.doubt)
    both = f"{megno.is_chaotic.sum()} chaotic, {megno.is_doubtful.sum()} in doubt, 0 failed>"
    assert repr(megno).endswith(f"9 tops at t = 700; {both}")


def test_an_unstable_integrable_motion_counts_as_chaotic():
    """Check that an integrable top with a positive Lyapunov exponent is classified as chaotic."""
    body = kr.Body.symmetric(1.0, 1.0, 0.5, 0.5)
    scene = kr.Scene(body, velocity=(0.0, 0.0, 0.1), gravity=1.0)
    indicator = kr.megno(scene, 1000.0)
    assert indicator.is_chaotic and indicator.doubt == ""


def test_every_doubtful_verdict_has_a_reason():
    short = kr.oli(kr.scenes.thesis, 100.0)
    assert short.doubt == "under 100 turns" and short.is_doubtful and not short.is_chaotic
    assert short.turns < 100.0 and "regular, in doubt: under 100 turns>" in repr(short)
    doubtful = kr.lyapunov(TOP, 75.0)
    assert 2.5 < doubtful.final_megno < 8.0 and doubtful.doubt == "MEGNO near the threshold"
    rough = kr.megno(TOP, 1000.0, tol=0.5)
    assert rough.certificate > 0.01 and rough.doubt == "certificate above 0.01"
    indicator = kr.megno(TOP.vary(gravity=[1.0, 1e30]), [1000.0], max_steps=20000)
    assert indicator.status[1] != "OK" and indicator.doubt.tolist() == ["", indicator.status[1]]
    assert indicator.is_chaotic.tolist() == [True, False]
    assert indicator.is_doubtful.tolist() == [False, True]


def test_chaos_is_detected_within_a_hundred_turns():
    indicator = kr.megno(TOP, 400.0)
    assert indicator.turns < 100.0 and indicator.final_megno > 8.0 and indicator.doubt == ""


def test_turns_are_counted_in_the_tops_own_time_scale():
    scene = kr.Scene(kr.Body(2.0, (3.0, 4.0, 5.0), (0, 0, 0)), momentum=(0.0, 0.0, 10.0))
    assert kr.megno(scene, [-50.0]).turns == pytest.approx(50.0 / np.pi, rel=1e-14)
    hanging = kr.Scene(kr.Body(2.0, (3.0, 4.0, 5.0), (0, 0, 0.7)), momentum=(0.1, 0, 0), gravity=9)
    rate = np.sqrt(2.0 * 9.0 * 0.7 / 5.0)
    assert kr.megno(hanging, [50.0]).turns == pytest.approx(50.0 * rate / (2 * np.pi), rel=1e-14)
    doubled = TOP.replace(gravity=4.0, momentum=2.0 * np.array(TOP.momentum))
    single = TOP.replace(gravity=1.0)
    assert kr.megno(doubled, [500.0]).turns == kr.megno(single, [1000.0]).turns


def test_tables_have_a_row_for_each_top():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    tops = TOP.vary(gravity=np.array([[0.5], [1.0]]), spin=[0.0, 1.0, 2.0])
    indicator = kr.lyapunov(tops, [100.0, 800.0])
    frame, data = indicator.to_pandas(), indicator.to_xarray()
    assert len(frame) == 6 and frame["gravity"].tolist() == [0.5] * 3 + [1.0] * 3
    assert frame.attrs["units"]["lyapunov"] == "T^-1" and frame.attrs["t"] == 800.0
    assert frame.attrs["threshold"] == data.attrs["threshold"] == 4.0
    assert data["lyapunov"].dims == ("gravity", "spin", "time")
    assert np.array_equal(data["lyapunov"], indicator.curve)
    for name in ("final_megno", "is_chaotic", "doubt", "certificate", "turns", "status"):
        values = getattr(indicator, name)
        assert np.array_equal(frame[name], values.ravel()), name
        assert data[name].dims == ("gravity", "spin") and np.array_equal(data[name], values)
    assert np.array_equal(frame["lyapunov"], indicator.value.ravel())


def test_tables_of_one_top_and_of_no_top():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    one, empty = kr.megno(TOP, 10.0), kr.megno(TOP.scatter(3, momentum=0.1)[:0], 10.0)
    assert one.to_pandas()["megno"].tolist() == [one.value]
    assert one.to_xarray()["megno"].dims == ("time",) and one.to_xarray()["is_chaotic"].dims == ()
    assert len(empty.to_pandas()) == 0 and empty.to_xarray()["megno"].shape[0] == 0
    assert empty.is_chaotic.shape == empty.doubt.shape == (0,)


@pytest.mark.parametrize("scene", [TOP, TOP.vary(gravity=[0.5, 1.0])], ids=["one", "many"])
def test_verdicts_are_read_only(scene):
    indicator = kr.megno(scene, [5.0])
    for again in (indicator, copy.deepcopy(indicator), pickle.loads(pickle.dumps(indicator))):
        arrays = [again.t, again.curve, again.final_megno, again.turns]
        arrays += [np.asarray(again.is_chaotic)] * (scene is not TOP)
        assert not any(array.flags.writeable for array in arrays)
        assert np.array_equal(again.doubt, indicator.doubt)
