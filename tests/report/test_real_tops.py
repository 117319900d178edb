"""Tests of the study of random tops with rotors, damping, friction and moving supports."""

import kreisel as kr

from validation.studies import real_tops


class IntegratorOfTheFirstTop(real_tops.SupportIntegrator):
    """An integrator that finds no unique past for any top but the first."""

    scenes = 0

    def __call__(self, scene, t):
        self.scenes += isinstance(scene, kr.Scene)
        return super().__call__(scene, t) if self.scenes == 1 else None


def test_every_top_with_a_reference_is_checked_in_an_ensemble(monkeypatch):
    monkeypatch.setattr(real_tops, "SupportIntegrator", IntegratorOfTheFirstTop)
    counts = real_tops.run(2, 1).counts
    assert counts["16 digits"] == counts["ensemble"] == 1


def test_full_groups_and_the_rest_are_checked_in_ensembles(monkeypatch):
    monkeypatch.setattr(real_tops, "GROUP", 2)
    tally = real_tops.run(3, 1)
    assert tally.counts["16 digits"] == tally.counts["ensemble"] == 3
    assert tally.faults == []


def test_a_run_in_which_all_tops_are_chaotic_ends_with_a_summary(monkeypatch, capsys):
    monkeypatch.setattr(real_tops, "MOST_GROWTH", 0.0)
    monkeypatch.setattr("sys.argv", ["real_tops", "--tops", "2"])
    real_tops.main()
    output = capsys.readouterr().out
    assert "chaotic" in output and "ensemble" not in output and output.endswith("\n0 faults\n")
