"""Thumbnails of the gallery: one panel of each example's first figure, without labels or legend.

A scraper draws them while the figure exists. They are saved after all examples have run.
"""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import matplotlib.pyplot as plt
from PIL import Image, ImageOps

from .gallery import LAST, figure_of

SIZE = (400, 280)  # [pixel]
PANELS = {
    "sections": 1
}  # {example: number of its panel}, unless the last of its largest panels is used
MIDDLE = 0.5
CENTRES = {"gyrocompass": 0.0}  # {example: centre of the cropped chart, from 0 (left) to 1 (right)}
thumbnails = {}  # {image file: thumbnail}


@dataclass(frozen=True)
class Panel:
    """The position of a panel in its figure."""

    box: tuple  # (left, upper, right, lower), relative to the figure
    has_axes: bool  # False for a picture, which is shown completely


def setup(app):
    app.connect("builder-inited", save_thumbnails, priority=900)  # after sphinx-gallery


def scraper(block, block_vars, gallery_conf):
    """Draw the thumbnail of an example's first figure, which later scrapers save."""
    paths = block_vars["image_path_iterator"]
    numbers = plt.get_fignums()
    last_figure = figure_of(block_vars["example_globals"].get(LAST))
    figure = plt.figure(numbers[0]) if numbers else last_figure
    if len(paths) == 0 and figure is not None:
        example = Path(block_vars["src_file"]).stem
        looks = PANELS.get(example), CENTRES.get(example, MIDDLE)
        thumbnails[Path(paths.image_path.format(1))] = draw_thumbnail(figure, *looks)
    return ""


def draw_thumbnail(figure, number=None, centre=MIDDLE):
    """Return the thumbnail of the numbered panel, or of the last one among the largest."""
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    for legend in legends:
        legend.set_visible(False)
    panel, file = find_panel(figure, number), BytesIO()
    figure.savefig(file, format="png", dpi=figure.dpi)
    for legend in legends:
        legend.set_visible(True)
    return cut(Image.open(file).convert("RGB"), panel, centre)


def find_panel(figure, number=None):
    """Return the numbered panel, or the last one among the largest."""
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    areas = [axes.get_window_extent() for axes in figure.axes]
    if number is None:
        number = max(range(len(areas)), key=lambda i: (round(area_of(areas[i]), -3), i))
    box = areas[number]
    place = (box.x0 / width, 1 - box.y1 / height, box.x1 / width, 1 - box.y0 / height)
    return Panel(place, figure.axes[number].axison)


def area_of(box):
    return box.width * box.height


def save_thumbnails(app):
    for file, thumbnail in thumbnails.items():
        if file.exists():
            name = file.name.replace("_001.png", "_thumb.png")
            thumbnail.save(file.parent / "thumb" / name)


def cut(image, panel, centre):
    """Return the image of a panel, resized to a thumbnail.

    A chart fills the thumbnail and is cropped about `centre`. A picture is shown completely.
    """
    box = tuple(round(x * size) for x, size in zip(panel.box, 2 * image.size, strict=True))
    section = image.crop(box)
    if panel.has_axes:
        return ImageOps.fit(section, SIZE, centering=(centre, MIDDLE))
    return ImageOps.pad(section, SIZE, color="white")
