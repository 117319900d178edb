"""Tests of the report's part on chaos, and of the theoretical predictions that it shows."""

import csv
import io

import kreisel as kr
import numpy as np
import pytest

from validation.drawing import section_plots as drawing
from validation.parts import chaos as part
from validation.parts import frequency_data, lyapunov_exponents, section_data
from validation.references import kowalewski, melnikov

SIZE = {"orbits": 12, "crossings": 20, "turning": 6, "swings": 60, "side": 6}


def test_the_ten_regions_differ():
    """Check that only two of the ten regions have the same sequence of kinds of critical values."""
    kinds = [
        tuple(kind for _, kind in kowalewski.critical_values(g, h)) for g, h in kowalewski.REGIONS
    ]
    assert len(set(kinds)) == 9 and kinds[3] == kinds[6]
    assert kowalewski.REGIONS[3][0] < 1.0 < kowalewski.REGIONS[6][0]


def test_critical_values_change_their_order_at_the_borders():
    for g, h in kowalewski.region_borders(1.3):
        changes = 0
        is_inside = (g > 0.05) & np.isfinite(h) & (h < 4.0)
        for g_value, high in zip(g[is_inside][::20], h[is_inside][::20], strict=True):
            below, above = (
                [kind for _, kind in kowalewski.critical_values(g_value, high + step)]
                for step in (-1e-4, 1e-4)
            )
            changes += below != above
        assert changes > 0.9 * len(g[is_inside][::20])


@pytest.mark.parametrize("region", range(10))
def test_the_least_and_greatest_k_are_critical(region):
    g, h = kowalewski.REGIONS[region]
    words = {"energy": h, "vertical": kowalewski.vertical_momentum(g), "gravity": 1}
    tops = kr.starts(kowalewski.BODY, n=20000, **words)
    K = kr.solve(tops, [0.0], want=["kowalewski"]).kowalewski[:, 0]
    values = [value for value, _ in kowalewski.critical_values(g, h)]
    assert values[0] <= K.min() < values[0] + 0.01 * values[-1]
    assert 0.98 * values[-1] < K.max() <= values[-1]


def test_swings_change_the_momentum_as_melnikov_predicts():
    assert melnikov.lowest_scene().body.kind == "lagrange"
    assert kr.exact(melnikov.lowest_scene()).period > 30.0 / melnikov.ESCAPE
    for row in part.measure_layer(60):
        assert row["kick"] == pytest.approx(
            melnikov.melnikov_amplitude(), rel=2.0 * row["e"] + 2e-5
        )
        assert 0.2 < row["half_width"] / row["predicted"] < 4.0


def test_the_melnikov_integral_has_converged(monkeypatch):
    coarse = melnikov.melnikov_amplitude()
    melnikov.melnikov_amplitude.cache_clear()
    monkeypatch.setattr(melnikov, "POINTS", 12001)
    assert melnikov.melnikov_amplitude() == pytest.approx(coarse, rel=1e-9)
    melnikov.melnikov_amplitude.cache_clear()


def test_a_kowalewski_section_covers_all_values_of_k():
    section = section_data.compute_kowalewski_section(4, 30, 5)
    K = section.kowalewski.reshape(30, 5)
    assert np.ptp(K, axis=1).max() < 1e-11 * K.max()
    assert np.diff(K[:, 0] ** 0.25).max() < 0.15 * K.max() ** 0.25


def test_frequencies_identify_regular_motions():
    """Check that most motions of a nearly symmetric top are regular.

    The accuracy of kr.frequencies is checked for random Lagrange tops.
    """
    axial, turns, change = frequency_data.measure_rotation(16, "moments 2 % apart")
    assert (np.abs(turns) <= 0.5).all() and np.median(change) < 1e-6 and len(axial) == 16
    assert frequency_data.largest_frequency_error(4) < 1e-12


def test_exponents_separate_order_from_chaos():
    regular, chaotic = (
        lyapunov_exponents.summarize_exponents(name, 12) for name in ("a Lagrange top", "40 %")
    )
    assert regular["chaotic"] == 0 and regular["exponent"] is None is regular["error"]
    assert chaotic["chaotic"] > 6 and 0.1 < chaotic["exponent"] < 0.25
    assert 0.0 < chaotic["error"] < 0.05 and chaotic["certificate"] < 1e-12


def test_the_map_is_empty_where_no_motion_exists():
    values = lyapunov_exponents.map_exponents(5)
    energies = np.linspace(*lyapunov_exponents.ENERGIES, 5)
    verticals = np.linspace(*lyapunov_exponents.VERTICALS, 5)
    body = section_data.make_body(lyapunov_exponents.MAPPED)
    for (row, column), value in np.ndenumerate(values):
        words = {"energy": energies[row], "vertical": verticals[column], "n": 1}
        if np.isnan(value):
            with pytest.raises(ValueError, match="no start has"):
                kr.starts(body, gravity=1, **words)
        else:
            assert len(kr.starts(body, gravity=1, **words)) == 1 and value < 0.5
    assert 0 < np.isnan(values).sum() < 20


@pytest.fixture(scope="module")
def findings():
    return {
        "order": part.measure_energy_drift(SIZE),
        "kowalewski": list(part.measure_kowalewski(SIZE)),
        "layer": list(part.measure_layer(SIZE["swings"])),
        "frequencies": part.measure_frequencies(SIZE["turning"]),
        "exponents": part.measure_exponents(SIZE),
    }


def test_the_part_shows_its_figures_and_tables(findings):
    context = part.build_context(findings)
    pictures = [
        context["order"],
        context["regions"],
        context["plane"],
        context["map"],
        *context["layer"],
        context["rotation"],
    ]
    assert all(svg.startswith("<svg") and drawing.INK not in svg for svg in pictures)
    assert findings["order"]["energy"] < 1e-11 and findings["frequencies"]["off"] < 1e-12
    files = dict(part.list_files(findings, None))
    assert [row["region"] for row in csv.DictReader(io.StringIO(files["kowalewski.csv"]))][
        -1
    ] == "10"
    assert len(list(csv.DictReader(io.StringIO(files["layer.csv"])))) == len(part.SMALL)


def test_missing_findings_are_omitted(findings):
    few = {"order": findings["order"]}
    context = part.build_context(few)
    assert context["regions"] is None and context["layer"] is None and context["rotation"] is None
    assert part.list_files(few, None) == [] and "Melnikov" not in part.conclude(few)
