"""Grain-based distinct element simulation of rock fracture, with pluggable contact laws.

The public names stand in ``__init__.pyi``. Each is loaded when it is first used, so that commands start at once.
"""

import sys
from importlib import import_module
from typing import Any

import lazy_loader

__version__ = "0.4.0"
_load, _, _names = lazy_loader.attach_stub(__name__, __file__)
MODULES = (
    "conditions",
    "gauges",
    "geometry",
    "integration",
    "laws",
    "loads",
    "materials",
    "protocols",
)  #: of public names
__all__ = [name for name in _names if name not in (*MODULES, "units")]


def __getattr__(name: str) -> Any:
    try:
        return _load(name)
    except AttributeError:  # with name and object, Python says which name was meant
        words = f"module 'grainlaw' has no attribute '{name}'"
        rooms = () if name.startswith("_") else MODULES  # Python asks for names of its own kind, too
        at = next((room for room in rooms if name in import_module(f"{__name__}.{room}").__all__), "")
        words += f": it is grainlaw.{at}.{name}" if at else ""
        raise AttributeError(words, name=name, obj=sys.modules[__name__]) from None


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    return [*__all__, "__version__", *MODULES, "units"]
