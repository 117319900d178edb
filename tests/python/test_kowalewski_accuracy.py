"""Accuracy tests of the closed-form solution for numerically difficult Kowalewski tops.

The tops include those with the largest errors among 10,000 random tops.
"""

import kreisel as kr
import numpy as np
import pytest


def make_top(odd, com, gravity, momentum, attitude):
    """Return a Kowalewski top with the smallest moment of inertia about a given axis.

    The tuple `odd` contains the index of the axis with the smallest moment of inertia, and this
    moment.
    """
    axis, unit = odd
    moments = [2.0 * unit] * 3
    moments[axis] = unit
    body = kr.Body(1.0, tuple(moments), com, unphysical=True)
    return kr.Scene(body, momentum=momentum, attitude=attitude, gravity=gravity)


TOPS = {
    "a period of the curve converges slowly": make_top(
        (0, 4.0),
        (0.0, -1.0184149776740505, 0.0),
        -2.5,
        (-63.449012391383576, 14.79885768230786, 34.937471747544336),
        (-0.8201806368668869, 0.21548636554242678, -0.11858695649682335, -0.5165331382619746),
    ),
    "the integral to a pole converges slowly": make_top(
        (1, 0.25),
        (-0.4446548515264762, 0.0, -0.2044949602735876),
        -2.5,
        (-0.9131946146765131, 2.576030226894169, -2.4623993519744576),
        (-0.623609118236134, -0.6861883665405804, 0.319268386765182, -0.1957674398092788),
    ),
    "the terms of the sums cancel": make_top(
        (1, 0.125),
        (-0.8817147909389309, 0.0, 0.0),
        9.81,
        (1.4724104556276225, -0.14320095558052137, 8.804909807311772),
        (-0.22915237030731372, -0.8222937410548964, 0.5203675900059231, 0.0232328619827647),
    ),
    "a pole is close to complex branch points": make_top(
        (1, 0.25),
        (0.0, 0.0, -0.5452854956659582),
        9.81,
        (21.20941634284093, 7.257540894090358, 8.49101101797298),
        (-0.7185006957780932, 0.6316910814400278, -0.07245380664789398, 0.2819105774846942),
    ),
    "a variable of Kowalewski hardly moves": make_top(
        (1, 0.5),
        (0.8851036845760677, 0.0, 0.0),
        9.81,
        (9.497484910359537, 37.04149902458484, 0.40655879035205067),
        (0.5812271290086256, 0.02937897179074629, -0.20165683894105563, -0.7878111574668196),
    ),
}


@pytest.mark.parametrize("name", TOPS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_error_is_a_few_rounding_errors(name, sign):
    scene = TOPS[name]
    lever = abs(scene.gravity) * np.linalg.norm(scene.body.com)
    unit = np.sqrt(min(scene.body.moments) / lever)
    times = sign * unit * np.concatenate([np.linspace(0.1, 6.0, 40), [20.0, 45.0]])
    top, truth = kr.exact(scene), kr.solve(scene, times, digits=30)
    assert top.certificate < 5e-14
    # Without special treatment of such tops, the errors would be 1.8e-14 to 1.1e-12 rad.
    assert kr.attitude_error(top(times).q, truth.q).max() < 1.5e-14
    assert np.abs(top(times).energy / truth.energy - 1.0).max() < 2e-14
