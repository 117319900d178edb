"""Tests of the closed-form solution for Kowalewski tops.

test_exact_torus_forms.py has the tests that also apply to Goryachev-Chaplygin tops.
"""

import kreisel as kr
import pytest

BODY = kr.Body(1.0, (2.0, 2.0, 1.0), (1.0, 0.0, 0.0), unphysical=True)


def test_a_pendulum_is_refused():
    pendulum = kr.Scene(BODY, momentum=(0.0, 2.5, 0.0), gravity=1)
    with pytest.raises(ValueError, match="no closed form"):
        kr.exact(pendulum)
    with pytest.raises(ValueError, match=r"does not apply: this motion.*in a plane"):
        kr.solve(pendulum, 1.0, method="exact")
