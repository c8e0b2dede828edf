"""Trace a scene whose trees lose their leaves: once in leaf and once bare, with the same random numbers."""

from dataclasses import replace

from ..city.canopy import forget_rays
from ..settings.progress import CancelledError
from .kept_matrix import keep_columns


def trace_seasons(trace, scene, suns, request, *, progress, folder, prepared):
    """Transfer of a scene; with deciduous trees that in leaf, with the bare one as its `bare`.

    Parameters
    ----------
    trace : callable
        The estimator.
    scene, suns, request, progress, folder
        As of the estimator.
    prepared : PreparedScene

    Raises
    ------
    CancelledError
        It was cancelled before the suns of the second state: one alone does not stand for the year.
    """
    transfer = trace(scene, suns, request, progress, folder, prepared=prepared)
    foliage = prepared.plan.foliage
    if foliage is None or not foliage.seasonal:
        return transfer
    if transfer.record.interrupted:
        raise CancelledError
    bare = trace(scene, suns, request, progress, folder, prepared=replace(prepared, bare=True))
    forget_rays(foliage.kept)
    if bare.record.interrupted:
        transfer = replace(
            transfer,
            suns=bare.suns,
            visible_share=keep_columns(transfer.visible_share, len(bare.suns)),
            direct_reflected=keep_columns(transfer.direct_reflected, len(bare.suns)),
            record=replace(transfer.record, interrupted=bare.record.interrupted),
        )
    return replace(transfer, bare=bare, leaf_months=foliage.months)
