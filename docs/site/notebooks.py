"""Examples of the gallery as notebooks beside their scripts, as on the site: python docs/site/notebooks.py FILE..."""

import runpy
import sys
from pathlib import Path

from sphinx_gallery.notebook import python_to_jupyter_cli

if __name__ == "__main__":
    site = runpy.run_path(str(Path(__file__).parents[1] / "conf.py"))
    python_to_jupyter_cli(sys.argv[1:], sphinx_gallery_conf=site["sphinx_gallery_conf"])
