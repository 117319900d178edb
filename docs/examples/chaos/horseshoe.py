r"""
Can chaos be proved?
====================

Lyapunov exponents are measured over finite times, with rounding errors. This example proves that an
asymmetric heavy top is chaotic: for each sequence of the words *stay* and *go*, there is a motion
that follows it. On *stay*, it passes a surface once, close to a periodic motion. On *go*, it leaves
the periodic motion, swings down until it nearly hangs, and comes back with the 40th passage. So
what the top does can be as irregular as the tosses of a coin, and infinitely many motions are
periodic.

The moments of inertia are 1, 3/2 and 3/4. The centre of mass lies on the third axis, with the lever
:math:`m g \lvert c \rvert = 1`. The energy is 5/4, and the vertical momentum 1/4. The surface of
section is :math:`P_2 = 0` with :math:`\dot P_2 > 0`, where :math:`P` is the vertical in the body.
Its coordinates are :math:`P_1` and the angular velocity :math:`W_2` in the body.
"""

from fractions import Fraction

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np
from flint import arb, arb_mat, ctx
from kreisel._proof.equations import Equations  # the parts of kreisel.enclose
from kreisel._proof.steps import MovingSet

BITS, LONGEST_STEP = 96, 0.5  # longer steps would make enclosures of sets wider
ctx.prec = 120
J, energy, momentum = (arb(1), arb(3) / 2, arb(3) / 4), arb(5) / 4, arb(1) / 4
top = kr.Body(1.0, (1.0, 1.5, 0.75), com=(0, 0, 0.25))
equations = Equations(kr.Scene(top, gravity=4.0, momentum=(0, 0, 1)))
assert (equations.units == 1).all()
UNIT = arb(2) ** equations.time  # of frequency
P1, P2, P3 = 7, 8, 9  # in the states of the equations: W / UNIT, attitude, P

# %%
# States follow from the coordinates by the integrals :math:`\lvert P \rvert = 1`, momentum and
# energy: the vector :math:`(\sqrt{J_1} W_1, \sqrt{J_3} W_3)` has a known length and a known
# product with :math:`(\sqrt{J_1} P_1, \sqrt{J_3} P_3)`. All numbers are balls of FLINT, so that the
# functions also apply to sets of states.


def find_states(z, side):
    """Return the states with the coordinates z where P3 has the sign `side`."""
    p1, w2 = z
    p3 = side * (1 - p1 * p1).sqrt()
    n1, n3 = J[0].sqrt() * p1, J[2].sqrt() * p3
    square = n1 * n1 + n3 * n3
    root = ((2 * (energy - p3) - J[1] * w2 * w2) / square - (momentum / square) ** 2).sqrt()
    w1 = (momentum / square * n1 + root * n3) / J[0].sqrt()
    w3 = (momentum / square * n3 - root * n1) / J[2].sqrt()
    w = [x / UNIT for x in (w1, w2, w3)]
    return np.array([*w, *map(arb, (1, 0, 0, 0)), p1, arb(0), p3], object)


def differentiate_states(y):
    """Return the derivative of find_states by z, from the gradients of the integrals."""
    (w1, w2, w3), p1, p3 = UNIT * y[:3], y[P1], y[P3]
    det = J[0] * J[2] * (p1 * w3 - p3 * w1)
    rows = []
    for dp1, dw2 in ((arb(1), arb(0)), (arb(0), arb(1))):
        dp3 = -p1 / p3 * dp1
        a, b = -J[0] * w1 * dp1 - J[2] * w3 * dp3, -dp3 - J[1] * w2 * dw2
        dw1, dw3 = J[2] * (a * w3 - b * p3) / det, J[0] * (b * p1 - a * w1) / det
        dw = [x / UNIT for x in (dw1, dw2, dw3)]
        rows.append([*dw, *map(arb, (0, 0, 0, 0)), dp1, arb(0), dp3])
    return arb_mat(rows).transpose()


def make_scene(y):
    """Return a scene that starts in a state, without its last digits."""
    (w1, w2, w3), p1, p3 = (UNIT * y[:3]).astype(float), float(y[P1]), float(y[P3])
    attitude = np.array([1 + p3, 0, -p1, 0]) / np.hypot(1 + p3, p1)
    m = kr.quaternion.turn(attitude, (w1, 1.5 * w2, 0.75 * w3))
    return kr.Scene(top, gravity=4.0, attitude=attitude, momentum=m)


# %%
# The steps of kreisel.enclose also enclose the derivative of the motion on a set.


