import importlib
import sys
from pathlib import Path

import hypothesis
import pytest

hypothesis.settings.register_profile("any machine", deadline=None)  # no test asserts how long anything takes
hypothesis.settings.load_profile("any machine")

HERE = Path(__file__).resolve().parent
EXAMPLES, PAPER = HERE.parent / "docs" / "examples", HERE.parent / "docs" / "paper"
# Tests find `support`, and `python -m pytest` puts the source folders out of reach again: under their bare names they
# would be second copies of every class.
sys.path[:] = [str(HERE), str(PAPER), *(path for path in sys.path if Path(path).resolve() != HERE.parent)]


@pytest.fixture
def example(monkeypatch):
    """Imports an example by its name, as if from its folder."""
    monkeypatch.syspath_prepend(EXAMPLES)
    yield importlib.import_module
    for file in EXAMPLES.glob("*.py"):
        sys.modules.pop(file.stem, None)
