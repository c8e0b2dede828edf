"""Sum irradiance and power of a block of surfaces over all hours.

A traced sun represents hours around it. It may be just behind a wall, where nothing is traced,
while the sun of an actual hour is just in front of it:

        wall
         |   × actual hour
         |
      ×  |       the traced sun gets the visible share of the sky in front of the wall
         |
"""

from dataclasses import dataclass

import numpy as np

from .power import ac_power, dc_factor
from .strings_in_shade import kept_by_strings


@dataclass
class Block:
    """Data of some surfaces for the loop over hours: light is what their open part gets."""

    normal: np.ndarray  # (3, n)
    diffuse: np.ndarray  # (n,) per DHI
    far_ground: np.ndarray  # (n,) per direct horizontal irradiance
    sky: np.ndarray  # (n,) the part of `diffuse` that comes directly from the sky
    # (2 k, n) per irradiance of k traced sources: brighter, and then darker than the dome
    sources: np.ndarray
    source_view: np.ndarray  # (2 k, n) the part of `sources` that comes directly from there
    # (2 + k, n) incidence angle modifiers of light from the sky, reflected light, and the sources'
    iam: np.ndarray
    visible_share: np.ndarray  # (s, n), filled in for suns just behind
    reflected: np.ndarray  # (s, n) per DNI
    group_weight: np.ndarray  # (n, g) share of the group's area, of the open part
    mounting: np.ndarray  # (n,) int, column of `Hours.heating`
    lit_share: np.ndarray  # (n,) of the whole surface, on which this light falls
    # (s, d, n) uint8, what strings lose, as of `string_shade.add_losses`; None: nothing, or unknown
    string_loss: np.ndarray | None = None

    @staticmethod
    def take(transfer, rows, *, group_weight, iam, mounting, lit_share, sky=None):
        """Extract some surfaces of a Transfer.

        A Transfer has means over whole surfaces. Covered parts are dark and carry no modules:
        modules on the rest get the mean divided by its share. Light of the k traced parts of a sky
        is per irradiance in their units. A part darker than the dome takes light away, from no
        surface more than the dome gives it.

        Parameters
        ----------
        transfer : Transfer
        rows : numpy.ndarray, (n,) int
            The surfaces.
        group_weight : numpy.ndarray, (n, g)
            Share of each group's area, of whole surfaces.
        iam : numpy.ndarray, (2 + k, n)
            Of these surfaces, from `diffuse_incidence_factors`, in the precision to compute in.
        mounting : numpy.ndarray, (n,) int
            Of these surfaces, from `PvSystem.mounting_of`.
        lit_share : numpy.ndarray, (n,)
            Of these surfaces, from `counted_area.find_lit_share`.
        sky : SkyParts, optional
            By default without traced parts.

        Returns
        -------
        Block
        """
        dtype, lit = iam.dtype, np.asarray(lit_share, iam.dtype)
        light = views = np.zeros((0, len(rows)))
        # Of each traced source what comes straight from it, and what the city reflects of it. A
        # source darker than the dome takes away no more than the dome's light that the surface
        # sees. Each stands there twice, without this limit for hours in which it is brighter, and
        # with it for the others.
        if sky is not None and sky.sources:
            traced = [transfer.sources[name] for name in sky.sources]
            view = np.stack([light.view_factor[rows] for light in traced])
            reflected = np.stack([light.relative[rows] for light in traced]) - view
            views = np.concatenate(
                [view, np.minimum(view, sky.caps[:, None] * transfer.sky_view_factor[rows])]
            )
            light = views + np.tile(reflected, (2, 1))
        # Means over the whole surface become light of its open part: all of it is divided by that
        # share.
        # What strings lose is left open: the caller sets it where power is wanted.
        return Block(
            normal=transfer.surfaces.normal[rows].T.astype(dtype),
            diffuse=transfer.diffuse_relative[rows].astype(dtype) / lit,
            far_ground=(transfer.far_ground_view_factor[rows] * transfer.ground_albedo).astype(
                dtype
            )
            / lit,
            sky=np.minimum(transfer.sky_view_factor[rows], transfer.diffuse_relative[rows]).astype(
                dtype
            )
            / lit,
            sources=light.astype(dtype) / lit,
            source_view=views.astype(dtype) / lit,
            iam=iam,
            visible_share=filled_share(transfer, rows, dtype) / lit,
            reflected=np.ascontiguousarray(transfer.direct_reflected[rows].T, dtype=dtype) / lit,
            group_weight=(group_weight * lit_share[:, None]).astype(dtype),
            mounting=mounting,
            lit_share=lit,
        )


