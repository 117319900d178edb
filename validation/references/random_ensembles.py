"""Ensembles of random tops with their reference solutions.

The initial momenta are normally distributed about the momentum of a test scene. With the same seed,
a larger ensemble begins with the tops of a smaller one.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import kreisel as kr
import numpy as np

from .problems import Problem, load_problem, rotate_to_body

SEED, SCATTER, END = 15, 0.3, 100.0
SCENES = {"asymmetric": "asymmetric", "Lagrange": "thesis"}


@dataclass(frozen=True)
class TopEnsemble:
    """Tops with the same body, attitude and gravity, but different momenta."""

    problem: Problem
    momenta: np.ndarray  # (n, 3), about the fixed point, in the space frame [M L^2 T^-1]
    end: float  # final time [T]

    def __len__(self):
        return len(self.momenta)

    def first(self, n):
        return replace(self, momenta=self.momenta[:n])

    def scene(self, k):
        return self.problem.to_scene().replace(momentum=self.momenta[k])

    @cached_property
    def starts(self):
        """The initial attitudes and angular velocities in the body frame, with shape (n, 7)."""
        q = np.tile(np.array(self.problem.attitude, np.longdouble), (len(self), 1))
        q = q / np.sqrt((q * q).sum(-1, keepdims=True))
        velocity = rotate_to_body(q, np.array(self.momenta, np.longdouble)) / self.problem.inertia
        return np.concatenate((q, velocity), axis=1).astype(float)

    def ensemble(self):
        """Convert the tops to a kreisel ensemble."""
        scene = self.problem.to_scene()
        return kr.Scene(
            scene.body, momentum=self.momenta, attitude=scene.attitude, gravity=scene.gravity
        )


def draw_tops(kind, n, end=END):
    problem = load_problem(SCENES[kind])
    momenta = np.random.default_rng(SEED).normal(problem.momentum, SCATTER, (n, 3))
    return TopEnsemble(problem, momenta, end)


def solve_end(scene, end, digits):
    """Return the final attitude in extended precision."""
    path = kr.solve(scene, [end], "taylor", digits=digits)
    return np.array(path.q[-1], np.longdouble) + path.q_low[-1]


def compute_truths(tops):
    """Compute the final attitudes of all tops in 30-digit arithmetic, with shape (n, 4)."""
    return np.array([solve_end(tops.scene(k), tops.end, 30) for k in range(len(tops))])
