"""The gallery: the order of its examples, and the figures that they make."""

import matplotlib.figure
from sphinx_gallery.scrapers import figure_rst

#: as one would read them first
EXAMPLES = (
    "compare_laws", "own_law", "tension_crack", "acoustic_events", "elastic_constants", "slit", "brazilian", "envelope",
    "textures", "foliation", "bimetal", "thermal_shock", "fatigue", "tunnel", "hydraulic_fracturing", "incline",
    "hopkinson", "study",
)  # fmt: skip


class Order:
    """Sorts files of examples."""

    def __init__(self, folder):
        pass

    def __call__(self, file):
        return EXAMPLES.index(file.removesuffix(".py"))


def _get_sg_image_scraper():
    return scraper


def scraper(block, block_vars, gallery_conf):
    """Save every figure among the variables that was not there before this block: ours are not those of pyplot."""
    known = block_vars["example_globals"].setdefault("__shown__", [])
    files = []
    for value in list(block_vars["example_globals"].values()):
        if isinstance(value, matplotlib.figure.Figure) and not any(value is each for each in known):
            known.append(value)
            files.append(next(block_vars["image_path_iterator"]))
            value.savefig(files[-1], dpi=120)
    return figure_rst(files, gallery_conf["src_dir"])
