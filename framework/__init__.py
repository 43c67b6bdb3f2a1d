"""Grain-based distinct element simulation of rock fracture, with pluggable contact laws.

The public names stand in ``__init__.pyi``. Each is loaded when it is first used, so that commands start at once.
"""

import sys
from typing import Any

import lazy_loader

__version__ = "0.3.0"
_load, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    try:
        return _load(name)
    except AttributeError:  # with both, Python says which name was meant
        words = f"module 'grainlaw' has no attribute '{name}'"
        raise AttributeError(words, name=name, obj=sys.modules[__name__]) from None


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    imported = (name for name in ("geometry", "laws", "materials", "protocols", "units") if name in globals())
    return [*__all__, "__version__", *imported]