class Flow(MovingSet):
    """States and their derivative by the states at the start."""

    def __init__(self, y):
        super().__init__(equations, y, BITS)
        self.derivative, self.cap = arb_mat(self.Q.tolist()), LONGEST_STEP

    def prove_step(self, *step):
        proof = super().prove_step(*step)
        if proof:
            V = [[arb(x, proof.error) for x in row] for row in proof.V.sum(axis=0).tolist()]
            self.derivative = arb_mat(V) * self.derivative
        self.cap = min(self.cap, LONGEST_STEP)
        return proof

    def move_to_surface(self):
        """Return the states on the surface, and their derivative by those at the start.

        P2 grows at a positive rate, so all states reach the surface at a time between -most and
        most. Until then they stay in `hull`, because hull contains y + time * f(hull).
        """
        y, most, n = self.find_box(), 1e-3, len(self.mid)
        for _ in range(8):
            time, hull = arb(0, most), y
            for _ in range(5):
                hull = y + 2 * time * equations(hull)
            speed = equations(hull)
            assert all(a.contains(b) for a, b in zip(hull, y + time * speed, strict=True))
            assert speed[P2] > 0 and time.contains(y[P2] / speed[P2])
            end, most = y - y[P2] / speed[P2] * speed, 1.1 * float((y[P2] / speed[P2]).abs_upper())
        end[P2] = arb(0)
        # The derivative of this motion differs from 1 by at most exp(slope * most) - 1.
        sizes = np.array([float(x.abs_upper()) for x in hull])
        slope = 1.1 * (equations.linear_bound + equations.bilinear_bound @ sizes).sum(axis=1).max()
        assert slope * most < 0.1
        f, one = equations(end), np.eye(n)
        near = [[arb(x, 1.1 * slope * most) for x in row] for row in one.tolist()]
        along = [
            [x - f[i] / f[P2] if k == P2 else arb(x) for k, x in enumerate(row)]
            for i, row in enumerate(one.tolist())
        ]
        return end, arb_mat(along) * arb_mat(near) * self.derivative


def find_return(z, side):
    """Return the time of the next passage of the state with the coordinates z."""
    flow, was_below = Flow(find_states(z, side)), False
    while not (was_below and flow.mid[P2] > 0):
        assert flow.advance(flow.t + Fraction(1, 2))
        was_below = was_below or flow.mid[P2] < 0
    while abs((y := flow.find_box())[P2].mid()) > 1e-28:  # Newton's method
        assert flow.advance(flow.t - Fraction(float(y[P2] / equations(y)[P2])))
    return flow.t


def pass_surface(z, side, time):
    """Return the coordinates of a passage, their derivative by z, and the sign of P3."""
    y = find_states(z, side)
    flow = Flow(y)
    assert flow.advance(time)
    end, derivative = flow.move_to_surface()
    change = derivative * differentiate_states(y)
    assert end[P3] > 0 or end[P3] < 0
    rows = [[change[P1, k] for k in range(2)], [UNIT * change[1, k] for k in range(2)]]
    return [end[P1], UNIT * end[1]], arb_mat(rows), 1 if end[P3] > 0 else -1


# %%
# The periodic motion always passes the surface at the point p. Its multipliers are 3.80 and 1/3.80:
# nearby motions leave it in one direction, and approach it in another. The motion through the point
# x does both, in the past and in the future, because the equations remain the same if time,
# :math:`W_2` and :math:`P_2` are reversed. Both points were found by Newton's method. They need not
# be exact: the proof is about sets around them and around the 19 passages before and after x.


def as_floats(matrix):
    return np.array([[float(matrix[i, k]) for k in range(2)] for i in range(2)])


p = [arb("0.911197888898817137099154286795"), arb(0)]
x = [arb("-0.184563492163378501025957205268"), arb(0)]
mirror = np.diag([1.0, -1.0])
period = find_return(p, 1)
multipliers, vectors = np.linalg.eig(as_floats(pass_surface(p, 1, period)[1]))

orbit, times, slopes = [(x, -1)], [], []
for _ in range(19):
    times.append(find_return(*orbit[-1]))
    z, slope, side = pass_surface(*orbit[-1], times[-1])
    orbit.append(([number.mid() for number in z], side))
    slopes.append(as_floats(slope))
orbit = [([p1, -w2], side) for (p1, w2), side in orbit[:0:-1]] + orbit
slopes = [np.linalg.inv(mirror @ slope @ mirror) for slope in slopes[::-1]] + slopes
times = times[::-1] + times

