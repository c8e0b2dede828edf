"""Assign a BRDF to every triangle, from albedos and materials."""

from typing import NamedTuple

import numpy as np

from ..city.city import whole_of_cell
from ..read.open_input import read_rows
from ..settings.errors import InputError, id_of_cell
from .brdfs import Lambertian
from .materials import MaterialSpec, describe_brdf

FILE = "--albedo-file"  # a source of an albedo


class Found(NamedTuple):
    """BRDF of a surface, and its source."""

    source: str
    name: str  # key in that source; "" for a surface's own line, or if one value applies to all
    material: str  # name of the material, "" if only an albedo is given
    brdf: object  # Lambertian, Mirror, Glossy or Glass

    @property
    def is_diffuse(self):
        """Whether it reflects by Lambert's law."""
        return isinstance(self.brdf, Lambertian)

    @property
    def reflects(self):
        """How it reflects, in words: str."""
        return describe_brdf(self.brdf)


class TriangleBrdfs(NamedTuple):
    """Laws of reflection other than Lambert's, and which triangles follow them."""

    brdfs: list  # of Mirror, Glossy and Glass
    index: np.ndarray  # (t,) int into `brdfs`; -1 for Lambertian triangles


HEADERS = (["surface", "albedo"], ["surface", "material"], ["surface", "albedo", "material"])


def albedo_of_triangles(scene, request, materials=None):
    """Albedo of the scene's triangles: (t,) float64; the highest one where it depends on the angle.

    Parameters
    ----------
    scene : Scene
    request : Request
    materials : list of Found, optional
        Of `name_brdfs`, where it is known already.

    Raises
    ------
    InputError
        If the albedo file or a material is invalid, or is not supported by the estimator.
    """
    materials = name_brdfs(scene, request) if materials is None else materials
    distinct, which = _list_distinct(materials)
    albedo = np.array([one.brdf.albedo for one in distinct])[which[scene.surface_of_triangle]]
    if scene.rack_of_back is not None:
        albedo[scene.rack_of_back >= 0] = scene.back_albedo
    return albedo


def brdfs_of_triangles(scene, request, materials=None):
    """Laws of reflection other than Lambert's, and which triangles follow them.

    Parameters as of `albedo_of_triangles`.

    Returns
    -------
    TriangleBrdfs
    """
    distinct, which = _list_distinct(name_brdfs(scene, request) if materials is None else materials)
    brdfs = list(dict.fromkeys(one.brdf for one in distinct if not one.is_diffuse))
    place = {brdf: index for index, brdf in enumerate(brdfs)}
    brdf_index = np.array([place.get(one.brdf, -1) for one in distinct])[
        which[scene.surface_of_triangle]
    ]
    if scene.rack_of_back is not None:
        brdf_index[scene.rack_of_back >= 0] = -1  # undersides and edges of racks are Lambertian
    return TriangleBrdfs(brdfs, brdf_index)


def _list_distinct(materials):
    """The objects of a list, each once in the order of their first places, and which of them stands
    in each place.

    Most surfaces share one Found: looking at each of them takes longer than all else that is asked
    of materials.

    Returns
    -------
    distinct : list of Found
    which : (n,) int
    """
    _, first, which = np.unique(
        np.fromiter(map(id, materials), np.int64, len(materials)), True, True
    )
    order = np.argsort(first)
    return [materials[place] for place in first[order]], np.argsort(order)[which]


def name_brdfs(scene, request):
    """BRDF of each surface and, last, of the generated ground, with its source.

    In order of precedence: the albedo file's line for the surface, its line for the surface's
    material, the material itself (from `request.materials` or, with `request.file_materials`, from
    the city's files), the albedo file's line for the kind, `request.albedo`, or of ground
    `request.ground_albedo`. A cell ``id#k`` takes the line of ``id``.

    Returns
    -------
    list of Found
        n + 1.

    Raises
    ------
    InputError
        A line of the albedo file names nothing in the city, or materials are asked for of files
        that have none.
    """
    # Lines of the albedo file by what they name; one that names nothing in the city is an error.
    specs = read_albedo(request.albedo_file) if request.albedo_file else {}
    of_key = {key: (spec.material, spec.brdf()) for key, spec in specs.items()}
    surfaces = scene.surfaces
    names, kinds, materials = (
        surfaces.surface_id,
        surfaces.kind.tolist(),
        surfaces.material or [""] * len(surfaces),
    )
    whole = [whole_of_cell(name) for name in names] if of_key else names
    named = {*materials, request.ground_material} - {""}
    unused = set(of_key) - {*names, *whole, *named, *kinds, "ground"}
    if unused:
        raise InputError(
            request.albedo_file,
            f"{sorted(unused)[0]!r} is neither a surface nor a kind nor a material of this city",
            "use surface_id or kind as in faces.csv, or a material as `citypv inspect` lists them",
        )
    # Materials by name, from files or settings; a line of the albedo file goes before.
    of_name = {}
    if request.file_materials:
        # Materials of the files were asked for: an error where they have none.
        if not scene.colours:
            raise InputError(
                "--materials",
                "the files of this city have no materials",
                "omit it, or use --albedo-file",
            )
        of_name = {
            name: MaterialSpec.of_name(name, colour) for name, colour in scene.colours.items()
        }
    of_name = {name: spec for name, spec in (of_name | request.materials).items() if spec}
    of_material = {
        name: Found("materials", name, name, _brdf_of_named(name, spec))
        for name, spec in of_name.items()
    }
    of_material |= {name: Found(FILE, name, name, of_key[name][1]) for name in named & set(of_key)}
    # What kinds have without any of these.
    plain = dict.fromkeys(kinds, Found("--albedo", "", "", Lambertian(request.albedo)))
    plain["ground"] = Found("--ground-albedo", "", "", Lambertian(request.ground_albedo))
    of_kind = plain | {
        kind: Found(FILE, kind, *of_key[kind]) for kind in {*kinds, "ground"} & set(of_key)
    }
    # From the surface's own line to its kind, whichever comes first.
    brdfs_of_surfaces = []
    for name, parent, material, kind in zip(names, whole, materials, kinds, strict=True):
        own = of_key.get(name) or of_key.get(parent)
        brdfs_of_surfaces.append(
            Found(FILE, "", *own) if own else of_material.get(material, of_kind[kind])
        )
    return [*brdfs_of_surfaces, of_material.get(request.ground_material, of_kind["ground"])]


