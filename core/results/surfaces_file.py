"""surfaces.nc: shapes of the surfaces and their full load hours by month, for pictures; without the traced matrices.

Folders of version 0.2.0 lack it. Their shapes are read from transfer.nc, which names them alike.
"""

import h5netcdf
import numpy as np

from ..city.grid_cells import Outlines
from ..settings.errors import InputError
from .netcdf_file import netcdf_file, write_variables
from .transfer_file import FORMAT as TRANSFER
from .transfer_file import OUTLINES

NAME, BEFORE = "surfaces.nc", "transfer.nc"
FORMAT = "CityPV surfaces 1"
MONTHLY = "full_load_hours_by_month"
CURE = "give a folder that citypv simulate or citypv yield has written"
PACKED = {"compression": "gzip", "shuffle": True}


def write_surfaces(path, transfer, energy):
    """Write surfaces.nc.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    """
    hours = energy.full_load_hours_by_month.astype(np.float32)
    meaning = {"units": "h", "long_name": "full load hours of each month (UTC) per year, mean over the whole surface"}
    found = {
        "surface_id": ("surface", np.array(transfer.surfaces.surface_id, dtype=object)),
        "direction": (("sun", "axis"), transfer.suns.direction, {"long_name": "unit vectors to the traced suns"}),
        MONTHLY: (("surface", "month"), hours, meaning, PACKED),
    }
    if transfer.outlines is not None:
        values = transfer.outlines.points, transfer.outlines.ring_start, transfer.outlines.surface_start
        for (name, (dimensions, details)), array in zip(OUTLINES.items(), values, strict=True):
            found[name] = dimensions, array, details, PACKED
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        file.attrs["title"] = FORMAT
        write_variables(file, found)


def read_surfaces(folder, surface_id):
    """Directions of the traced suns, and outlines and hours by month of the surfaces, as far as they are there.

    Parameters
    ----------
    folder : pathlib.Path
    surface_id : list of str
        Of faces.csv.

    Returns
    -------
    suns : (s, 3) numpy.ndarray or None
    outlines : Outlines or None
    months : (n, 12) numpy.ndarray or None [h]

    Raises
    ------
    InputError
        A file cannot be read, or belongs to another run.
    """
    path = next((folder / name for name in (NAME, BEFORE) if (folder / name).exists()), None)
    if path is None:
        return None, None, None
    try:
        with h5netcdf.File(path) as file:
            if file.attrs.get("title") not in (FORMAT, TRANSFER):
                raise InputError(path, "is no file of CityPV's surfaces", CURE)
            suns, names = np.asarray(file["direction"][:], float), read_texts(file["surface_id"])
            known = set(OUTLINES) <= set(file.variables)
            outlines = Outlines(*(np.asarray(file[name][:]) for name in OUTLINES)) if known else None
            months = np.asarray(file[MONTHLY][:], float) if MONTHLY in file.variables else None
    except (OSError, KeyError, IndexError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(path, f"cannot be read as CityPV's surfaces ({error})", CURE) from error
    if names != surface_id or (outlines is not None and len(outlines.surface_start) != len(names) + 1):
        raise InputError(path, "does not belong to the faces.csv beside it", CURE)
    return suns, outlines, months


def read_texts(variable):
    """Texts of an open NetCDF file: list of str."""
    return [text.decode() if isinstance(text, bytes) else str(text) for text in variable[:]]
