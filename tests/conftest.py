import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
# Tests find `support`, and `python -m pytest` puts the source folders out of reach again: under their bare names they
# would be second copies of every class.
sys.path[:] = [str(HERE), *(path for path in sys.path if Path(path).resolve() != HERE.parent)]
