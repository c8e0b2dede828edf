"""The pictures of a world (paper, Fig. 6 to 9), from world.nc."""

from ..files.open_netcdf import open_netcdf
from .draw_world_day import draw_world_day
from .draw_world_gain import draw_world_gain
from .draw_world_map import draw_world_map
from .draw_world_months import draw_world_months
from .picture import DOTS, plain_style

PICTURES = {
    "world_map.png": draw_world_map,
    "world_gain.png": draw_world_gain,
    "world_months.png": draw_world_months,
    "world_day.png": draw_world_day,
}


def draw_world(path, folder):
    """Draw the pictures that the places allow: maps need at least two rows and columns of a grid.

    Parameters
    ----------
    path : path-like
        world.nc.
    folder : pathlib.Path

    Returns
    -------
    list of str
        Names of the files written.
    """
    with open_netcdf(path) as dataset:
        dataset.load()
    written = []
    if "latitude" not in dataset.dims:
        return written
    with plain_style():
        for name, draw in PICTURES.items():
            figure = draw(dataset)
            if figure is not None:
                figure.savefig(folder / name, dpi=DOTS, metadata={"Software": None})
                written.append(name)
    return written
