"""Tangents of a path, and the error bounds computed from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._utils.validation import Array, freeze_array
from .indexing import ResolvedIndex

TANGENT_ATTRIBUTES = {  # {attribute of a path with tangents: the hint if it is missing}
    "tangents": "solve with tangents='start' to have it",
    "tangents_low": "solve with tangents='start' to have it",
    "tangents_rest": "solve with tangents='start' to have it",
    "conditioning": "solve with tangents with respect to 'start' and all parameters that are not 0",
    "derivative": "solve with tangents='start' to have it",
}
_ROUNDING = 2.0**-53


class TangentData(NamedTuple):
    """(n, 6, columns) tangents, their low words and their truncation error.

    The truncation error is the largest magnitude among the last retained terms of the Taylor
    series. `by` lists the parameters with respect to which the derivatives are taken, in the order
    of the C library.
    """

    high: Array
    low: Array
    truncation: float
    by: tuple[str, ...]

    @classmethod
    def from_flat_arrays(
        cls, high: Array, low: Array, truncation: float, names: tuple[str, ...]
    ) -> TangentData:
        """Build a TangentData object from flat arrays returned by the C library."""
        columns = sum(TANGENTS[name][1] for name in names)
        shape = (len(high), 6, columns)
        return cls(
            freeze_array(high.reshape(shape)), freeze_array(low.reshape(shape)), truncation, names
        )

    def select_tangents_at_states(self, index: ResolvedIndex) -> TangentData:
        """Return the tangents of the states selected by `index`."""
        return self._replace(high=freeze_array(self.high[index]), low=freeze_array(self.low[index]))

    @property
    def parameter_bit_mask(self) -> int:
        """The bit mask that represents the parameters in the C library."""
        return sum(TANGENTS[name][0] for name in self.by)

    def conditioning(self, scene: Scene) -> Array:
        """Return bounds on the attitude error [rad] caused by rounding the numbers in a scene.

        Every number that defines `scene` is assumed to have a rounding error. Raises AttributeError
        if the tangents with respect to a required parameter are missing. No tangents are required
        with respect to parameters equal to zero, because zero carries no rounding error.
        """
        data = collect_scene_numbers(scene)
        if any(name not in self.by and any(numbers) for name, numbers in data.items()):
            hint = TANGENT_ATTRIBUTES["conditioning"]
            raise AttributeError(f"this path has no 'conditioning': {hint}")
        sizes = np.abs([number for name in self.by for number in data[name]])
        changes = np.sqrt((self.high[:, :3] ** 2).sum(axis=1))
        return freeze_array(_ROUNDING * (changes * sizes).sum(axis=1))


def collect_scene_numbers(scene: Scene) -> dict[str, tuple[float, ...]]:
    """Return the numbers that define a scene, with the names of the related tangents as keys."""
    return {
        # a change of a unit quaternion rotates by twice its size
        "start": (2.0, 2.0, 2.0, *scene.momentum),
        "moments": scene.body.moments,
        "com": scene.body.principal_com,
        "gravity": (scene.gravity,),
        "mass": (scene.body.mass,),
        "damping": scene.damping,
        "rotor": scene.body.principal_rotor,
        "turning": scene.turning,
        "shaking": scene.shaking if scene._is_shaken else (0.0, 0.0, 0.0),
        "friction": (scene.friction,),
    }
