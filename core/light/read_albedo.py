"""How every triangle reflects: by its albedo, or by its material."""

import csv
from pathlib import Path

import numpy as np

from ..errors import InputError
from .brdf_lambertian import Lambertian
from .materials import brdf_of_material

HEADERS = (["surface", "albedo"], ["surface", "material"], ["surface", "albedo", "material"])


def albedo_of_triangles(scene, request):
    """Albedo of the scene's triangles: (t,) float64. Of what is no Lambertian surface the most that it reflects.

    Raises
    ------
    InputError
        If the albedo file cannot be used, or names a material that the estimator cannot follow.
    """
    return np.array([brdf.albedo for brdf in brdfs_of_surfaces(scene, request)])[scene.triangle_surface]


def finish_of_triangles(scene, request):
    """Laws of reflection other than Lambert's, and which triangles follow them.

    Returns
    -------
    brdfs : list
    finish : (t,) int
        Into `brdfs`; -1 where the triangle is Lambertian.
    """
    of_surface = brdfs_of_surfaces(scene, request)
    brdfs = list(dict.fromkeys(brdf for brdf in of_surface if not isinstance(brdf, Lambertian)))
    place = {brdf: index for index, brdf in enumerate(brdfs)}
    return brdfs, np.array([place.get(brdf, -1) for brdf in of_surface])[scene.triangle_surface]


def brdfs_of_surfaces(scene, request):
    """Law of reflection of each surface and, last, of the generated ground.

    What the albedo file says of a surface counts before what it says of its kind, and that before `request.albedo`.
    Generated ground takes the ground's albedo, unless the file names the kind `ground`.

    Returns
    -------
    list
        Of n + 1 laws.
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
    shiny = [name for name, brdf in of_key.items() if not isinstance(brdf, Lambertian)]
    if shiny and request.estimator == "gather":
        problem = f"{shiny[0]!r} reflects like a mirror, and gather spreads all light evenly"
        raise InputError(request.albedo_file, problem, "use --estimator forward, or give an albedo without material")
    plain = Lambertian(request.albedo)
    of_kind = [of_key.get(kind, plain) for kind in surfaces.kind.tolist()]
    of_surface = [of_key.get(name, brdf) for name, brdf in zip(surfaces.surface_id, of_kind, strict=True)]
    return [*of_surface, of_key.get("ground", Lambertian(request.ground_albedo))]


def read_albedo(path):
    """Read albedos or materials by surface id or by kind.

    Parameters
    ----------
    path : str or path-like
        CSV with the header `surface,albedo`, `surface,material` or `surface,albedo,material`. A row may leave albedo or
        material empty.

    Returns
    -------
    dict of str to law of reflection

    Raises
    ------
    InputError
        If the file cannot be read, has other columns, or holds an albedo that is not a number from 0 to 1 or a
        material that is not known.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            path, f"cannot be read ({error})", "give a CSV file with the columns surface,albedo"
        ) from error
    rows = csv.reader(text.splitlines())
    header = next(rows, None)
    if header not in HEADERS:
        raise InputError(path, "line 1 is not the header surface,albedo", "put it there")
    brdfs = {}
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            problem = f"line {number} is not {'a name and a number' if header == HEADERS[0] else 'as the header'}"
            raise InputError(path, problem, f"write {','.join(['name', *header[1:]])}")
        cells = dict(zip(header, row, strict=True))
        brdfs[row[0]] = brdf_of_row(path, number, cells.get("albedo", ""), cells.get("material", ""))
    return brdfs


def brdf_of_row(path, number, albedo, material):
    """Law of reflection of a line of the file."""
    if not material or albedo:
        try:
            value = float(albedo)
        except ValueError as error:
            raise InputError(path, f"line {number} is not a name and a number", "write name,albedo") from error
        if not 0 <= value <= 1:
            raise InputError(path, f"line {number}: albedo {albedo}", "give a number from 0 to 1")
    if not material:
        return Lambertian(value)
    try:
        return brdf_of_material(material, value if albedo else None)
    except InputError as error:
        raise InputError(path, f"line {number}: {error.source} {error.problem}", error.cure) from error
