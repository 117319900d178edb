"""Tests of the sentences and numbers in summaries of fits."""

import re
from types import SimpleNamespace

import kreisel as kr
import numpy as np
import pytest
from kreisel._fit import summary


def make_fit(sigmas=(0.1,), missing=(0,), **words):
    series = [SimpleNamespace(sigma=sigma) for sigma in sigmas]
    fields = {
        "records": [SimpleNamespace(series=series, size=23, missing=count) for count in missing],
        "names": ["I1", "long name", "angle"],
        "units": ["M L^2", "L", ""],
        "values": {"I1": 1.5, "long name": -2.0, "angle": 0.25},
        "error": {"I1": 0.1, "long name": 0.02, "angle": 0.0},
        "moment_ratios": {"I1 / I3": (2.0, 0.1)},
        "chi2": 40.0,
        "dof": 20,
        "residual_correlation": 0.0,
        "inflation": 1.0,
        "nonlinearity": 0.0,
        "unidentified": (),
        "ambiguous": (),
        "misfit": 0.0,
        "excess": 0.0,
        "is_plausible": None,
        "uncertain_sigma": (),
        "at_bound": (),
        "has_converged": True,
        "evaluations": 7,
        "piece_starts": (),
    }
    return SimpleNamespace(**fields | words)


def list_sentences(**words):
    return summary.format_fit_summary(make_fit(**words)).splitlines()[4:]


def test_a_summary_has_a_head_and_a_row_for_each_parameter():
    assert summary.format_fit_summary(make_fit()).splitlines() == [
        "Fit of 3 parameters to 23 numbers: chi2 2 per degree of freedom, 7 paths",
        "  I1         1.50 +- 0.1 [M L^2]",
        "  long name  -2.000 +- 0.02 [L]",
        "  angle      0.25 +- 0",
    ]


def test_the_head_counts_the_numbers_of_all_records():
    fit = make_fit(missing=(0, 4), dof=43)
    assert summary.format_fit_summary(fit).startswith("Fit of 3 parameters to 46 numbers: ")


def test_a_fit_of_as_many_parameters_as_numbers_has_one_degree_of_freedom():
    t = [0.0, 0.1, 0.2]
    values = kr.solve(kr.scenes.asymmetric, t).body_velocity
    record = kr.Record(t, {"body_velocity": values}, 0.01)
    fit = kr.fit(kr.scenes.asymmetric, record, ("start", "moments"))
    assert fit.dof == 1 and str(fit).startswith("Fit of 9 parameters to 9 numbers: ")


def test_ratios_are_shown_if_an_error_is_infinite():
    error = {"I1": np.inf, "long name": 0.02, "angle": 0.0}
    lines = summary.format_fit_summary(make_fit(error=error)).splitlines()
    assert lines[1] == "  I1         not identified [M L^2]"
    assert lines[4:] == ["  I1 / I3    2.00 +- 0.1"]
    page = summary.format_fit_summary_as_html(make_fit(error=error, excess=3.0))
    assert page.index("<p>Fit of 3") < page.index("I1 / I3") < page.index("<p>The residuals are 3")


@pytest.mark.parametrize(
    "value, error, text",
    [
        (1.23456, 0.1, "1.23 +- 0.1"),
        (1.23456, 0.012, "1.235 +- 0.012"),
        (123.456, 9.5, "123.5 +- 9.5"),
        (-123.456, 9.5, "-123.5 +- 9.5"),
        (0.001234, 0.5, "0.0012 +- 0.5"),
        (0.001234, 0.01, "0.0012 +- 0.01"),
        (5.0, 0.7, "5.00 +- 0.7"),
        (1.0, 1e-30, "1.0000000000000000 +- 1e-30"),
        (1.0 / 3.0, 0.0, "0.333333333333 +- 0"),
        (2.0, np.inf, "not identified"),
        (2.0, np.nan, "not identified"),
    ],
)
def test_values_have_two_digits_of_their_error(value, error, text):
    assert summary.format_value_with_error(value, error) == text


@pytest.mark.parametrize(
    "words, has_misfit",
    [
        ({"misfit": 0.5, "sigmas": (None,)}, False),
        ({"misfit": 0.51, "sigmas": (None,)}, True),
        ({"misfit": 0.51, "sigmas": (0.1, None)}, True),
        ({"misfit": 0.51, "sigmas": (0.1,)}, False),
        ({"misfit": 0.51, "chi2": 2000.0}, False),
        ({"misfit": 0.51, "chi2": 2001.0}, True),
        ({"misfit": 0.5, "chi2": 2001.0}, False),
    ],
)
def test_a_misfit_is_of_the_size_of_the_values(words, has_misfit):
    assert summary.has_residuals_as_large_as_data(make_fit(**words)) == has_misfit
    sentences = list_sentences(**words, excess=2.0)
    assert sentences[0].startswith("No motion of this scene fits the records") == has_misfit
    assert not has_misfit or "51 % of the values" in sentences[0]
    assert len(sentences) == 1


@pytest.mark.parametrize(
    "words, beginning",
    [
        ({"has_converged": False}, "The search did not converge"),
        ({"chi2": 2000.0, "excess": 3.5}, "The residuals are 3.5 times as large as sigma explains"),
        ({"unidentified": ("spin",)}, "Not identified: spin."),
        ({"ambiguous": ("spin",)}, "Ambiguous: spin."),
        ({"uncertain_sigma": ("sigma",)}, "Uncertain: sigma."),
        ({"at_bound": ("I1",)}, "At a bound: I1."),
        ({"inflation": 1.06}, "Errors were enlarged 1.06 times, because residuals are large"),
        ({"nonlinearity": 0.31}, "Errors are not normally distributed: .* from 1 by 0.31."),
        ({"missing": (2, 3)}, "5 values are left out: not measured, or undefined angles."),
        (
            {"piece_starts": (0.0, 1.0)},
            "The motion consists of 2 joined pieces, each with its own start.$",
        ),
    ],
)
def test_a_summary_mentions(words, beginning):
    [sentence] = list_sentences(**words)
    assert re.match(beginning, sentence)


@pytest.mark.parametrize(
    "words, count",
    [
        ({"chi2": 2000.0}, 0),
        ({"inflation": 1.05}, 0),
        ({"nonlinearity": 0.3}, 0),
        ({"residual_correlation": 0.9, "inflation": 1.05}, 0),
        ({"residual_correlation": 0.2, "inflation": 1.06}, 1),
        ({"residual_correlation": 0.21, "inflation": 1.06}, 2),
    ],
)
def test_a_summary_is_silent_about_small_deviations(words, count):
    sentences = list_sentences(**words)
    assert len(sentences) == count
    assert count < 2 or sentences[0].startswith("Neighbouring residuals are correlated (0.21)")
