"""Tests of the report's comparison of fits."""

import numpy as np

from validation.competitors.curve_fitters import FITTERS, compute_velocities, read_parameters
from validation.parts import fits

SOME = fits.TIMES[:20]


def test_the_other_programs_integrate_the_same_motion():
    scene = fits.make_scene(1.0)
    velocities = compute_velocities(SOME, scene.body.mass * scene.gravity, read_parameters(scene))
    noise = fits.make_record(SOME) - velocities
    assert 0.8 * fits.NOISE < noise.std() < 1.2 * fits.NOISE


def test_all_programs_find_the_ratio_of_the_moments():
    rows = [fits.measure_fit(name, fits.TIMES[: fits.SHORT], 1) for name in FITTERS]
    ratios = np.array([row["ratio"] for row in rows])
    assert np.abs(ratios / ratios[0] - 1.0).max() < 0.02
    assert rows[0]["error"] is None and "the scale of the moments" in rows[0]["messages"][0]
    context = fits.build_context(rows)
    assert context["numbers"] == 3 * fits.SHORT, "the numbers of the record, not of a longer one"
    assert context["truth"] == 1.0 and "times as fast" in fits.conclude(rows)
    assert fits.conclude(rows[:1]) == ""
