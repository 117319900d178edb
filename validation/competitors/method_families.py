"""Groups of methods that are shown in the same figure."""

import kreisel as kr

from .machine import is_of_gsl
from .single_runs import PEERS, control_of

TITLES = {
    "series, closed form and other adaptive": lambda m: control_of(m) != "step",
    "fixed step, order 1 and 2": lambda m: control_of(m) == "step" and m.order <= 2,
    "fixed step, order 3 and 4": lambda m: control_of(m) == "step" and 2 < m.order <= 4,
    "fixed step, higher order": lambda m: control_of(m) == "step" and m.order > 4,
}


def group_methods():
    """Return the methods and other integrators of each figure as a dictionary by title."""
    others = [*filter(is_of_gsl, kr.methods), *(peer.name for peer in PEERS)]
    yardstick = [PEERS[0].name]
    return {
        title: (
            [
                name
                for name, method in kr.methods.items()
                if is_member(method) and name not in others
            ],
            others if i == 0 else yardstick,
        )
        for i, (title, is_member) in enumerate(TITLES.items())
    }
