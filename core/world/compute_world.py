"""Full load hours of environments at every place: the second half of the paper. Read this first.

    transfer.nc (sky grid) ─► Environment ─┐
                                           ├─► capacity factor of each hour and group ─► World ─►
                                           world.nc, pictures
    weather of many places ─► PlaceHours ──┘

One sky grid serves every latitude: the sun of each place and hour is looked up in it. Nothing is
averaged before the module's model: each surface, place and hour is computed, as by
`energy.compute_energy`.
"""

from dataclasses import dataclass

import numpy as np

from ..energy.counted_area import rank_group
from ..energy.power import tabulate_power
from ..settings.progress import silent
from ..settings.threads import map_in_order, usable_threads
from ..weather.grid_sources import Places
from .group_errors import carry_to_place
from .place_hours import HOURS, MONTHS, match_hours, match_shifted, prepare_place
from .sum_groups import sum_groups

PLAIN_PERIODS = 1 + MONTHS


@dataclass
class World:
    """Full load hours of g groups in e environments at p places."""

    places: Places
    environments: list  # (e,) str
    sources: list  # (e,) str, files of the environments
    groups: list  # (g,) of (kind, orientation)
    group_count: np.ndarray  # (e, g) surfaces; 0 where an environment lacks a group
    group_area: np.ndarray  # (e, g) [m²] counted area
    # (p, e, g, 61) float32 [h]: annual, 12 months, 24 hours UTC, 24 solar hours; NaN: none
    full_load_hours: np.ndarray
    # (p, e, g, 13) float32 [h] of the year and months, by what the Transfers know
    standard_error: np.ndarray
    gain_error: np.ndarray  # (p, e, g) float32, standard error of the year's gain by reflections
    without_reflections: np.ndarray  # (p, e, g, 13) float32 [h]: annual and months
    weather: np.ndarray  # (p,) int8, a key of grid_sources.MEANINGS
    label: str  # of the weather
    way: str  # exact or paper
    sky: str  # model of the diffuse sky
    years: float  # that the weather covers

    def columns_of(self, number):
        """Columns of the groups that an environment has, in their order: (k,) int."""
        return np.flatnonzero(self.group_count[number])


def compute_world(
    environments, source, system, way="exact", *, sky="isotropic", threads=None, progress=silent
):
    """Full load hours of all groups of some environments at the places of a source of weather.

    Parameters
    ----------
    environments : list of Environment
    source : Source
    system : PvSystem
    way : {"exact", "paper"}
        Sun of the place itself, or Greenwich's shifted in time.
    sky : str
        Model of the diffuse sky, of `settings.request.SKIES`, which the environments were built
        for.
    threads : int, optional
        By default all processors; the result does not depend on it.
    progress : callable, optional

    Returns
    -------
    World
        NaN at places without weather, and for groups that an environment lacks.
    """
    # The world without values, tables of power, and places of each environment's groups in it.
    world, model, done = empty_world(environments, source, way, sky), tabulate_power(system), 0
    own = [world.columns_of(number) for number in range(len(environments))]
    # Places in portions: their weather is read and computed in threads.
    computed = map_in_order(
        lambda chunk: [
            _compute_place(environments, *found, system, model, (way, sky))
            for found in source.read(chunk)
        ],
        source.chunks,
        usable_threads(threads),
    )
    progress("world", 0, len(source.places), "places")
    # Results in the order of places: hours with and without reflections, and their errors.
    for chunk, results in zip(source.chunks, computed, strict=True):
        for place, (code, years, hours) in zip(chunk, results, strict=True):
            world.weather[place] = code
            world.years = years or world.years
            for number, (values, errors) in enumerate(hours):
                count = len(own[number])
                world.standard_error[place, number, own[number]] = errors[:PLAIN_PERIODS].T
                world.gain_error[place, number, own[number]] = errors[PLAIN_PERIODS]
                world.full_load_hours[place, number, own[number]] = values[:, :count].T
                world.without_reflections[place, number, own[number]] = values[
                    :PLAIN_PERIODS, count:
                ].T
        done += len(chunk)
        progress("world", done, len(source.places), "places")
    return world


def empty_world(environments, source, way, sky):
    """World without any values yet; parameters as of `compute_world`."""
    # All groups of all environments; values by place, environment and group, unknown at first.
    groups = sorted(
        {pair for environment in environments for pair in environment.groups}, key=rank_group
    )
    shape = len(source.places), len(environments), len(groups)
    # Annual, months, hours of the day by UTC and by local mean solar time.
    period_count = 1 + MONTHS + 2 * HOURS
    world = World(
        source.places,
        [environment.name for environment in environments],
        [environment.source for environment in environments],
        groups,
        np.zeros(shape[1:], int),
        np.zeros(shape[1:]),
        np.full((*shape, period_count), np.nan, np.float32),
        np.full((*shape, PLAIN_PERIODS), np.nan, np.float32),
        np.full(shape, np.nan, np.float32),
        np.full((*shape, PLAIN_PERIODS), np.nan, np.float32),
        np.zeros(shape[0], np.int8),
        source.label,
        way,
        sky,
        1.0,
    )
    # Counts and areas of the groups that each environment has.
    for number, one in enumerate(environments):
        own = [groups.index(pair) for pair in one.groups]  # in the same order
        world.group_count[number, own], world.group_area[number, own] = (
            one.group_count,
            one.group_area,
        )
    return world


def _compute_place(environments, weather, code, system, model, ways):  # noqa: PLR0917
    """What the weather is, its years, and for each environment hours of periods, (61, 2 g), and
    errors, (14, g).
    """
    if weather is None:
        return code, None, []
    years = weather.year_count
    way, sky = ways
    hours = prepare_place(weather, system, years, sky)
    matched, computed = {}, []
    for environment in environments:
        if environment.sky.count not in matched:
            exact = way == "exact"
            matched[environment.sky.count] = (
                match_hours(environment.sky, hours)
                if exact
                else match_shifted(environment.sky, hours, weather)
            )
        sunlight = matched[environment.sky.count]
        values = hours.length * (hours.share @ sum_groups(environment, hours, sunlight, model))
        count = len(environment.groups)
        errors = carry_to_place(
            environment.errors, hours, sunlight, values[:PLAIN_PERIODS, :count], values[0, count:]
        )
        computed.append((values, np.vstack(errors)))
    return code, years, computed
