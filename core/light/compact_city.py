"""An edited city without what is gone: patches and surfaces get new numbers, in the order of the
city.

Hits name the patch that they met in the leading bits of their keys; all else is taken row by row.
"""

from dataclasses import fields, replace

import numpy as np

from ..city.written_scene import live_triangles, written_scene
from ..settings.progress import silent
from .editable_city import EditableCity, prepare_decided
from .form_factors import FormFactors, Rows
from .packed_bits import pack_bits
from .shadow_points import KnownPoints
from .solve_suns import prepare_suns
from .trace_all import prepare_gather
from .trace_gather import TracedCity, TracedState


def compact_city(base):
    """Drop patches and surfaces that edits took away: EditableCity."""
    old, rows = base.city, base.rows
    scene = old.prepared.scene
    # Nothing was taken away: the city stays as it is.
    if len(rows) == len(scene.surfaces) and (np.diff(rows) > 0).all():
        return base
    # Triangles that are still there, and their new numbers.
    kept = live_triangles(scene, rows)
    number = np.full(len(scene.triangles), -1)
    number[kept] = np.arange(len(kept))
    place = np.full(len(scene.surfaces), -1)
    place[rows] = np.arange(len(rows))
    # The scene without the others is prepared by the decisions of the base, not decided anew.
    prepared = prepare_decided(base.decisions, written_scene(scene, rows), base.request).build_tree(
        base.request
    )
    prepared = replace(prepared, editable=True, rules=old.prepared.rules)
    context = prepare_gather(prepared, base.request, silent)
    context = replace(
        context,
        left_out=old.context.left_out[kept],
        elements=old.context.elements,
        start_elements=old.context.start_elements,
        layout=old.context.layout and old.context.layout.renumber(place),
    )
    # In each state of trees: rows of patches, matrix, light and errors, of what is left.
    states = []
    for one in old.states:
        traced = _take(one.traced, kept)
        traced.first = {name: _take(light, kept) for name, light in one.traced.first.items()}
        if one.traced.form_factors is not None:
            traced.form_factors = _renumber(one.traced.form_factors, number, len(kept))
        lights = {
            name: replace(
                light,
                mean=light.mean[rows],
                error=_take(light.error, rows),
                by_replicate=light.by_replicate[kept],
            )
            for name, light in one.lights.items()
        }
        matrices = {
            name: _rows_of(getattr(one.direct, name), rows)
            for name in ("visible_share", "reflected", "string_loss")
        }
        direct = replace(
            one.direct, annual=_take(one.direct.annual, kept), specular=0.0, **matrices
        )
        states.append(TracedState(traced, lights, direct, one.transfer.take(rows)))
    # The suns, and what their rays met, likewise.
    task = prepare_suns(
        context,
        [state.traced for state in states],
        prepared.plan.without_hidden(base.suns),
    )
    watch = old.task.watch
    task.watch.points = KnownPoints(*(part[kept] for part in watch.points))
    bits = pack_bits(old.bits.unpack()[:, kept])
    city = TracedCity(prepared, context, task, states, old.cramped[kept], bits)
    return EditableCity(base.suns, base.request, city, np.arange(len(rows)), base.drift)


def _rows_of(matrix, rows):
    return None if matrix is None else np.asarray(matrix[rows])


def _take(part, rows):
    """Some rows of each array of a dataclass that has a row for each of them."""
    values = {field.name: getattr(part, field.name) for field in fields(part)}
    arrays = {
        name: value
        for name, value in values.items()
        if isinstance(value, np.ndarray) and value.ndim
    }
    return replace(part, **{name: value[rows] for name, value in arrays.items()})


def _renumber(form_factors, number, count):
    """Form factors of patches with other numbers, (p,) int; -1 for those that are gone, which no
    ray meets.
    """
    bits = form_factors.start_bits + form_factors.elements.bit_length() - 1
    parts = []
    for rows in form_factors.rows:
        key = ((number[rows.key >> bits] << bits) | (rows.key & ((1 << bits) - 1))).astype(np.int32)
        # Keys ascend within each row, as the loops expect.
        owner = np.repeat(np.arange(len(rows.chosen)), np.diff(rows.start))
        parts.append(
            Rows(number[rows.chosen], rows.start, key[np.lexsort((key, owner))], rows.rays)
        )
    rays = np.zeros(count, np.int32)
    rays[number[number >= 0]] = form_factors.rays[number >= 0]
    return FormFactors([parts], count, form_factors.elements, rays, form_factors.start_elements)
