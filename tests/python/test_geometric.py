"""method="geometric" meets the error asked for, says what it chose, refuses what cannot be met."""

import kreisel as kr
import numpy as np
import pytest

LAGRANGE, KOWALEWSKI, ASYMMETRIC = kr.scenes.thesis, kr.scenes.kowalewski, kr.scenes.asymmetric


@pytest.mark.parametrize("target", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    "scene", [LAGRANGE, KOWALEWSKI, ASYMMETRIC], ids=["lagrange", "kowalewski", "asymmetric"]
)
def test_the_error_is_met(scene, target):
    times = np.linspace(0, 20, 41)
    path = kr.solve(scene, times, method="geometric", error=target)
    truth = kr.solve(scene, times, method="kahan_li8", step=0.005)
    true = kr.attitude_error(path.q, truth.q).max()
    assert true <= 2 * target and path.error <= target and true <= 3 * path.error + 1e-11
    assert (
        np.array_equal(path.t, times)
        and path.plan.method == path.method
        and path.plan.step == path.step
    )


def test_it_says_what_was_chosen_and_what_it_cost():
    path = kr.solve(LAGRANGE, 100, method="geometric", error=1e-7)
    plan = path.plan.choice
    assert path.stats.evaluations == plan.run + plan.trials and plan.trials > 0 and len(path) == 2
    assert (
        plan.method in str(path.plan)
        and "1e-07 allowed" in str(path.plan)
        and "in trial runs" in str(path.plan)
    )
    assert 1e-16 < plan.conditioning < 1e-12
    assert kr.solve(LAGRANGE, 1, method="strang", step=0.1).plan.choice is None
    assert 1e-6 < kr.solve(LAGRANGE, 1, method="strang", step=0.1).error < 1e-2


def test_no_more_is_done_than_it_takes():
    free = LAGRANGE.replace(gravity=0.0)  # its drift has no error
    assert kr.solve(free, 100, method="geometric", error=1e-9).plan.choice.run <= 30
    still = free.replace(momentum=(0, 0, 0))
    assert kr.solve(still, 5, method="geometric", error=1e-9).q[-1].tolist() == list(still.attitude)


def test_any_times_can_be_asked_for():
    back = kr.solve(LAGRANGE, [-1, -2.5, -7], method="geometric", error=1e-6)
    truth = kr.solve(LAGRANGE, [-1, -2.5, -7], method="extrap", tol=1e-12)
    assert back.t.tolist() == [-1, -2.5, -7] and kr.attitude_error(back.q, truth.q).max() < 2e-6
    again = kr.solve(LAGRANGE, [0, 0, 1, 1], method="geometric", error=1e-6)
    assert again.t.tolist() == [0, 0, 1, 1] and np.array_equal(again.q[2], again.q[3])
    assert len(kr.solve(LAGRANGE, [], method="geometric", error=1e-6)) == 0
    assert tuple(kr.solve(LAGRANGE, 0, method="geometric", error=1e-6).m[-1]) == LAGRANGE.momentum


def test_what_the_data_do_not_hold_is_refused():
    with pytest.raises(
        ValueError, match=r"cannot be met at t = 100.*moves the attitude by about \d"
    ):
        kr.solve(ASYMMETRIC, 100, method="geometric", error=1e-10)


@pytest.mark.parametrize(
    "words, message",
    [
        ({}, "give the error"),
        ({"error": 1e-6, "step": 0.1}, "leave step out"),
        ({"error": 1e-6, "tol": 1e-3, "every": 2}, "leave tol and every out"),
        ({"error": 0.5}, "at most 0.1"),
        ({"error": -1e-6}, "positive"),
        ({"error": 1e-6, "method": "strang", "step": 0.1}, "error is for method='geometric'"),
    ],
)
def test_words_that_do_not_suit_are_refused(words, message):
    with pytest.raises(ValueError, match=message):
        kr.solve(LAGRANGE, 10, **{"method": "geometric", **words})


def test_published_figures_are_met(capsys):
    pytest.importorskip("heyoka")
    from validation.bench import geometric

    assert geometric.main(["accuracy", "integrals", "gni", "simo_wong"]) == 0
    said = capsys.readouterr().out
    assert said.count("PASS") == 23 and "MISSED" not in said
