"""Environments: the eligible surfaces of traced cities, or unshaded planes, ready to be placed
anywhere on Earth.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..city.classify import PAPER
from ..city.scene import Surfaces
from ..city.site import Site
from ..effects.closed_form import ground_view_of_tilt, sky_view_of_tilt
from ..energy.counted_area import classify_again
from ..energy.grouped_surfaces import group_surfaces
from ..energy.sum_block import Block
from ..light.transfer import SourceLight, Transfer
from ..results.transfer_file import read_transfer
from ..settings.errors import InputError
from ..sky.horizon_band import SOURCES
from ..sky.sky_models import model_traced, sources_of
from ..sun.sky_grid import SkyTriangles, sky_grid_suns
from ..sun.solar_position import sun_direction
from .group_errors import GroupErrors, find_group_errors
from .merge_surfaces import merge_surfaces

SINGLE = np.float32
SIDES = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


@dataclass
class _Environment:
    """The n eligible surfaces of a city in the order of their g groups, traced for the s directions
    of a sky grid.
    """

    name: str
    source: str  # file, or "closed form"
    groups: list  # (g,) of (kind, orientation)
    group_count: np.ndarray  # (g,) surfaces
    group_area: np.ndarray  # (g,) [m²] counted area
    first: np.ndarray  # (g + 1,) int64, first surface of each group, and n
    weight: np.ndarray  # (n,) float64, open area over the counted area of the group
    block: Block  # of the n surfaces, float32
    # (2 k + 1, n) float32: view of k traced sources, their reflected light; sky view factor
    sources: np.ndarray
    sky: SkyTriangles
    errors: GroupErrors | None = None  # of all surfaces, also where they are merged


def build_environment(name, source, transfer, system, sky_model="isotropic"):
    """Prepare the surfaces of a Transfer that the paper takes: facades and pitched roofs near four
    main directions.

    Parameters
    ----------
    name, source : str
    transfer : Transfer
        Traced with a sky grid.
    system : PvSystem
    sky_model : str
        Of `sky_models.MODELS`; the Transfer must have its traced sources.

    Returns
    -------
    Environment

    Raises
    ------
    InputError
        If the Transfer was traced for other suns, was interrupted, has no eligible surfaces, or
        holds at its own place only.
    """
    # It must hold elsewhere, and be whole.
    _check_portable(source, transfer)
    sources, sky = sources_of(sky_model), SkyTriangles.of(transfer.suns)
    # Surfaces that count in the paper's sectors, sorted by group.
    system = replace(system, sectors=PAPER, layout=None)
    transfer = classify_again(transfer, PAPER)
    grouped = group_surfaces(transfer, system, sky_model, source)
    groups, rows, block = grouped.groups, grouped.rows, grouped.block
    if not groups.names:
        raise InputError(
            source, "has no roof or facade with modules", "give an environment with buildings"
        )
    # Light of traced sources: what is seen of them, and reflected; and the view of the sky.
    traced = [transfer.sources[one.name] for one in sources]
    views = [light.view_factor[rows] for light in traced]
    reflected = [light.relative[rows] - view for light, view in zip(traced, views, strict=True)]
    light = (
        np.stack([*views, *reflected, transfer.sky_view_factor[rows]]) / block.lit_share
    ).astype(SINGLE)
    weight = groups.weight[rows, grouped.group] * block.lit_share
    first = np.searchsorted(grouped.group, np.arange(len(groups.names) + 1)).astype(np.int64)
    environment = _Environment(
        name, source, groups.names, groups.count, groups.area, first, weight, block, light, sky
    )
    return replace(environment, errors=find_group_errors(transfer, environment, rows, traced))


def _check_portable(source, transfer):
    """Refuse a Transfer that was not traced for the whole sky, or with what belongs to one place.

    Raises
    ------
    InputError
    """
    way, count, problem, cure = transfer.suns.sampling, len(transfer.suns), "", ""
    if not way.startswith("sky-grid"):
        problem = f"was traced with --suns {way}, which holds for one latitude only"
        cure = "trace it again: citypv simulate CITY --suns sky-grid:673 --out DIR"
    elif way != f"sky-grid:{count}":
        problem, cure = (
            f"holds {count} directions of {way}: its run was interrupted",
            "trace it again to the end",
        )
    elif transfer.terrain is not None:
        problem = "was traced with --horizon: distant terrain belongs to one place"
        cure = "trace it again without --horizon"
    elif transfer.bare is not None:
        problem = "has trees that are in leaf in some months only, which differ from place to place"
        cure = "trace it again with --leaf-months all, or none"
    if problem:
        raise InputError(source, problem, cure)


def unshaded_transfer(ground_albedo=0.25):
    """Transfer of eight surfaces of 10 m², which see nothing but sky and open ground.

    Parameters
    ----------
    ground_albedo : float

    Returns
    -------
    Transfer
        Facades and roofs of 35° towards north, east, south and west (paper, Eq. 9 and 11).
    """
    # Four facades and four roofs; the paper's have mean tilts of 28 to 42°.
    tilt = np.repeat([90.0, 35.0], 4)
    azimuth = np.tile(list(SIDES.values()), 2)
    normal = sun_direction(tilt, azimuth)  # a normal stands above its plane as a sun does
    kind, orientation = np.repeat(["facade", "roof"], 4), np.tile(list(SIDES), 2)
    names = ["_".join(pair) for pair in zip(kind, orientation, strict=True)]
    # The visible share is 1 in all directions of the sky grid: 16 will do.
    suns, count = sky_grid_suns(16), len(tilt)
    # View factors of tilted planes in the open.
    sky, ground = sky_view_of_tilt(normal), ground_view_of_tilt(normal)
    zero, no_id = np.zeros(count), [""] * count
    surfaces = Surfaces(
        names, names, no_id, kind, orientation, zero == 0, zero + 10.0, tilt, azimuth, normal
    )
    views = {name: source.unshaded(normal) for name, source in SOURCES.items()}
    return Transfer(
        surfaces=surfaces,
        site=Site(0.0, 0.0, 0.0, 0.0, None, (0.0, 0.0, 0.0)),
        suns=suns,
        covered_share=zero,
        sky_view_factor=sky,
        far_ground_view_factor=ground,
        ground_albedo=ground_albedo,
        diffuse_relative=sky + ground_albedo * ground,  # Eq. 9
        diffuse_relative_standard_error=zero,
        visible_share=np.ones((count, len(suns)), np.float32),
        direct_reflected=np.zeros((count, len(suns)), np.float32),
        direct_annual_standard_error=zero,
        sources={
            name: SourceLight(view, view, zero) for name, view in views.items()
        },  # the ground reflects nothing of them
    )


def read_environments(texts, system, sky="isotropic", most=None):
    """Environments from the command line's arguments.

    Parameters
    ----------
    texts : list of str
        "unshaded", a transfer.nc, or the folder of a run; "NAME=" before it gives a name, which is
        else the folder's name.
    system : PvSystem
    sky : {"isotropic", "perez", "auto"}
        Model of the sky; "auto": the one that all were traced for.
    most : int, optional
        Surfaces of each; others are merged, as by `merge_surfaces`.

    Returns
    -------
    environments : list of Environment
    sky : str
        A key of `settings.request.SKIES`.

    Raises
    ------
    InputError
        A text is not NAME=PATH, a file is missing, or two environments have one name.
    """
    cure = "give NAME=transfer.nc, a result folder, or unshaded"
    transfers = []
    # NAME=PATH, or a path alone that gives the name; "unshaded" is the closed form.
    for text in texts:
        name, equals, path = text.partition("=")
        if equals and not (name and path):
            raise InputError(text, "is not NAME=PATH", cure)
        if not equals:
            path, place = text, Path(text).absolute()
            name = (place.parent if place.name == "transfer.nc" else place).name.removesuffix(".nc")
        file = Path(path) / "transfer.nc" if Path(path).is_dir() else Path(path)
        if path == "unshaded":
            transfers.append((name, "closed form", unshaded_transfer()))
        elif file.exists():
            transfers.append((name, str(file), read_transfer(file)))
        else:
            raise InputError(file, "there is no such file", cure)
    # The sky that is asked for; "auto" is the best model that all Transfers were traced for.
    if sky == "auto":
        sky = model_traced(set.intersection(*(set(one.sources) for *_, one in transfers)))
    environments = [build_environment(*transfer, system, sky) for transfer in transfers]
    # Where a number is given, surfaces are merged until each environment has no more.
    if most:
        environments = [merge_surfaces(environment, most) for environment in environments]
    # Names tell environments apart in the file.
    names = [environment.name for environment in environments]
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        raise InputError(
            "ENVIRONMENT", f"two are called {double[0]!r}", "name them: NAME=transfer.nc"
        )
    return environments, sky
