from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["InputError", "Log", "Robot", "diagnose", "evaluate", "identify", "read_log", "regressor"]

Array = NDArray[np.float64]

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

class Log:
    """What was measured on an arm. See docs/python.md."""
    def __init__(
        self,
        t: Array,
        q: Array,
        tau: Array,
        *,
        qd: Array | None = None,
        qdd: Array | None = None,
        qref: Array | None = None,
        ext: Array | None = None,
        temp: Array | None = None,
        name: str = "log",
    ) -> None: ...
    @property
    def samples(self) -> int: ...
    @property
    def joints(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def t(self) -> Array: ...
    @property
    def q(self) -> Array: ...
    @property
    def tau(self) -> Array: ...

def read_log(path: str, channels: str | None = None) -> Log:
    """A log from a CSV file, plain or gzip."""

def identify(
    robot: Robot,
    train: Log | Sequence[Log],
    *,
    test: Log | None = None,
    cutoff_Hz: float = 0.0,
    band_Hz: float = 0.0,
    force: bool = False,
) -> dict[str, Any]:
    """What armcal identify --json writes. See docs/python.md."""

def evaluate(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    table: str | None = None,
    cutoff_Hz: float = 0.0,
    band_Hz: float = 0.0,
) -> dict[str, Any]:
    """What armcal evaluate --json writes. See docs/python.md."""

def diagnose(
    robot: Robot,
    train: Log | Sequence[Log],
    test: Log,
    *,
    turns: bool | None = None,
    cutoff_Hz: float = 0.0,
    gain_tolerance: float = 0.0,
) -> dict[str, Any]:
    """What armcal diagnose --json writes, and model_file: the robot file with the terms. See docs/python.md."""

def regressor(
    robot: Robot,
    q: Array,
    qd: Array,
    qdd: Array,
    *,
    step_s: float = 0.008,
    temp: Array | None = None,
) -> Array:
    """(samples, joints, columns): the torque of each joint per unit of each parameter. See docs/python.md."""
