"""Tests of the study that counts misclassified motions."""

import numpy as np

from validation.studies import chaos_classification


def test_the_study_compares_short_motions_with_a_long_one(monkeypatch, capsys):
    monkeypatch.setattr(chaos_classification, "TURNS", (5, 20, 300))
    curves = chaos_classification.compute_curves(1)
    assert curves.shape == (200, 3) and np.isfinite(curves).all()
    chaos_classification.main(["--families", "1"])
    first, *rows = capsys.readouterr().out.splitlines()
    assert first == f"200 tops, {(curves[:, 2] > 4).sum()} of them chaotic"
    sure = curves[:, 0] <= 2.5
    wrong = (sure & (curves[:, 2] > 4)).sum()
    assert len(rows) == 2 and rows[0].startswith("5 turns: ")
    assert rows[0].endswith(f"of {sure.sum()} called regular {wrong} are chaotic")


def test_all_families_have_1600_tops():
    assert sum(tops.size for tops in chaos_classification.draw_families()) == 1600
