"""Capacity factors of the groups of an environment at each hour: the loop over hours and surfaces.

The arithmetic is as in `energy.sum_block` with `energy.power`, in one pass without arrays of hours
× surfaces.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

HALF_NODE, ONE, NONE = np.float32(0.5), np.float32(1), np.float32(0)


@dataclass
class Sunlight:
    """Which grid directions stand for the sun of each of h hours: m suns, with three directions
    each.
    """

    index: np.ndarray  # (h, m, 3) int64 into the grid
    # (h, m, 3) float32; over m and 3 they sum to 1, or to 0 without direct light
    weight: np.ndarray
    direction: np.ndarray  # (h, m, 3) float32, towards each sun
    level: np.ndarray  # (h,) float32 [Wm⁻²] of unshaded ground by DNI and circumsolar light


def sum_groups(environment, hours, sunlight, model):
    """Capacity factors of the groups, with all light and without any that was reflected.

    Parameters
    ----------
    environment : Environment
    hours : PlaceHours
    sunlight : Sunlight
    model : PowerTables

    Returns
    -------
    numpy.ndarray, (h, 2 g) float64
        Means over the counted area of each group: g with all light, g without reflections.
    """
    block = environment.block
    sums = np.zeros((len(hours.light), 2 * (len(environment.first) - 1)))
    suns = sunlight.index, sunlight.weight, sunlight.direction, sunlight.level
    heating = model.scale_heating(*hours.heating)
    place = hours.direction.astype(np.float32), hours.light, heating, hours.spectral_factor
    seen = block.visible_share, block.reflected, block.normal
    view, reflected = environment.sources[:-1].reshape(2, len(hours.caps), len(environment.weight))
    dark = np.minimum(view, hours.caps[:, None].astype(np.float32) * environment.sources[-1])
    sources = np.stack([view, dark]), reflected  # views of bright, and of dark sources
    surfaces = block.diffuse, block.far_ground, block.sky, block.iam, sources
    # of temperature; a tuple, so that the loop over them is vectorised
    powers = tuple(model.efficiency[::-1])
    tables = model.incidence, powers, model.diffuse_share, model.scales
    _loop(suns, place, seen, surfaces, tables, (environment.first, environment.weight), sums)
    return sums


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def _loop(suns, place, seen, surfaces, tables, groups, found):  # noqa: PLR0917
    """Fill `found`, (h, 2 g), hour by hour: power of g groups with all light, then of the g without
    reflections; see `sum_groups`. Inner loops are plain, so that they are vectorised.
    """
    # Power of each group at each hour: with all light, and without what is reflected.
    index, weight, sun, level = suns
    direction, light, heating, spectral = place
    diffuse, far_ground, sky, iam, (views, reflected) = surfaces
    east, north, up = seen[2]
    incidence, efficiency, diffuse_share, (angle_scale, root_scale, last_node) = tables
    first, area = groups
    count, group_count = len(diffuse), len(first) - 1
    direct, scattered, beam, low, caught_low, effective, total = np.zeros((7, count), np.float32)
    # Hour by hour: direct light of the traced suns around the hour, with what they reflect, and its
    # loss by the angle of incidence.
    for hour in range(len(light)):
        sunward, dome = light[hour, 0], light[hour, 1]
        direct[:], beam[:], scattered[:], low[:], caught_low[:] = NONE, NONE, NONE, NONE, NONE
        if sunward > NONE:
            for node in range(index.shape[1]):
                _add_sunlight(
                    sun[hour, node],
                    index[hour, node],
                    weight[hour, node] * sunward,
                    seen,
                    direct,
                    scattered,
                )
            # Direct sunlight after the modules' incidence angle modifier.
            x, y, z = direction[hour]
            for i in range(count):
                cosine = max(x * east[i] + y * north[i] + z * up[i], NONE)
                beam[i] = np.sqrt(max(ONE - cosine, NONE)) * angle_scale + HALF_NODE
            for i in range(count):
                beam[i] = incidence[np.uint32(beam[i])] * direct[i]
        for source in range(light.shape[1] - 2):
            # What comes from a traced source, before and after the modules' glass, and what is
            # reflected of it.
            bright = light[hour, 2 + source]
            # A source that is darker than the dome takes light away, but no more than its cap: its
            # views are others.
            view = views[0, source] if bright > NONE else views[1, source]
            back, passed = reflected[source], iam[2 + source]
            for i in range(count):
                low[i] += bright * view[i]
                caught_low[i] += bright * view[i] * passed[i]
                scattered[i] += bright * back[i]
        # Light on a surface in its surroundings: from the dome, reflected, from the far ground, and
        # of sources in the sky; then through its glass, to power by a table of efficiency at the
        # cell's temperature, and summed by groups, weighed by area.
        ground, hot, cold, passing = level[hour], heating[hour, 0], heating[hour, 1], spectral[hour]
        for i in range(count):
            straight = dome * sky[i]
            rest = scattered[i] + ground * far_ground[i] + dome * diffuse[i] + low[i]
            # Diffuse light after its incidence angle modifiers: of the dome, reflected, and of the
            # sources.
            caught = (
                (rest - low[i]) * iam[1, i] + straight * (iam[0, i] - iam[1, i]) + caught_low[i]
            )
            effective[i] = passing * (beam[i] + diffuse_share * caught)
            total[i] = (direct[i] + rest) * hot + cold
        _convert(effective, total, efficiency, root_scale, last_node)
        _add_groups(effective, area, first, found[hour, :group_count])
        # Without reflections of surroundings, a surface has what comes directly from sun and sky.
        for i in range(count):
            straight = dome * sky[i]
            effective[i] = passing * (
                beam[i] + diffuse_share * (straight * iam[0, i] + caught_low[i])
            )
            total[i] = (direct[i] + straight + low[i]) * hot + cold
        _convert(effective, total, efficiency, root_scale, last_node)
        _add_groups(effective, area, first, found[hour, group_count:])


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def _add_sunlight(sun, index, weight, seen, direct, scattered):  # noqa: PLR0917
    """Add one sun to the direct and the reflected sunlight of each surface [Wm⁻²]."""
    visible, reflected, normal = seen
    x, y, z = sun
    a, b, c = weight
    seen_a, seen_b, seen_c = visible[index[0]], visible[index[1]], visible[index[2]]
    back_a, back_b, back_c = reflected[index[0]], reflected[index[1]], reflected[index[2]]
    east, north, up = normal
    for i in range(len(direct)):
        cosine = max(x * east[i] + y * north[i] + z * up[i], NONE)
        direct[i] += (a * seen_a[i] + b * seen_b[i] + c * seen_c[i]) * cosine
        scattered[i] += a * back_a[i] + b * back_b[i] + c * back_c[i]


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def _convert(effective, temperature, efficiency, root_scale, last_node):
    """Replace effective irradiance by capacity factors, at scaled cell temperatures; the highest
    power comes first.
    """
    for i in range(len(effective)):
        bright = max(effective[i], NONE)
        node = np.uint32(min(np.sqrt(bright) * root_scale + HALF_NODE, last_node))
        value = NONE
        for power in efficiency:
            value = value * temperature[i] + power[node]
        effective[i] = value * bright


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def _add_groups(power, area, first, found):
    """Add the mean power of each group, weighted by area."""
    for group in range(len(found)):
        total = 0.0
        for i in range(first[group], first[group + 1]):
            total += area[i] * power[i]
        found[group] += total
