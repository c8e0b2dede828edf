"""The pictures of a world (paper, Fig. 6 to 9), from world.nc."""

from ..files.open_netcdf import open_netcdf
from ..settings.errors import InputError
from .draw_world_day import draw_world_day
from .draw_world_gain import draw_world_gain
from .draw_world_map import draw_world_map
from .draw_world_months import draw_world_months
from .picture import DOTS, plain_style
from .world_axes import join_at_date_line

PARTS = ("by_month", "by_solar_hour", "without_reflections")
CURE = "compute it again: citypv world … --overwrite"
SHOWN = ("weather", "full_load_hours", *(f"full_load_hours_{part}" for part in PARTS))
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

    Raises
    ------
    InputError
        The file cannot be read, or is none of `citypv world`.
    """
    dataset, written = read_dataset(path), []
    if "latitude" not in dataset.dims:
        return written
    dataset = join_at_date_line(dataset)
    with plain_style():
        for name, draw in PICTURES.items():
            figure = draw(dataset)
            if figure is not None:
                figure.savefig(folder / name, dpi=DOTS, metadata={"Software": None})
                written.append(name)
    return written


def read_dataset(path):
    """world.nc in memory, if it is one: xarray.Dataset."""
    try:
        with open_netcdf(path) as dataset:
            dataset.load()
    except (OSError, ValueError, TypeError) as error:
        raise InputError(path, f"cannot be read as NetCDF ({' '.join(str(error).split())})", CURE) from error
    missing = [name for name in SHOWN if name not in dataset]
    if missing:
        raise InputError(path, f"has no {', '.join(missing)}", CURE)
    return dataset
