"""A traced city that can be edited, from a run or from what was kept of one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ..rays.trail import Trail
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.request import Request
from ..sun.horizon import without_hidden
from ..sun.suns import Suns
from .prepare_scene import build_tree, prepare_scene
from .solve_suns import prepare_suns
from .trace_all import prepare_gather
from .trace_gather import TracedCity, join_seasons

PINNED = ("receivers", "reflectors", "perez", "far-ground")  # effects that are decided as in the base
KEPT = ("terrain", "hidden_suns", "max_bounces", "sky", "rays_share")  # fields of the plan, likewise


@dataclass
class Decisions:
    """What was decided of a city before it was traced, and holds for its edits too."""

    on: dict  # of PINNED: bool
    plan: dict  # of KEPT: values of the plan
    bounces: int  # number of reflections
    suns: Suns


@dataclass
class EditableCity:
    """A traced city that can be edited."""

    suns: Suns
    request: Request
    leaf: TracedCity
    bare: TracedCity | None  # without leaves; None: one state all year
    trail: Trail
    specular: Callable  # PreparedScene -> as of `trace_gather`, or None where all reflect by Lambert's law

    @property
    def decisions(self):
        """What was decided: Decisions."""
        plan = self.leaf.prepared.plan
        on, kept = {key: plan[key].on for key in PINNED}, {name: getattr(plan, name) for name in KEPT}
        return Decisions(on, kept, self.leaf.context.bounces, self.suns)

    @property
    def transfer(self):
        """Transfer of the city, both states of its trees included."""
        return join_seasons(self.leaf.transfer, self.bare and self.bare.transfer, self.leaf.prepared.plan)


def check_editable(prepared, request):
    """Refuse what cannot be edited.

    Raises
    ------
    InputError
    """
    if request.estimator != "gather":
        raise InputError("--estimator", f"a run with {request.estimator} cannot be edited", "give gather")
    if prepared.scene.halo is not None:
        raise InputError("the base", "it was traced in tiles, which cannot be edited", "trace it without tiles")
    if prepared.patches.points_before.any():
        raise InputError("the base", "it has further rounds, which cannot be edited", "trace it in one round")


def prepare_decided(decisions, scene, request, progress=silent):
    """Materials and patches of a scene, with decisions that were made before: PreparedScene."""
    pinned = replace(request, effects=decisions.on | request.effects)
    prepared = prepare_scene(scene, pinned, suns=decisions.suns, progress=progress)
    return replace(prepared, plan=replace(prepared.plan, **decisions.plan), bounces=decisions.bounces)


def restore_editable(scene, request, transfer, *, decisions, states, trail, specular):
    """A traced city as it was, from what its rays and suns met: EditableCity.

    Parameters
    ----------
    scene : Scene
    request : Request
    transfer : Transfer
    decisions : Decisions
    states : list of dict
        Of each state of the trees, fields of TracedCity: traced, lights and direct, and the bits of `Shadows`.
    trail, specular
        As of `EditableCity`.

    Raises
    ------
    InputError
        They are of another scene.
    """
    prepared = replace(build_tree(prepare_decided(decisions, scene, request), request), editable=True)
    found = []
    for bare, kept in enumerate(states):
        traced, bits, lights, direct = (kept[name] for name in ("traced", "bits", "lights", "direct"))
        if len(bits) != len(prepared.patches):
            problem = f"holds rays of {len(bits):,} patches, the city has {len(prepared.patches):,}"
            raise InputError("rays.nc", problem, "trace the city again with --editable")
        state, own = replace(prepared, bare=bool(bare)), transfer.bare if bare else replace(transfer, bare=None)
        context = prepare_gather(state, request, silent)
        task = prepare_suns(context, traced, without_hidden(decisions.suns, state.plan.terrain))
        task.bits = bits
        found.append(TracedCity(state, context, traced, task, lights, direct, own, kept["room"]))
    return EditableCity(decisions.suns, request, found[0], found[1] if len(found) > 1 else None, trail, specular)