@dataclass
class BlockSums:
    """Results of a block: sums over hours of means over whole surfaces."""

    direct_relative: np.ndarray  # (n,) over the sunny hours
    poa_global: np.ndarray  # (n,) [Wm⁻²]
    dc: np.ndarray  # (n,) DC power over nominal power
    by_month: np.ndarray  # (n, 12) AC power over nominal power, as what follows
    by_year: np.ndarray  # (n, y)
    capacity_factor: np.ndarray  # (h, g), of the block's part of each group
    # (n,) AC power over nominal power that strings lose, counted or not
    string_loss: np.ndarray


def sum_block(block, hours, model):
    """Sum up light and power of the surfaces of a block over all hours.

    Parameters
    ----------
    block : Block
    hours : Hours
        In the block's precision.
    model : PvlibCurves, PowerTables or None
        None skips power.

    Returns
    -------
    BlockSums
    """
    count, groups = block.normal.shape[1], block.group_weight.shape[1]
    dtype = block.normal.dtype
    # Hours are weighed in two ways: by 1 where the sun stands at least 2° high and above the
    # terrain, and by their light from the sun's place.
    weights = np.concatenate([hours.sunny * hours.open, hours.sunward], axis=1)
    direct_sums = np.zeros((2, count))
    dc, lost, by_month, by_year = (
        np.zeros(count),
        np.zeros(count),
        np.zeros((count, 12)),
        np.zeros((count, hours.year_count)),
    )
    of_groups = np.zeros((len(hours), groups), dtype)
    # Hours in portions of one month and one year, so that a product of matrices adds them up.
    for first, last in hours.chunks():
        part = hours.rows(first, last)
        projection, direct = direct_part(block, part)
        direct_sums += weights[first:last].T @ direct
        # Without a model only light is summed, and all power stays 0.
        if model is None:
            continue
        # DC power of each surface at each hour; then losses and inverter, summed by month, year and
        # group.
        *_, of_modules, kept = run_model(model, block, part, direct, projection)
        ones = np.ones(last - first, dtype)
        power = ac_power(of_modules, model.system)
        # What strings lose is summed up wherever it is known; power is less by it only with the
        # setting of strings.
        shaded = None if kept is None else kept < 1
        if shaded is not None and shaded.any():
            of_strings = of_modules[shaded] * kept[shaded]
            less = np.zeros_like(power)
            less[shaded] = power[shaded] - ac_power(of_strings, model.system)
            lost += ones @ less
            if model.system.strings == "string":
                power = power - less
                of_modules[shaded] = of_strings
        dc += ones @ of_modules
        sums = ones @ power
        by_month[:, part.month[0]] += sums
        # Hours have a year's number only where the weather has several whole years.
        if part.year[0] >= 0:
            by_year[:, part.year[0]] += sums
        of_groups[first:last] = power @ block.group_weight
    # Reflected and diffuse light is a product of sums over hours with the Transfer, and is added
    # once for all hours.
    relative, poa = _add_linear_parts(block, hours, weights, direct_sums)
    # The light and the power of the open part, as means over the whole surface.
    means = (sums * block.lit_share for sums in (relative, poa, dc))
    periods = (sums * block.lit_share[:, None] for sums in (by_month, by_year))
    return BlockSums(*means, *periods, of_groups, lost * block.lit_share)


def direct_part(block, hours):
    """Cosine of the angle of incidence, and direct irradiance per `sunward` without reflections:
    (h, n) [–] each.
    """
    projection = np.maximum(hours.direction @ block.normal, 0)
    direct = values_at(block.visible_share, hours.match, hours.match_weight)
    direct *= projection
    return projection, direct


def values_at(values, index, weight):
    """Values of the traced suns, (s, n), at the intervals that they represent: (t, n).

    Parameters
    ----------
    values : numpy.ndarray, (s, n)
        In any unit.
    index, weight : numpy.ndarray, (t, k)
        As of `SunMatch`. A single sun, k = 1, has the weight 1.
    """
    if index.shape[1] == 1:
        return np.take(values, index[:, 0], axis=0, mode="clip")
    parts = zip(index.T, weight.T, strict=True)
    return sum(np.take(values, one, axis=0, mode="clip") * share[:, None] for one, share in parts)


