"""Dynamic parameters of an arm, on numpy arrays. See docs/python.md."""
import pathlib

from . import _core
from ._core import InputError, Log, Robot, diagnose, evaluate, excite, identify, read_log, regressor

__all__ = ["InputError", "Log", "Robot", "diagnose", "evaluate", "excite", "identify", "read_log", "regressor"]

_core._set_installed_home(str(pathlib.Path(__file__).parent / "data"))
