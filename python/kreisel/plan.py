"""What was chosen for a path, and why."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Plan:
    """What method='geometric' chose so that the attitude error stays below a target on [0, t], and what that cost.

    step          [T]
    target        the error asked for, error the estimate of what it is [rad]
    conditioning  how far one rounding of the data moves the attitude [rad]; None where the target is far above that
    run, trials   evaluations of the torque: of the run that was kept, and of all before it
    """

    method: str
    step: float
    order: int
    target: float
    error: float
    conditioning: float | None
    run: int
    trials: int

    def __str__(self) -> str:
        moved = f"; one rounding of the data moves the attitude by {self.conditioning or 0.0:.1e} rad"
        known = "" if self.conditioning is None else moved
        return (
            f"{self.method} (order {self.order}) with step {self.step:g}: attitude error about {self.error:.1e} rad "
            f"of {self.target:g} allowed, for {self.run} evaluations of the torque and {self.trials} in trial runs{known}"
        )
