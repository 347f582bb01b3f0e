import numpy as np
from numpy.typing import NDArray

__all__ = ["InputError", "Robot", "regressor"]

class InputError(ValueError):
    """Bad input: the one line that the program armcal prints."""

class Robot:
    def __init__(self, path: str) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def joints(self) -> int: ...
    @property
    def columns(self) -> list[str]: ...
    @property
    def units(self) -> list[str]: ...

def regressor(
    robot: Robot,
    q: NDArray[np.float64],
    qd: NDArray[np.float64],
    qdd: NDArray[np.float64],
    *,
    step_s: float = 0.008,
    temp: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """(samples, joints, columns): the torque of each joint per unit of each parameter. See docs/python.md."""
