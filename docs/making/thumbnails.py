"""Thumbnails of the gallery: one panel of each example's first figure, without labels and legend.

A scraper remembers where the panels are while the figure exists. The thumbnails are cut after all
examples have run.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
from PIL import Image, ImageOps

from .gallery import LAST, figure_of

SIZE = (400, 280)  # [pixel]
PANELS = {
    "sections": 1
}  # {example: number of its panel}, if its last largest panel is not the best
MIDDLE = 0.5
CENTRES = {
    "gyrocompass": 0.0
}  # {example: about which a chart is cut, 0 at the left, 1 at the right}
panels = {}  # {image file: panel}


@dataclass(frozen=True)
class Panel:
    """The place of a panel in its figure."""

    box: tuple  # (left, upper, right, lower), relative to the figure
    legend: tuple | None  # the place of its legend, or None
    has_axes: bool  # False for a picture, which is shown whole
    centre: float = MIDDLE


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
        example = Path(block_vars["src_file"]).stem
        centre = CENTRES.get(example, MIDDLE)
        panels[file] = replace(find_panel(figure, PANELS.get(example)), centre=centre)
    return ""


def find_panel(figure, number=None):
    """Return the numbered panel, or the last one among the largest."""
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    areas = [axes.get_window_extent() for axes in figure.axes]
    if number is None:
        number = max(range(len(areas)), key=lambda i: (round(area_of(areas[i]), -3), i))
    axes, legend = figure.axes[number], figure.axes[number].get_legend()

    def place(box):
        return (box.x0 / width, 1 - box.y1 / height, box.x1 / width, 1 - box.y0 / height)

    return Panel(place(areas[number]), legend and place(legend.get_window_extent()), axes.axison)


def area_of(box):
    return box.width * box.height


def cut_thumbnails(app):
    for file, panel in panels.items():
        if file.exists():
            name = file.name.replace("_001.png", "_thumb.png")
            cut(Image.open(file).convert("RGB"), panel).save(file.parent / "thumb" / name)


def cut(image, panel):
    """Return a panel in the size of a thumbnail.

    A chart fills the thumbnail and is cut about `panel.centre`. A picture is shown whole.
    """

    def to_pixels(place):
        return tuple(round(x * size) for x, size in zip(place, 2 * image.size, strict=True))

    if panel.has_axes and panel.legend:
        image = image.copy()
        image.paste("white", to_pixels(panel.legend))
    shown = image.crop(to_pixels(panel.box))
    if panel.has_axes:
        return ImageOps.fit(shown, SIZE, centering=(panel.centre, MIDDLE))
    return ImageOps.pad(shown, SIZE, color="white")
