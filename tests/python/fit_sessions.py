"""Records of random rates for the tests of other spins that fit as well."""

import kreisel as kr
import numpy as np

BODY_RATES = np.random.default_rng(5).normal(size=(400, 3))


def make_record(t):
    return kr.Record(t, {"body_velocity": BODY_RATES[: len(t)]}, 0.1)