def run_model(model, block, hours, direct, projection):
    """POA irradiance and DC power at some hours; `direct` and `projection` are overwritten.

    Circumsolar light loses by the angle of incidence of direct light.

    Returns
    -------
    poa_direct, poa_diffuse : numpy.ndarray, (h, n)
        [Wm⁻²] Circumsolar light is part of the first; dome, traced parts of the sky, reflections
        and far ground of the second.
    dc : numpy.ndarray, (h, n)
        [–] DC power over nominal power, of modules with a maximum power point each.
    kept : numpy.ndarray, (h, n), or None
        Share of it that strings keep in shade; None where they lose nothing, or it is unknown.
    """
    # Direct light, and diffuse light of reflections under the traced suns nearby, of the dome, of
    # the far ground and of traced sources [Wm⁻²].
    direct *= hours.sunward
    diffuse = values_at(block.reflected, hours.match, hours.match_weight)
    diffuse *= hours.sunward
    diffuse += np.concatenate([hours.dome, hours.level], axis=1) @ np.stack(
        [block.diffuse, block.far_ground]
    )
    if hours.sources.any():
        diffuse += _split_sources(hours) @ block.sources
    # Effective light is what passes the glass: a modifier for reflected light on all, and its
    # difference for what comes from the sky and from each source.
    effective = diffuse
    if (block.iam < 1).any():
        sky, reflected, *sources = block.iam
        effective = diffuse * reflected + hours.dome * (block.sky * (sky - reflected))
        if sources:
            effective += _split_sources(hours) @ (
                block.source_view * (np.stack([*sources, *sources]) - reflected)
            )
    kept = None
    if block.string_loss is not None:
        kept = kept_by_strings(block.string_loss, hours, direct, diffuse, projection)
    dc = dc_factor(
        model, direct, diffuse, effective, projection, hours=hours, mounting=block.mounting
    )
    return direct, diffuse, dc, kept


def _split_sources(hours):
    """Light of traced sources that are brighter, and then darker than the dome: (h, 2 k) [Wm⁻²]."""
    return np.concatenate([np.maximum(hours.sources, 0), np.minimum(hours.sources, 0)], axis=1)


def _add_linear_parts(block, hours, weights, direct_sums):
    """Add the parts that are linear in the Transfer to the sums over hours.

    Parameters
    ----------
    block : Block
    hours : Hours
    weights : numpy.ndarray, (h, 2)
        1 for each sunny hour, and what comes from the place of the sun.
    direct_sums : numpy.ndarray, (2, n)
        Sums of the direct irradiance with these weights.

    Returns
    -------
    relative, poa : numpy.ndarray, (n,)
        Sum of the relative direct irradiance, and of the global irradiance on the surfaces [Wm⁻²].
    """
    # Direct light without reflections was summed hour by hour; the rest is the sum of weights times
    # the Transfer, whose rows do not change from hour to hour.
    sums = direct_sums.copy()
    weights = weights.astype(float)
    # level  direct light on level ground, which the far ground reflects, with either weight.
    level = hours.sunny * hours.open * np.maximum(hours.direction[:, 2:], 0.0), hours.level
    for row in range(2):
        # How much each traced sun stands for, times what the surface gets by reflections under it.
        share = weights[:, row, None] * hours.match_weight
        per_sun = np.bincount(
            hours.match.ravel(), weights=share.ravel(), minlength=len(block.reflected)
        )
        sums[row] += per_sun @ block.reflected
        sums[row] += float(level[row].sum(dtype=float)) * block.far_ground.astype(float)
    poa = sums[1] + float(hours.dome.sum(dtype=float)) * block.diffuse.astype(float)
    return sums[0], poa + _split_sources(hours).sum(axis=0, dtype=float) @ block.sources.astype(
        float
    )


def filled_share(transfer, rows, dtype=np.float32):
    """Visible share of some surfaces of a Transfer for each sun, (s, n); of suns behind them their
    openness.

    Parameters
    ----------
    transfer : Transfer
    rows : numpy.ndarray or slice
        n surfaces.
    dtype : numpy dtype
    """
    normal = transfer.surfaces.normal[rows].T
    visible = np.array(transfer.visible_share[rows].T, dtype, order="C")
    # The visible share of the part of the sky that each faces.
    openness = np.clip(
        transfer.sky_view_factor[rows] / np.maximum((1.0 + normal[2]) / 2.0, 1e-9), 0.0, 1.0
    )
    # Up to a cosine of a millionth a sun counts as behind.
    np.copyto(visible, openness.astype(dtype), where=transfer.suns.direction @ normal <= 1e-6)
    return visible
