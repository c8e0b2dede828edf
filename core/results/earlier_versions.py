"""Result folders of earlier versions, completed to what this one writes, so that they can be plotted and compared.

Their hours were DC before losses on open racks, only the paper's sectors counted, all open area carried modules, and
shapes and suns stand in transfer.nc. What they do not tell at all, such as months of surfaces, stays unknown.
"""

import h5netcdf
import numpy as np
import pandas as pd

from ..city.classify import PAPER
from ..city.grid_cells import Outlines
from ..settings.errors import InputError
from .transfer_file import FORMAT, OUTLINES

LIGHT = "transfer.nc"
MONTHLY = [f"full_load_hours_{number:02d}" for number in range(1, 13)]  # columns of `citypv simulate --monthly`
SETTINGS = {
    "sectors": PAPER,
    "hidden_walls": None,
    "usable": {},
    "mounting": "open-rack",
    "method": None,
}
NOTHING = {"count": 0, "area": 0.0}


def complete_summary(summary):
    """Fill in what summary.json of an earlier version lacks."""
    settings, totals = summary["settings"], summary["totals"]
    if "mwh_dc_per_year" not in totals:  # whatever was set
        settings |= {"losses": 0.0, "inverter": None}
        totals["mwh_dc_per_year"] = totals["mwh_per_year"]
    summary["settings"] = SETTINGS | settings
    traced = (summary.get("traced") or {}).get("request") or {}
    summary.setdefault("sky", traced.get("sky", settings.get("sky", "isotropic")))
    flat = totals.get("flat_roofs")
    summary["totals"] = {"kinds": {"flat": flat} if flat else {}, "without_modules": {}, "dark": NOTHING} | totals


def complete_faces(faces, summary):
    """Add columns of areas that faces.csv of an earlier version lacks."""
    settings = summary["settings"]
    if "open_area" not in faces:
        faces["open_area"] = faces["area"]
    if "module_area" not in faces:
        counted = faces["area" if settings["hidden_walls"] == "count" else "open_area"]
        faces["module_area"] = counted * [settings["usable"].get(kind, 1.0) for kind in faces["kind"]]


def complete_groups(groups, longitude):
    """Rows of groups.csv with errors, and with hours in solar time, of a place [°] to the nearest hour."""
    if "full_load_hours_standard_error" not in groups:
        groups["full_load_hours_standard_error"] = np.nan
    if (groups["period"] == "solar_hour").any():
        return groups
    hours = groups[groups["period"] == "hour"].copy()
    hours["index"] = (hours["index"] + round(longitude / 15)) % 24
    return pd.concat([groups, hours.assign(period="solar_hour")], ignore_index=True)


def read_light(folder, faces):
    """Suns, outlines and hours by month, as of `surfaces_file.read_surfaces`: from transfer.nc, and from `faces`.

    Raises
    ------
    InputError
        transfer.nc is missing or damaged, or belongs to another run.
    """
    path = folder / LIGHT
    try:
        with h5netcdf.File(path) as file:
            if file.attrs.get("title") != FORMAT:
                raise InputError(path, "is no transfer.nc of CityPV", "compute the folder again, by citypv simulate")
            suns = np.asarray(file["direction"][:], float)
            names = [name.decode() if isinstance(name, bytes) else str(name) for name in file["surface_id"][:]]
            known = set(OUTLINES) <= set(file.variables)
            outlines = Outlines(*(np.asarray(file[name][:]) for name in OUTLINES)) if known else None
    except (OSError, KeyError, IndexError) as error:
        raise InputError(path, f"cannot be read ({error})", "compute the folder again, by citypv simulate") from error
    if names != faces["surface_id"].tolist():
        raise InputError(path, "does not belong to the faces.csv beside it", "give a folder as it was written")
    months = faces[MONTHLY].to_numpy(float) if set(MONTHLY) <= set(faces) else None
    return suns, outlines, months
