"""faces.csv: a row for each surface of the city."""

import numpy as np
import pandas as pd

from ..progress import untold

WRITTEN = 0.7  # share of the time until all numbers are text


def write_faces(path, transfer, energy, tell=untold):
    """Write what was found of each surface.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    tell : callable, optional
        `tell(share)` is called after each column.
    """
    surfaces = transfer.surfaces
    columns = {
        "surface_id": surfaces.surface_id,
        "building_id": surfaces.building_id,
        "kind": surfaces.kind,
        "orientation": surfaces.orientation,
        "eligible": np.where(surfaces.eligible, "true", "false"),
        "area": surfaces.area,
        "surface_tilt": surfaces.surface_tilt,
        "surface_azimuth": surfaces.surface_azimuth,
        "covered_share": transfer.covered_share,
        "sky_view_factor": transfer.sky_view_factor,
        "diffuse_relative": transfer.diffuse_relative,
        "diffuse_relative_standard_error": transfer.diffuse_relative_standard_error,
        "direct_relative_annual": energy.direct_relative_annual,
        "direct_relative_annual_standard_error": energy.direct_relative_annual_standard_error,
        "poa_global_annual": energy.poa_global_annual,
        "full_load_hours": energy.full_load_hours,
        "full_load_hours_standard_error": energy.full_load_hours_standard_error,
    }
    table = pd.DataFrame(columns)
    # Six digits, and not more behind the point than any reader could use.
    for number, name in enumerate(columns):
        tell(WRITTEN * number / len(columns))
        if table[name].dtype.kind == "f":
            table[name] = [f"{value:.6g}" if np.isfinite(value) else "" for value in table[name].to_numpy()]
    table.to_csv(path, index=False, lineterminator="\n")
