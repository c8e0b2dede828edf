"""Modules of an edited city, and what their strings lose: of surfaces that the edit changes; all
others keep theirs.
"""

from dataclasses import replace

import numpy as np

from ..city.city import number_names
from ..modules.lay_modules import ModuleLayout
from .string_shade import (
    add_losses,
    asks_for_strings,
    empty_losses,
    find_carriers,
    lay_carriers,
    table_of_strings,
)
from .taken_parts import outline_taken, share_taken


def lay_changed(edit, prepared):
    """Lay modules on surfaces whose shape, or what is taken of them, the edit changes: written to
    the Edit's GatherContext, with what is taken of all.

    Parameters
    ----------
    edit : Edit
    prepared : PreparedScene
        Of the edited city.
    """
    context, before = edit.context, edit.before.states[0].transfer
    covered, edit.laid = edit.traced[0].covered, _find_changed(edit)
    # What is taken of surfaces that did not change is known.
    covered_share, no_room = share_taken(context.patch_to_surface, covered, edit.cramped)
    shares = np.where(edit.laid[:, None], covered_share[:, None] + no_room, 0.0)
    parts = outline_taken(prepared.scene, covered, edit.cramped, shares)
    same = np.flatnonzero(~edit.laid[: len(before.surfaces)])
    parts[same] = before.taken_parts[same]
    context.taken = covered_share, no_room, parts
    # Modules of the city before where they are known, and new ones.
    if asks_for_strings(prepared, context):
        known = edit.before.context.layout
        if known is None:
            edit.laid[:] = True
        new = lay_carriers(prepared, context, find_carriers(context) & edit.laid)
        kept = [] if known is None else [known.take(~edit.laid[known.surface])]
        context.layout = ModuleLayout.join([*kept, new])


def _find_changed(edit):
    """Surfaces on which modules may lie otherwise than before: (n,) bool."""
    context, old = edit.context, edit.before
    surfaces, count, first = context.surfaces, len(old.context.surfaces), len(old.context.patches)
    # Patches that came and went, and those that are covered otherwise or have other room.
    patches = np.ones(len(context.patches), bool)
    patches[:first] = context.patches.receives[:first] != old.context.patches.receives
    patches[:first] |= (edit.traced[0].covered[:first] != old.states[0].traced.covered).any(axis=1)
    patches[:first] |= (edit.cramped[:first] != old.cramped).any(axis=1)
    changed = np.zeros(len(surfaces) + 1, bool)  # the last one: no surface
    changed[context.owner[patches]] = True
    changed[:count] |= surfaces.eligible[:count] != old.context.surfaces.eligible
    # Storeys begin at the lowest point of a building, and cells of a grid are one polygon.
    building = number_names([str(name) for name in surfaces.building_id])
    return np.isin(building, building[changed[:-1]])


def change_losses(edit):
    """Write what strings lose at each sun to the SunLight of each state: from bits where modules or
    bits changed.
    """
    context = edit.context
    if not context.knows_strings:
        return
    asked = np.append(edit.laid, False)  # the last one: no surface
    asked[context.owner[edit.anew | edit.touched]] = True
    asked, strings = asked[:-1], None
    if context.layout is not None:
        layout = context.layout.take(asked[context.layout.surface])
        strings = table_of_strings(replace(context, layout=layout), edit.task.watch)
    for state, (direct, bits) in enumerate(zip(edit.direct, edit.task.bits, strict=True)):
        losses = direct.string_loss = empty_losses((len(asked), len(edit.task.suns)))
        known = edit.state_before(state).direct.string_loss
        if strings is not None and known is not None:
            losses[: len(known)] = known
            losses[asked] = 0
        if strings is not None:
            add_losses(strings, bits, losses)
