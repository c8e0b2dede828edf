"""Join the Transfers of tiles into one of the whole city, in the order of its surfaces."""

from dataclasses import asdict, replace

import numpy as np

from ..light.merge_transfers import MATRICES
from ..light.sun_matrix import keep_matrix
from ..patches.read_albedo import materials_of_surfaces


def join_tiles(parts, prepared, request, figures, folder=None):
    """The Transfer of a city from its tiles' Transfers.

    Parameters
    ----------
    parts : iterable of ((m,) int, Transfer)
        Rows that a tile reports, and its Transfer of these; each row once. Read one after the
        other.
    prepared : PreparedScene
        Of the whole.
    request : Request
        As the user gave it.
    figures : list of dict
        Of `trace_part`, of each tile.
    folder : path-like, optional
        As of `keep_matrix`.

    Returns
    -------
    Transfer
    """
    scene, count = prepared.scene, len(prepared.scene.surfaces)
    whole, seen, records = None, np.zeros(count, np.int64), []
    for rows, part in parts:
        if whole is None:
            whole = _empty_like(part, scene, folder)
        if (
            part.bare is not None and whole.bare is None
        ):  # earlier tiles have no trees that lose their leaves
            bare = _empty_like(part.bare, scene, folder)
            _fill_rows(bare, slice(None), whole)
            whole = replace(whole, bare=bare, leaf_months=part.leaf_months)
        _fill_rows(whole, rows, part)
        if whole.bare is not None:
            _fill_rows(whole.bare, rows, part.bare or part)
        seen[rows] += 1
        records.append(part.record)
    if (seen != 1).any():
        raise ValueError(f"{int((seen != 1).sum())} surfaces are not in exactly one tile")
    record = _join_records(records, prepared.plan, request, figures)
    return replace(whole, record=record, **materials_of_surfaces(scene, prepared.materials))


def _empty_like(part, scene, folder):
    """A Transfer with room for all surfaces, of one state of the trees."""
    count = len(scene.surfaces)
    few = replace(part, bare=None, **{name: getattr(part, name)[:, :0] for name in MATRICES})
    return replace(
        few.take(np.zeros(count, int)),
        surfaces=scene.surfaces,
        **{name: keep_matrix((count, len(part.suns)), folder) for name in MATRICES},
        record=None,
        leaf_months=(),
    )


def _fill_rows(whole, rows, part):
    """Write the rows of a tile into arrays that have a row for each surface."""
    pairs = [(light, part.sources[name]) for name, light in whole.sources.items()]
    pairs += [(whole.error_parts, part.error_parts)] if whole.error_parts else []
    for columns, own in [(whole, part), *pairs]:
        for name, array in vars(columns).items():
            if isinstance(array, np.ndarray):
                array[rows] = getattr(own, name)


def _join_records(records, plan, request, figures):
    """TraceRecord of a city from its tiles' records.

    Parameters
    ----------
    records : list of TraceRecord
    plan : TracePlan
        Of the whole.
    request, figures
        As of `join_tiles`.

    Returns
    -------
    TraceRecord
        Rays and seconds are summed over the tiles, of shares of light the largest is taken,
        discretisation errors are averaged over the eligible area, and the error of sun sampling is
        taken from the one tile that measured it.
    """
    # Sums, largest values, and sums by key of what the tiles told.
    area = np.array([figure["area"] for figure in figures])
    fields = {
        name: sum(getattr(record, name) for record in records)
        for name in ("patches", "hemisphere_rays", "shadow_rays", "embree_thread_seconds")
    }
    fields |= {
        name: max(getattr(record, name) for record in records)
        for name in (
            "max_bounces",
            "brightest_albedo",
            "threads",
            "last_bounce_share_diffuse",
            "last_bounce_share_direct",
        )
    }
    for name in ("source_rays", "seconds", "processor_seconds"):
        pairs = [pair for record in records for pair in getattr(record, name).items()]
        fields[name] = {
            key: sum(value for own, value in pairs if own == key) for key in dict(pairs)
        }
    fields["cut_reflections"] = _largest_of_groups([record.cut_reflections for record in records])
    # Discretisation errors are means by eligible area, if every tile has one.
    weight, errors = (
        area if area.any() else np.ones(len(area)),
        [record.discretisation_error for record in records],
    )
    mean = None
    if None not in errors:
        mean = {
            key: float(np.average([error[key] or 0.0 for error in errors], weights=weight))
            for key in errors[0]
        }
    effects = []  # decisions for the whole, with the worst outcome of any tile
    for effect in plan.effects:
        told = [
            one["outcome"] for part in records for one in part.effects if one["key"] == effect.key
        ]
        left = max(
            (one["left_out"] for one in told if one and one["left_out"] is not None), default=None
        )
        holds = None if left is None or effect.bound is None else bool(left <= effect.bound)
        effects.append(
            asdict(effect)
            | {"outcome": None if left is None else {"left_out": left, "holds": holds}}
        )
    # What holds for all tiles is taken from the first.
    return replace(
        records[0],
        **fields,
        request=request.as_dict(),
        effects=effects,
        discretisation_error=mean,
        sun_sampling=next(filter(None, (figure["sun_sampling"] for figure in figures)), None),
        standard_error_unknown=next(
            filter(None, (record.standard_error_unknown for record in records)), None
        ),
    )


def _largest_of_groups(records):
    """Of the tiles' `cut_reflections` the largest share of each light in each group; None if one is
    unknown.
    """
    if None in records:
        return None
    largest_shares = {}
    for record in records:
        for name, shares in record.items():
            group = largest_shares.setdefault(name, dict(shares))
            for light, share in shares.items():
                group[light] = (
                    None
                    if None in (share, group.get(light, 0.0))
                    else max(share, group.get(light, 0.0))
                )
    return largest_shares
