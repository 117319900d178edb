"""Thumbnails of the gallery: one panel of each example's first figure, without its labels.

A scraper remembers where the panels are while the figure exists. The thumbnails are cut after all
examples have run.
"""

from pathlib import Path

import matplotlib.pyplot as plt
from PIL import Image

from .gallery import LAST, figure_of

SIZE = (400, 280)  # [pixel]
PANELS = {}  # {example: number of its panel}, for figures whose largest panel is not the best one
boxes = {}  # {image file: (left, upper, right, lower) relative to the figure}


def setup(app):
    app.connect("builder-inited", cut_thumbnails, priority=900)  # after sphinx-gallery


def scraper(block, block_vars, gallery_conf):
    """Remember the panel of an example's first figure, which the next scrapers save."""
    paths = block_vars["image_path_iterator"]
    numbers = plt.get_fignums()
    shown = figure_of(block_vars["example_globals"].get(LAST))
    figure = plt.figure(numbers[0]) if numbers else shown
    if len(paths) == 0 and figure is not None:
        file = Path(paths.image_path.format(1))
        boxes[file] = find_panel(figure, PANELS.get(Path(block_vars["src_file"]).stem))
    return ""


def find_panel(figure, number=None):
    """Return the box of the numbered panel, or of the last one among the largest."""
    figure.canvas.draw()
    width, height = figure.bbox.size
    areas = [axes.get_window_extent() for axes in figure.axes]
    if number is None:
        number = max(range(len(areas)), key=lambda i: (round(area_of(areas[i]), -3), i))
    box = areas[number]
    return (box.x0 / width, 1 - box.y1 / height, box.x1 / width, 1 - box.y0 / height)


def area_of(box):
    return box.width * box.height


def cut_thumbnails(app):
    for file, box in boxes.items():
        if file.exists():
            name = file.name.replace("_001.png", "_thumb.png")
            cut(Image.open(file), box).save(file.parent / "thumb" / name)


def cut(image, box):
    """Return a panel of an image, cut further to the shape of a thumbnail, about its centre."""
    left, upper, right, lower = (x * size for x, size in zip(box, 2 * image.size, strict=True))
    scale = min((right - left) / SIZE[0], (lower - upper) / SIZE[1])
    across, down = (scale * size / 2 for size in SIZE)
    x, y = (left + right) / 2, (upper + lower) / 2
    panel = image.convert("RGB").crop(
        tuple(round(edge) for edge in (x - across, y - down, x + across, y + down))
    )
    return panel.resize(SIZE, Image.Resampling.LANCZOS)
