"""The albedo of every triangle."""

import csv
from pathlib import Path

import numpy as np

from ..errors import InputError


def albedo_of_triangles(scene, request):
    """Albedo of the scene's triangles: (t,) float64.

    What the albedo file says of a surface counts before what it says of its kind, and that before `request.albedo`.
    Generated ground takes the ground's albedo, unless the file names the kind `ground`.
    """
    of_key = read_albedo(request.albedo_file) if request.albedo_file else {}
    surfaces = scene.surfaces
    unused = set(of_key) - set(surfaces.surface_id) - {*surfaces.kind.tolist(), "ground"}
    if unused:
        raise InputError(
            request.albedo_file,
            f"{sorted(unused)[0]!r} is neither a surface nor a kind of this city",
            "use surface_id or kind as in faces.csv",
        )
    of_kind = [of_key.get(kind, request.albedo) for kind in surfaces.kind.tolist()]
    of_surface = [of_key.get(name, albedo) for name, albedo in zip(surfaces.surface_id, of_kind, strict=True)]
    of_ground = of_key.get("ground", request.ground_albedo)
    return np.array([*of_surface, of_ground])[scene.triangle_surface]


def read_albedo(path):
    """Read albedos by surface id or by kind.

    Parameters
    ----------
    path : str or path-like
        CSV with the header `surface,albedo`.

    Returns
    -------
    dict of str to float

    Raises
    ------
    InputError
        If the file cannot be read, has other columns, or holds an albedo that is not a number from 0 to 1.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            path, f"cannot be read ({error})", "give a CSV file with the columns surface,albedo"
        ) from error
    rows = csv.reader(text.splitlines())
    if next(rows, None) != ["surface", "albedo"]:
        raise InputError(path, "line 1 is not the header surface,albedo", "put it there")
    albedos = {}
    for number, row in enumerate(rows, start=2):
        try:
            name, value = row
            albedos[name] = float(value)
        except ValueError as error:
            raise InputError(path, f"line {number} is not a name and a number", "write name,albedo") from error
        if not 0 <= albedos[name] <= 1:
            raise InputError(path, f"line {number}: albedo {value}", "give a number from 0 to 1")
    return albedos
