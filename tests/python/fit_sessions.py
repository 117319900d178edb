"""Sessions of kreisel.fit that return prescribed minima, for tests of the search strategy."""

from dataclasses import replace

import kreisel as kr
import numpy as np
from fits import HEAVY
from kreisel._fit import search_session
from kreisel._fit.levenberg_marquardt import Minimum
from kreisel._fit.parameters import FreeParameters, expand_free_names
from kreisel._fit.residuals import ResidualEvaluation
from kreisel._fit.search_session import BestFit, SearchSession

BODY_RATES = np.random.default_rng(5).normal(size=(400, 3))


def make_record(t=None, sigma=0.1, **values):
    t = np.linspace(0.0, 2.0, 40) if t is None else np.asarray(t, dtype=float)
    return kr.Record(t, values or {"body_velocity": BODY_RATES[: len(t)]}, sigma)


def make_session(*records, free="velocity", loss="linear", limit=500, scene=HEAVY, progress=None):
    records = records or (make_record(),)
    parameters = FreeParameters(scene, expand_free_names(free), records)
    return SearchSession(parameters, records, loss, limit, progress)


def make_best(session, cost=1.0, has_converged=True, residuals=None, **words):
    """Return a fit with the given cost whose parameters are the starting values of the search."""
    size = session.model.size
    residuals = np.zeros(size) if residuals is None else residuals
    jacobian = words.pop("jacobian", np.ones((size, session.parameters.size)))
    natural, point = np.ones(session.parameters.size), session.parameters.start
    return BestFit(point, residuals, jacobian, natural, cost, has_converged, **words)


def prescribe_minima(monkeypatch, session, *costs, **changes):
    """Replace the minimizer by a stub that returns the given costs; return a list of its calls."""
    calls, rest = [], list(costs)

    def minimize(model, point, search):
        calls.append((model, point, search))
        size = session.model.size
        evaluation = ResidualEvaluation(np.zeros(size), np.zeros((size, session.parameters.size)))
        return Minimum(replace(point, **changes), evaluation, rest.pop(0), True)

    monkeypatch.setattr(search_session, "minimize_cost", minimize)
    return calls


def record_calls(monkeypatch, session, names, results=None):
    """Replace methods of a fit session by functions that record each call in the returned list."""
    calls = []
    for name in names:

        def method(*arguments, name=name):
            calls.append((name, *arguments))
            result = (results or {}).get(name)
            return result(*arguments) if callable(result) else result

        monkeypatch.setattr(session, name, method)
    return calls
