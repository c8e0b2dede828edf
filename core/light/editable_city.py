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
from .trace_gather import TracedCity, TracedState

PINNED = ("receivers", "perez", "far-ground")  # effects that are decided as in the base
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
    city: TracedCity
    trail: Trail
    specular: Callable  # PreparedScene -> as of `trace_gather`, or None where all reflect by Lambert's law

    @property
    def decisions(self):
        """What was decided: Decisions."""
        plan = self.city.prepared.plan
        on, kept = {key: plan[key].on for key in PINNED}, {name: getattr(plan, name) for name in KEPT}
        return Decisions(on, kept, self.city.context.bounces, self.suns)

    @property
    def transfer(self):
        """Transfer of the city, both states of its trees included."""
        return self.city.transfer

    @property
    def scene(self):
        """Scene that was traced, with the backs of sheets."""
        return self.city.prepared.scene


def prepare_decided(decisions, scene, request, progress=silent):
    """Materials and patches of a scene, with decisions that were made before: PreparedScene."""
    pinned = replace(request, effects=decisions.on | request.effects)
    prepared = prepare_scene(scene, pinned, suns=decisions.suns, progress=progress)
    return replace(prepared, plan=replace(prepared.plan, **decisions.plan), bounces=decisions.bounces)


def restore_editable(scene, request, transfer, *, decisions, kept, trail, specular):
    """A traced city as it was, from what its rays and suns met: EditableCity.

    Parameters
    ----------
    scene : Scene
    request : Request
    transfer : Transfer
    decisions : Decisions
    kept : dict
        `bits` of SunTask, `room` of TracedCity, and `states`: a dict of each state of the trees, with `traced`,
        `lights` and `direct` of TracedState.
    trail, specular
        As of `EditableCity`.

    Raises
    ------
    InputError
        They are of another scene.
    """
    prepared = replace(build_tree(prepare_decided(decisions, scene, request), request), editable=True)
    context, states = prepare_gather(prepared, request, silent), kept["states"]
    if kept["bits"].shape[1] != len(prepared.patches):
        problem = f"holds rays of {kept['bits'].shape[1]:,} patches, the city has {len(prepared.patches):,}"
        raise InputError("rays.nc", problem, "trace the city again with --editable")
    suns = without_hidden(decisions.suns, prepared.plan.terrain)
    task = prepare_suns(context, [one["traced"] for one in states], suns)
    task.bits = kept["bits"]
    transfers = [replace(transfer, bare=None), transfer.bare][: len(states)]
    states = [TracedState(**one, transfer=own) for one, own in zip(states, transfers, strict=True)]
    return EditableCity(
        decisions.suns, request, TracedCity(prepared, context, task, states, kept["room"]), trail, specular
    )
