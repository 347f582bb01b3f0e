"""Dynamic parameters of an arm, on numpy arrays. See docs/python.md."""
import pathlib

from . import _core
from ._core import InputError, Robot, regressor

__all__ = ["InputError", "Robot", "regressor"]

_core._set_installed_home(str(pathlib.Path(__file__).parent / "data"))
