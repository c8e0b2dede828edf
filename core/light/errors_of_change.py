"""Errors of what an edit changes: the same rays, points and replicates before and after, whose
noise cancels.

Of a patch that both cities have, the noise of the difference is told from the differences of its
replicates and points; a patch that only one of them has adds its own. So what no changed ray
reaches differs by nothing, and without error. The suns are the same in both: what their choice
changes in the one, it changes in the other, and does not count.
"""

from dataclasses import replace

import numpy as np

from .direct_errors import variance_of_neighbours
from .merge_transfers import whole_error
from .trace_gather import SUNS, join_seasons
from .traced import SKY_DOME
from .transfer import ErrorParts, variance_of_mean


def errors_of_difference(before, after):
    """Transfer of the surfaces that both cities have, with the errors of the difference as its own.

    Standard errors of full load hours from it (`energy.standard_errors`) hold for hours after less
    hours before: light becomes hours as on the surface where it has more light. One that is hidden
    by an edit makes no power at all, but what it made before was known no better for that.

    Parameters
    ----------
    before, after : EditableCity

    Returns
    -------
    transfer : Transfer
        Of r surfaces.
    rows : (2, r) int
        Their rows before and after, in the scenes of the two.
    """
    # Surfaces by name in both cities, in leaf and bare.
    names = [one.city.transfer.surfaces.surface_id for one in (before, after)]
    number = {names[0][row]: row for row in before.rows.tolist()}
    pairs = [(number[names[1][row]], row) for row in after.rows.tolist() if names[1][row] in number]
    rows = np.array(pairs, int).reshape(-1, 2).T
    cities = before.city, after.city
    most = max(cities, key=lambda city: len(city.states))
    differences = [_difference_of_state(cities, rows, state) for state in range(len(most.states))]
    differences = join_seasons(differences, most.prepared.plan.foliage)
    return replace(differences, record=replace(differences.record, sun_sampling=None)), rows


def _take_brighter(one, other, rows):
    """Surfaces that two cities have, each as in the one where it has more light in a year:
    Transfer.

    Parameters
    ----------
    one, other : TracedState
    rows : (2, r) int
    """
    # Light of all suns on each surface; rows of one city are replaced where the other is brighter.
    light = [
        city.of_surfaces[some].sum(axis=1) for city, some in zip((one, other), rows, strict=True)
    ]
    brighter = np.flatnonzero(light[0] > light[1])
    taken, before = other.transfer.take(rows[1]), one.transfer.take(rows[0][brighter])
    parts = [(taken, before), (taken.surfaces, before.surfaces)]
    parts += [(source, before.sources[name]) for name, source in taken.sources.items()]
    for part, those in parts:
        for name, values in vars(part).items():
            if isinstance(values, np.ndarray):
                values[brighter] = getattr(those, name)
    return taken


def _difference_of_state(cities, rows, state):
    """Errors of the change in one state of the trees, 0 in leaf, 1 bare: Transfer.

    Parameters
    ----------
    cities : tuple of two TracedCity
        Before and after the edit.
    rows : (2, r) int
        Surfaces that both have, by their place in either.
    state : int
    """
    # Patches that send the same rays in both, and the row of the surface that each lies on.
    place = _same_patches(*(city.prepared.patches for city in cities))
    # A city without a bare state is in leaf all year: that state counts.
    one, other = pairs = [city.states[min(state, len(city.states) - 1)] for city in cities]
    row_of = []
    for city, some in zip(cities, rows, strict=True):
        number = np.full(len(city.prepared.scene.surfaces) + 1, -1)
        number[some] = np.arange(len(some))
        row_of.append(number[city.context.owner])
    # weights  share of a patch in its surface's mean.
    weights = [
        np.asarray(city.context.patch_to_surface.sum(axis=0)).ravel()[:, None] for city in cities
    ]

    def add(values, variance):
        """Variance of the surfaces' difference from the variance of patches, (p, k) of both
        cities."""
        # Where a patch is in both, its noise is of the difference of its replicates;
        old, new = (weight * part for weight, part in zip(weights, values, strict=True))
        both = (place >= 0) & (row_of[0][place] == row_of[1])
        new[both] -= old[place[both]]
        # a patch that is only in one has its own noise.
        alone = np.ones(len(old), bool)
        alone[place[both]] = False
        total = np.zeros(rows.shape[1] + 1)
        for members, of_patch in (
            (row_of[1], variance(new)),
            (row_of[0], np.where(alone, variance(old), 0)),
        ):
            # the last one is for all others
            total += np.bincount(members % len(total), of_patch, len(total))
        return total[:-1]

    # Light that others pass on, and discretisation, differ surface by surface with their signs.
    lights = {name: (one.lights[name], other.lights[name]) for name in other.lights}
    transported, left = (
        {
            name: getattr(b.error, part)[rows[1]] - getattr(a.error, part)[rows[0]]
            for name, (a, b) in lights.items()
        }
        for part in ("transported", "discretisation")
    )
    # Own noise of dome, suns and sources from the differences of replicates, and of shadow points.
    by_replicate = {name: [light.by_replicate for light in pair] for name, pair in lights.items()}
    own = {name: add(values, variance_of_mean) for name, values in by_replicate.items()}
    points = add([one.direct.annual.by_point for one in pairs], variance_of_neighbours)
    # Dome and suns are seen by the same rays: their covariance follows from the noise of their sum.
    both = add(
        [a + b for a, b in zip(by_replicate[SUNS], by_replicate[SKY_DOME], strict=True)],
        variance_of_mean,
    )
    covariance = (both - own[SUNS] - own[SKY_DOME]) / 2
    own[SUNS] += points
    if any(
        city.prepared.plan["specular"].on for city in cities
    ):  # photons of both runs are independent
        for name, pair in lights.items():
            own[name] += sum(light.error.own[some] for light, some in zip(pair, rows, strict=True))
    # All parts together, in a Transfer that `standard_errors` understands; its light is of the city
    # in which a surface has more.
    error = {name: whole_error(own[name], transported[name], left[name]) for name in lights}
    taken = _take_brighter(one, other, rows)
    return replace(
        taken,
        diffuse_relative_standard_error=error[SKY_DOME],
        direct_annual_standard_error=error[SUNS],
        error_parts=ErrorParts(
            diffuse_passed_on=transported[SKY_DOME],
            direct_passed_on=transported[SUNS],
            diffuse_discretisation=left[SKY_DOME],
            direct_discretisation=left[SUNS],
            covariance=covariance,
            direct_points=points,
        ),
        sources={
            name: replace(light, standard_error=error[name])
            for name, light in taken.sources.items()
        },
    )


def _same_patches(before, after):
    """The patch before an edit that sends the same rays as each patch after it: (p,) int, -1 where
    there is none.
    """
    place = np.full(len(after), -1)
    # Same random key, and then the same corner and edges: a patch that was moved is another.
    rows = [np.flatnonzero(one.receives) for one in (before, after)]
    keys = [one.key[own] for one, own in zip((before, after), rows, strict=True)]
    _, one, other = np.intersect1d(*keys, return_indices=True)
    one, other = rows[0][one], rows[1][other]
    same = (before.corner[one] == after.corner[other]).all(axis=1)
    same &= (before.edges[one] == after.edges[other]).all(axis=(1, 2))
    place[other[same]] = one[same]
    return place