def _brdf_of_named(name, spec):
    """BRDF of a material of the city, from its MaterialSpec; an error names the material."""
    try:
        return spec.brdf()
    except InputError as error:
        raise InputError(
            f"Material {name!r}", f"{error.source}: {error.problem}", error.cure
        ) from error


def check_materials(request):
    """Refuse an albedo file, or a material of the request, that cannot be used with any city.

    Raises
    ------
    InputError
    """
    if request.albedo_file:
        read_albedo(request.albedo_file)
    for name, spec in request.materials.items():
        if spec:
            _brdf_of_named(name, spec)


def describe_albedo(scene, request):
    """Sources of the albedos of the surfaces.

    Returns
    -------
    list of dict
        One per source, name in it and BRDF: `from`, `name`, `material` ("" if only an albedo is
        given), `albedo` (the highest one if it depends on the angle), `law` (lambertian, mirror,
        glossy, glass), `reflects` (the same in words), and count (`surfaces`) and `area` [m²] of
        the surfaces with it. The generated ground comes last, without these two.
    """
    return materials_of_surfaces(scene, name_brdfs(scene, request))["albedos"]


def materials_of_surfaces(scene, materials):
    """What a Transfer says of the surfaces it was traced with.

    Parameters
    ----------
    scene : Scene
    materials : list of Found
        Of `name_brdfs`.

    Returns
    -------
    dict
        `albedo` (n,) float64, `material` (n,) list of str, and `albedos`, a list as in
        `describe_albedo`.
    """
    *materials, ground = materials
    distinct, which = _list_distinct(materials)
    counts, areas = np.bincount(which), np.bincount(which, scene.surfaces.area)
    # One row for each albedo and where it is from, with number and area of its surfaces.
    rows = {}
    for one, more, area in zip(distinct, counts.tolist(), areas.tolist(), strict=True):
        count, whole = rows.get(one, (0, 0.0))
        rows[one] = count + more, whole + area
    rows = [*rows.items(), *([(ground, None)] if (scene.surface_of_triangle < 0).any() else [])]
    described = []
    for one, size in rows:
        row = {
            "from": one.source,
            "name": one.name,
            "material": one.material,
            "albedo": one.brdf.albedo,
        }
        row |= {"law": type(one.brdf).__name__.lower(), "reflects": one.reflects}
        described.append(row | (dict(zip(("surfaces", "area"), size, strict=True)) if size else {}))
    return {
        "albedo": np.array([one.brdf.albedo for one in distinct], float)[which],
        "material": [one.material for one in materials],
        "albedos": described,
    }


def read_albedo(path):
    """Read albedos or materials by surface id, by kind, or by the name of a material in the city's
    files.

    Parameters
    ----------
    path : str or path-like
        CSV with the header `surface,albedo`, `surface,material` or `surface,albedo,material`. A row
        may leave albedo or material empty.

    Returns
    -------
    dict of str to MaterialSpec

    Raises
    ------
    InputError
        If the file cannot be read, has other columns, or holds an albedo that is not a number from
        0 to 1 or a material that is not known.
    """
    rows = read_rows(path, "give a CSV file with the columns surface,albedo")
    header = next(rows, None)
    if header not in HEADERS:
        raise InputError(path, "line 1 is not the header surface,albedo", "add it")
    specs = {}
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise InputError(
                path,
                f"line {number} is not "
                f"{'a name and a number' if header == HEADERS[0] else 'as the header'}",
                f"write {','.join(['name', *header[1:]])}",
            )
        cells = dict(zip(header, row, strict=True))
        specs[id_of_cell(row[0])] = _spec_of_row(
            path, number, cells.get("albedo", ""), cells.get("material", "")
        )
    return specs


def _spec_of_row(path, number, albedo, material):
    """MaterialSpec of a line of the file, checked to give a valid BRDF."""
    try:
        spec = MaterialSpec(float(albedo) if albedo or not material else None, material)
        spec.brdf()
    except InputError as error:
        raise InputError(
            path, f"line {number}: {error.source} {error.problem}", error.cure
        ) from error
    except ValueError as error:
        raise InputError(
            path, f"line {number} is not a name and a number", "write name,albedo"
        ) from error
    return spec
