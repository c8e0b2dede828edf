"""surfaces.nc: shapes of the surfaces and of the modules on them, full load hours by month, and
power of the buildings by month and hour of the day, for pictures; without the traced matrices.
"""

from contextlib import contextmanager

import h5netcdf
import numpy as np

from ..modules.lay_modules import ModuleLayout
from ..read.netcdf_file import netcdf_file, refuse_links
from ..settings.errors import InputError
from .netcdf_variables import write_variables
from .transfer_file import PACKED, describe_fields

NAME = "surfaces.nc"
FORMAT = "CityPV surfaces 1"
MONTHLY = "full_load_hours_by_month"
HOURLY = "building_power"  # by month and hour of the day
GIVE_RESULTS = "give a folder that citypv simulate or citypv yield has written"
AGAIN = "compute the folder again, by citypv simulate or citypv yield"


def write_surfaces(path, transfer, energy, buildings=None):
    """Write surfaces.nc.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    buildings : tuple, optional
        Names and power of the buildings, and the zone of the hours, of `compute_building_hours`.
    """
    # Names, suns, months of hours, and the outlines of the surfaces.
    hours = energy.full_load_hours_by_month.astype(np.float32)
    meaning = {
        "units": "h",
        "long_name": "full load hours of each month (UTC) per year, mean over the whole surface",
    }
    variables = {
        "surface_id": ("surface", np.array(transfer.surfaces.surface_id, dtype=object)),
        "direction": (
            ("sun", "axis"),
            transfer.suns.direction,
            {"long_name": "unit vectors to the traced suns"},
        ),
        MONTHLY: (("surface", "month"), hours, meaning, PACKED),
    } | describe_fields({"outlines": transfer.outlines})
    # Where modules are laid out in rows, each with its surface, corner and edges, which are nearly
    # all the same and so packed small.
    if energy.layout is not None:
        words = {"surface": "surface that carries the module", "corner": "its lower left corner"}
        words |= {"along": "its edge along the row", "up": "its edge up the slope"}
        words |= {"row": "its row on the surface, of facades the storey"}
        for name, long_name in words.items():
            values = getattr(energy.layout, name)
            whole, axes = values.ndim == 1, ("module", "axis")[: values.ndim]
            told = {"long_name": long_name} | ({} if whole else {"units": "m"})
            kept = values.astype(np.int32 if whole else np.float32)
            variables[f"module_{name}"] = axes, kept, told, PACKED
    # If given, mean power of buildings by hour of the day and month, to about four digits, which is
    # packed to half of its size.
    if buildings is not None:
        names, power, zone = buildings
        rounded = (power.view(np.uint32) + np.uint32(0x400) & np.uint32(0xFFFFF800)).view(
            power.dtype
        )
        told = {
            "units": "kW",
            "long_name": "mean AC power of the building's modules in this hour of this month's "
            "days",
            "zone": str(zone),
        }
        variables["building"] = "building", names.astype(object)
        variables[HOURLY] = ("building", "month", "hour"), rounded, told, PACKED
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        file.attrs["title"] = FORMAT
        write_variables(file, variables)


@contextmanager
def open_surfaces(folder):
    """The surfaces.nc of a folder, open, with the names and months of its surfaces; bytes of it may
    be damaged.

    Raises
    ------
    InputError
        There is none, or it cannot be read.
    """
    path = folder / NAME
    if not path.is_file():
        raise InputError(path, "there is no such file", AGAIN)
    try:
        refuse_links(path)
        with h5netcdf.File(path) as file:
            if file.attrs.get("title") != FORMAT:
                raise InputError(path, "is no file of CityPV's surfaces", GIVE_RESULTS)
            missing = [name for name in ("surface_id", "direction", MONTHLY) if name not in file]
            if missing:
                raise InputError(path, f"has no {', '.join(missing)}", AGAIN)
            yield file
    except OSError as error:
        if error.filename not in (None, str(path)):  # of another file that was open beside it
            raise
        raise InputError(
            path, f"cannot be read as CityPV's surfaces ({error})", GIVE_RESULTS
        ) from error


def read_layout(file, first=0, stop=None):
    """Modules of some surfaces of a surfaces.nc that is open, by default of all: ModuleLayout, None
    where every square metre counts. They are numbered from the first of these surfaces.
    """
    if "module_surface" not in file:
        return None
    owner = np.asarray(file["module_surface"][:], np.int64)  # ascending
    stop = np.inf if stop is None else stop
    own = slice(*np.searchsorted(owner, [first, stop]).tolist())
    edges = {name: np.asarray(file[f"module_{name}"][own], float) for name in ("along", "up")}
    return ModuleLayout(
        surface=owner[own] - first,
        corner=np.asarray(file["module_corner"][own], float),
        row=np.asarray(file["module_row"][own], np.int64),
        **edges,
    )


def read_hours(file, first, stop):
    """Names of some buildings of a surfaces.nc that is open, and their power, (b, 12, 24) float32
    [kW]; None in files of earlier versions.
    """
    if HOURLY not in file:
        return None
    return file["building"][first:stop], np.asarray(file[HOURLY][first:stop], np.float32)


def zone_of_hours(file):
    """Zone of the hours of the day in a surfaces.nc that is open, as text; "" if it has none."""
    return str(file[HOURLY].attrs["zone"]) if HOURLY in file else ""


def check_names(folder, found, surface_id):
    """Refuse surfaces that differ from the ones in faces.csv, or buildings in buildings.csv."""
    if [text.decode() if isinstance(text, bytes) else str(text) for text in found] != surface_id:
        raise InputError(folder / NAME, "does not belong to the tables beside it", GIVE_RESULTS)