# the directions in which motions separate and approach each other
separating = [vectors[:, multipliers.argmax()]]
for slope in slopes:
    separating.append(slope @ separating[-1] / np.linalg.norm(slope @ separating[-1]))
directions = [
    np.array([u, mirror @ v]).T for u, v in zip(separating, separating[::-1], strict=True)
]

# %%
# Around each passage lies a parallelogram. The return map *stretches* it over the next one if it
# maps the two short sides beyond those of the next one, one on each side, and nothing beyond the
# long sides. If each parallelogram of a sequence is stretched over the next one, a motion passes
# through all of them, and through a closed sequence a periodic motion (Zgliczyński and Gidea, J.
# Differential Equations 202 (2004)). The inequalities hold for balls that contain the image of the
# centre and the derivative on the whole parallelogram.


def map_set(centre, side, sides, time):
    """Return the image of the centre, those of the sides on the whole set, and the sign of P3."""
    reach = [1.001 * float((abs(sides[i, 0]) + abs(sides[i, 1])).abs_upper()) for i in range(2)]
    box = [x + arb(0, r) for x, r in zip(centre, reach, strict=True)]
    z, _, image_side = pass_surface(centre, side, time)
    _, slope, box_side = pass_surface(box, side, time)
    return z, slope * sides, image_side * (image_side == box_side)


def is_stretched(image, other):
    """Return whether an image stretches over another parallelogram."""
    (z, edges, side), (centre, other_side, sides) = image, other
    a = sides.solve(edges)
    shift = sides.solve(arb_mat([[z[i] - centre[i]] for i in range(2)]))
    along = abs(a[0, 0]) - abs(a[0, 1]) - abs(shift[0, 0])
    across = abs(a[1, 0]) + abs(a[1, 1]) + abs(shift[1, 0])
    return side == other_side and bool(along > 1) and bool(across < 1)


def make_sides(directions, length, width):
    return arb_mat((directions * (length, width)).tolist())


off = [float(a - b) for a, b in zip(orbit[0][0], p, strict=True)]
d = abs(np.linalg.solve(directions[0], off)[0])  # distance of the first passage from p
stay = (p, 1, make_sides(directions[0], d / 2.2, 0.6 * d))
go = (*orbit[0], make_sides(directions[0], 0.4 * d, 0.25 * d))
shift, edges = stay[2].solve(arb_mat([[x] for x in off])), stay[2].solve(go[2])
assert abs(shift[0, 0]) - abs(edges[0, 0]) - abs(edges[0, 1]) > 1  # they have no common point

image = map_set(*stay, period)
proofs = [is_stretched(image, stay), is_stretched(image, go)]
sides = go[2]
for one, two, axes, time in zip(orbit, orbit[1:], directions[1:], times, strict=False):
    image = map_set(*one, sides, time)
    a = arb_mat(axes.tolist()).solve(image[1])
    # shorter than the image, and wider
    length = min(0.8 * float((abs(a[0, 0]) - abs(a[0, 1])).lower()), 0.4 * d)
    sides = make_sides(axes, length, 1.5 * float((abs(a[1, 0]) + abs(a[1, 1])).upper()))
    proofs.append(is_stretched(image, (*two, sides)))
proofs.append(is_stretched(map_set(*orbit[-1], sides, period), stay))
assert all(proofs)
print(f"{len(proofs)} images stretch over the next parallelogram: the top is chaotic")

# %%
# The red points are the parallelograms, with sides of at most 1e-10. The motion leaves p downwards,
# passes x, the point on the left, and comes back to p from above. The grey points are 6,000
# passages of one motion near x.

scene = make_scene(find_states(*orbit[19]))
upwards = kr.events.plane((0, 1, 0), of="body_vertical", direction=1)
states = kr.section(scene, upwards, n=6000)

figure, axes = plt.subplots(layout="constrained")
angles = np.degrees(np.arctan2(states.body_vertical[:, 0], states.body_vertical[:, 2]))
axes.plot(angles, states.body_velocity[:, 1], ".", color="0.7", markersize=1)
for (p1, w2), side in orbit:
    angle = np.degrees(np.arctan2(float(p1), float(side * (1 - p1 * p1).sqrt())))
    axes.plot(angle, float(w2), "o", color="tab:red", markersize=4)
axes.set(xlabel="angle from P to the third axis [degrees]", ylabel="W2 [rad/T]")
