import os
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["InputError", "Log", "Robot", "diagnose", "evaluate", "excite", "identify", "read_log", "regressor"]

Array = NDArray[np.float64]
Path = str | os.PathLike[str]
Progress = Callable[[float], object] | None

class InputError(ValueError):
    """Bad input: the one line that the program armcal prints."""

class Robot:
    """An arm's model: a robot file (TOML), or the name of a robot of armcal."""
    def __init__(self, path: Path) -> None: ...
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

def read_log(path: Path, channels: Path | None = None, *, msg: Sequence[Path] = ()) -> Log:
    """A log from a file; other files than armcal's own CSV need a channel map. msg: definitions of messages."""

def excite(
    robot: Robot,
    *,
    out: Path | None = None,
    purpose: Literal["train", "test"] = "train",
    seed: int = 1,
    periods: int | None = None,
    period: float = 10.0,
    curve: Literal["fourier", "sine", "polynomial", "spline"] = "fourier",
    criterion: Literal["condition", "d-optimal", "friction"] = "condition",
    separate: Sequence[str] = (),
    from_: Path | None = None,
    search: Literal["gradient", "genetic"] = "gradient",
    harmonics: int = 5,
    seconds: float = 20.0,
    starts: int | None = None,
    step: float = 0.004,
    margin: float = 0.05,
    cell: Path | None = None,
    clearance: float | None = None,
    no_slow: bool = False,
    progress: Progress = None,
) -> dict[str, Any]:
    """time (samples,) in s, position, velocity, acceleration (samples, joints) in rad (m), and what armcal excite
    --json writes. See docs/python.md."""

def identify(
    robot: Robot,
    train: Log | Sequence[Log],
    *,
    test: Log | None = None,
    cutoff_Hz: float = 0.0,
    band_Hz: float = 0.0,
    force: bool = False,
    progress: Progress = None,
) -> dict[str, Any]:
    """What armcal identify --json writes. See docs/python.md."""

def evaluate(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    table: Path | None = None,
    cutoff_Hz: float = 0.0,
    band_Hz: float = 0.0,
    progress: Progress = None,
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
    progress: Progress = None,
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
