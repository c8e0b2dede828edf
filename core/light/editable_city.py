"""A traced city that can be edited, from a run or from what was kept of one."""

from dataclasses import dataclass, replace

import numpy as np

from ..city.written_scene import written_scene
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.request import BEST_SKY, Request
from ..sun.suns import Suns
from .measure_cover import choose_left_out
from .prepare_scene import prepare_scene
from .shadow_points import find_points
from .solve_suns import prepare_suns
from .specular_light import specular_of
from .trace_all import prepare_gather
from .trace_gather import TracedCity, TracedState, trace_light


@dataclass
class Decisions:
    """What was decided of a city before it was traced, and holds for its edits too."""

    on: dict  # effect that is decided as in the base -> bool
    plan: dict  # of KEPT: values of the plan
    bounces: int  # number of reflections
    suns: Suns


@dataclass
class EditableCity:
    """A traced city that can be edited."""

    suns: Suns
    request: Request
    city: TracedCity
    # (k,) int, surfaces of its scene in the order of the city, racks last; others are gone
    rows: np.ndarray
    drift: float = 0.0  # share of reflected light that edits gave the mean's pattern over the suns
    # of an edit: the city before with more light than it had, where it was needed
    before: "EditableCity | None" = None

    @property
    def decisions(self):
        """What was decided: Decisions."""
        plan = self.city.prepared.plan
        # These effects and fields of the plan are decided as in the base.
        on, kept = (
            {key: plan[key].on for key in ("receivers", BEST_SKY, "far-ground")},
            {
                name: getattr(plan, name)
                for name in ("terrain", "hidden_suns", "max_bounces", "sky", "rays_share")
            },
        )
        return Decisions(on, kept, self.city.context.bounces, self.suns)

    @property
    def transfer(self):
        """Transfer of the city, its surfaces in their order, both states of its trees included."""
        transfer = self.city.transfer
        if len(self.rows) == len(transfer.surfaces) and (np.diff(self.rows) > 0).all():
            return transfer
        return transfer.take(self.rows)

    @property
    def scene(self):
        """Scene of the city, with the backs of sheets."""
        return written_scene(self.city.prepared.scene, self.rows)


def prepare_decided(decisions, scene, request, progress=silent):
    """Materials and patches of a scene, with decisions that were made before: PreparedScene."""
    pinned = replace(request, effects=decisions.on | request.effects)
    prepared = prepare_scene(scene, pinned, suns=decisions.suns, progress=progress)
    return replace(
        prepared, plan=replace(prepared.plan, **decisions.plan), bounces=decisions.bounces
    )


def trace_editable(prepared, suns, request, progress=silent):
    """Trace a city so that it can be edited.

    Parameters
    ----------
    prepared : PreparedScene
    suns : Suns
    request : Request
    progress : callable, optional
        See `core.settings.progress`.

    Returns
    -------
    EditableCity

    Raises
    ------
    CancelledError
    InputError
        It is a tile, a further round, or asks for another estimator than gather.
    """
    if request.estimator != "gather":
        raise InputError(
            "--estimator", f"a run with {request.estimator} cannot be edited", "give gather"
        )
    if prepared.scene.halo is not None:
        raise InputError(
            "the base", "it was traced in tiles, which cannot be edited", "trace it without tiles"
        )
    if prepared.patches.points_before.any():
        raise InputError(
            "the base", "it has further rounds, which cannot be edited", "trace it in one round"
        )
    # Only one round of gather, of a whole city, keeps what an edit needs.
    prepared = replace(prepared.build_tree(request), editable=True)
    city = trace_light(prepared, suns, request, progress, specular=specular_of(prepared))
    return EditableCity(suns, request, city, np.arange(len(prepared.scene.surfaces)))


def restore_editable(scene, request, transfer, *, decisions, kept, drift):
    """A traced city as it was, from what its rays and suns met: EditableCity.

    Parameters
    ----------
    scene : Scene
    request : Request
    transfer : Transfer
    decisions : Decisions
    kept : dict
        `bits` of SunTask, `cramped` of TracedCity, `layout` of GatherContext, `rules` of
        PreparedScene, and `states`: a dict of each state of the trees, with `traced`, `lights` and
        `direct` of TracedState.
    drift
        As of `EditableCity`.

    Raises
    ------
    InputError
        They are of a scene with another number of patches.
    """
    # Patches and Embree's tree as in the traced run, by its decisions.
    prepared = prepare_decided(decisions, scene, request).build_tree(request)
    prepared = replace(prepared, editable=True, rules=kept["rules"])
    context, states = prepare_gather(prepared, request, silent), kept["states"]
    context.layout = kept["layout"]
    if kept["bits"].shape[1] != len(prepared.patches):
        raise InputError(
            "rays.nc",
            f"holds rays of {kept['bits'].shape[1]:,} patches, the city has "
            f"{len(prepared.patches):,}",
            "trace the city again with --editable",
        )
    # Which points see which suns was kept in bits; the points themselves follow from their random
    # numbers.
    context.left_out = choose_left_out(
        prepared.scene, context.patch_to_surface, request, kept["cramped"]
    )
    suns = prepared.plan.without_hidden(decisions.suns)
    task = prepare_suns(context, [state["traced"] for state in states], suns)
    watch = task.watch
    counts = context.points, context.elements
    watch.points = find_points(
        context.patches,
        watch.covered,
        counts,
        watch.traced | watch.unobstructed,
        threads=watch.threads,
        left_out=watch.left_out,
    )
    # Light of both states of trees, with the matrices of the Transfer.
    transfers = [replace(transfer, bare=None, base=None), transfer.bare][: len(states)]
    states = [
        TracedState(**state, transfer=own) for state, own in zip(states, transfers, strict=True)
    ]
    for state_of_trees in states:
        (
            state_of_trees.direct.visible_share,
            state_of_trees.direct.reflected,
            state_of_trees.direct.string_loss,
        ) = (
            state_of_trees.transfer.visible_share,
            state_of_trees.transfer.direct_reflected,
            state_of_trees.transfer.string_loss,
        )
    city = TracedCity(prepared, context, task, states, kept["cramped"], kept["bits"])
    return EditableCity(decisions.suns, request, city, np.arange(len(scene.surfaces)), drift)
